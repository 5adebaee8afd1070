"""`covertool report`: one HTML file, written whole, the same bytes for the same study."""

from pathlib import Path

import geopandas as gpd
import pytest
import shapely

from covertool.gis.write import write_layers
from tests.running import run


@pytest.fixture(scope="module")
def study(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("report") / "town.gpkg"
    road = gpd.GeoDataFrame({"area_m2": [4e4]}, geometry=[shapely.box(0, 0, 400, 100)], crs=2157)
    write_layers(path, {"transit": road}, metadata={"title": "A road"})
    return path


def test_a_study_becomes_one_page_and_the_same_bytes_in_another_process(study, tmp_path):
    pages = [tmp_path / "one.html", tmp_path / "two.html"]
    for page, seed in zip(pages, "12", strict=True):
        done = run("report", study, "-o", page, PYTHONHASHSEED=seed)
        assert done.returncode == 0, done.stderr
        assert done.stdout == ""
        assert f"wrote {page}" in done.stderr
    assert pages[0].read_bytes() == pages[1].read_bytes()
    assert "<title>A road: parked cars as anchors</title>" in pages[0].read_text("utf-8")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one.html", "two.html"]


def test_an_existing_page_is_refused_and_left_as_it_was_unless_overwritten(study, tmp_path):
    page = tmp_path / "town.html"
    page.write_text("mine")
    refused = run("report", study, "-o", page)
    assert refused.returncode == 1
    assert "--overwrite" in refused.stderr
    assert page.read_text() == "mine"
    assert run("report", study, "-o", page, "--overwrite").returncode == 0
    assert page.read_text("utf-8").startswith("<!DOCTYPE html>")


@pytest.mark.parametrize("name", ["town.pdf", "town", "missing/town.html"])
def test_a_file_that_cannot_be_a_page_is_refused_before_the_study_is_read(tmp_path, name):
    done = run("report", tmp_path / "no.gpkg", "-o", tmp_path / name)
    assert done.returncode == 1
    assert "no.gpkg" not in done.stderr
    assert len(done.stderr.splitlines()) == 3


def test_what_is_no_study_is_refused_in_three_lines(tmp_path):
    path = tmp_path / "town.gpkg"
    path.write_bytes(b"no database")
    done = run("report", path, "-o", tmp_path / "town.html")
    assert done.returncode == 1
    assert len(done.stderr.splitlines()) == 3
    assert not (tmp_path / "town.html").exists()

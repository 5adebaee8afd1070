"""What `covertool info` finds in a file, and what `covertool doctor` finds in an installation."""

import json
import subprocess
import sys
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import rasterio
import shapely
from affine import Affine

from covertool.cli.main import main
from covertool.gis.inspection import inspect_file
from covertool.gis.sample import SAMPLE_STUDY, sample_folder


def told(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, object]:
    """Run a verb with --json and return its object."""
    assert main([*words, "--json"]) == 0
    found: dict[str, object] = json.loads(capsys.readouterr().out)
    return found


def test_info_counts_the_sample_study(capsys: pytest.CaptureFixture[str]) -> None:
    found = told(capsys, "info", str(sample_folder() / SAMPLE_STUDY))
    parts = {part["name"]: part for part in found["parts"]}  # type: ignore[attr-defined]
    assert parts["anchors"]["rows"] == 4541
    assert parts["anchors"]["crs"] == "EPSG:2157"
    assert found["metadata"]["synthetic"].startswith("yes")  # type: ignore[index]
    assert found["problems"] == 0


def test_info_names_each_trouble_of_a_layer(tmp_path: Path) -> None:
    bow_tie = shapely.Polygon([(0, 0), (1, 1), (1, 0), (0, 1)])
    good = shapely.box(2, 2, 3, 3)
    places = [bow_tie, good, good, None, shapely.Polygon()]
    path = tmp_path / "zones.gpkg"
    gpd.GeoDataFrame({"name": list("abcde")}, geometry=places, crs=4326).to_file(path)
    (part,) = inspect_file(path).parts
    counted = [problem for problem in part.problems if problem[0].isdigit()]
    assert "1 null geometries" in counted
    assert "1 invalid geometries" in counted
    assert any("repeat another one" in problem for problem in counted)
    assert any("degrees" in problem for problem in part.problems)


def test_info_tells_the_ground_size_of_pixels(tmp_path: Path) -> None:
    path = tmp_path / "coarse.tif"
    with rasterio.open(
        path, "w", driver="GTiff", width=4, height=3, count=1, dtype="uint8",
        crs="EPSG:32632", transform=Affine(0.5, 0, 500000, 0, -0.5, 5300000),
    ) as target:  # fmt: skip
        target.write(np.ones((1, 3, 4), dtype=np.uint8))
    (part,) = inspect_file(path).parts
    # The central meridian of UTM has the scale 0.9996: 0.5 m of map are 0.5002 m of ground.
    assert any("GSD 0.5002 m across" in fact for fact in part.facts)
    assert any("too coarse" in problem for problem in part.problems)
    assert part.rows == 12


def test_info_counts_a_table_without_places(tmp_path: Path) -> None:
    path = tmp_path / "seen.csv"
    path.write_text("time,segment_id,status\n2026-01-01T00:00Z,a,free\n")
    (part,) = inspect_file(path).parts
    assert (part.kind, part.rows, part.columns) == ("table", 1, ("time", "segment_id", "status"))


@pytest.mark.parametrize("name", ["absent.gpkg", "note.docx"])
def test_info_refuses_what_it_cannot_open(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if name == "note.docx":
        (tmp_path / name).write_bytes(b"PK")
    assert main(["info", str(tmp_path / name)]) == 1
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 3
    assert name in said[1]


def test_doctor_finds_this_installation_sound(capsys: pytest.CaptureFixture[str]) -> None:
    found = told(capsys, "doctor")
    assert found["sound"] is True
    names = {check["name"] for check in found["checks"]}  # type: ignore[attr-defined]
    assert {"PROJ", "GDAL", "sample study", "detector", "SUMO"} <= names


@pytest.mark.slow
def test_doctor_exits_1_when_a_projection_database_is_broken(tmp_path: Path) -> None:
    (tmp_path / "proj.db").write_bytes(b"this is no database")
    done = subprocess.run(
        [sys.executable, "-m", "covertool", "doctor"],
        env={"PATH": "/usr/bin:/bin", "PROJ_DATA": str(tmp_path), "PROJ_LIB": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert "BROKEN" in done.stdout
    assert "Traceback" not in done.stderr

"""Files that are absent, broken, hostile or in the way."""

from __future__ import annotations

import os
import shutil
import sqlite3
import stat
from contextlib import closing
from itertools import pairwise
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import rasterio
from affine import Affine

from covertool.gis.sample import SAMPLE_STUDY, sample_folder
from tests.bad_inputs.conftest import CRS, Run, Town, assert_refused, assert_works_like

VECTOR_NAMES = ["a.gpkg", "a.geojson", "a.parquet", "a.fgb", "a.shp", "a.csv"]
NUL = b"\x00" * 4096


def snapshot(folder: Path) -> dict[str, bytes]:
    """Return every file below a folder with its content."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


@pytest.mark.parametrize("name", VECTOR_NAMES)
@pytest.mark.parametrize("content", [b"", NUL, b"garbage, and more of it\n" * 40])
def test_anchors_of_no_bytes_or_of_garbage_are_refused(
    name: str, content: bytes, town: Town, coverage: Run, tmp_path: Path
) -> None:
    path = town.folder / name
    path.write_bytes(content)
    output = tmp_path / "out.gpkg"
    assert_refused(coverage("-o", output, anchors=path), name)
    assert not output.exists()


@pytest.mark.parametrize("name", [*VECTOR_NAMES, "a.tif", "a.docx", "a"])
def test_absent_files_and_folders_are_refused(name: str, town: Town, coverage: Run) -> None:
    assert_refused(coverage(anchors=town.folder / name), name)
    (town.folder / name).mkdir()
    assert_refused(coverage(anchors=town.folder / name), name)


@pytest.mark.parametrize("name", ["a.gpkg", "a.parquet", "a.fgb", "a.geojson"])
@pytest.mark.parametrize("share", [0.3, 0.8])
def test_a_file_that_is_cut_off_is_refused(
    name: str, share: float, town: Town, coverage: Run
) -> None:
    path = town.write(name, town.anchors)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(len(whole) * share)])
    assert_refused(coverage(anchors=path), name)


@pytest.mark.parametrize(
    "path",
    [
        "http://example.com/a.gpkg",
        "https://example.com/a.geojson",
        "/vsicurl/http://example.com/a.gpkg",
        "/vsizip/a.zip/a.gpkg",
        "/vsimem/a.gpkg",
        "s3://bucket/a.parquet",
        "PG:dbname=town",
        "<OGRVRTDataSource/>",
    ],
)
def test_remote_and_virtual_paths_are_refused(path: str, coverage: Run, run: Run) -> None:
    assert_refused(coverage(anchors=path))
    assert_refused(run("extract", path, "--gsd", "0.2", "-o", "out.gpkg"))


VRT = (
    '<VRTDataset rasterXSize="9" rasterYSize="9"><VRTRasterBand dataType="Byte" band="1">'
    '<SimpleSource><SourceFilename relativeToVRT="0">/etc/passwd</SourceFilename>'
    "</SimpleSource></VRTRasterBand></VRTDataset>"
)


@pytest.mark.parametrize("name", ["a.tif", "a.png", "a.jpg", "a.jp2", "a.webp", "a.img"])
def test_a_virtual_raster_in_disguise_is_refused(name: str, town: Town, run: Run) -> None:
    path = town.folder / name
    path.write_text(VRT)
    assert_refused(run("extract", path, "--gsd", "0.2", "-o", town.folder / "out.gpkg"), name)


def image(path: Path, side: int = 64, **options: object) -> Path:
    with rasterio.open(
        path, "w", driver="GTiff", width=side, height=side, count=3, dtype="uint8",
        crs=CRS, transform=Affine(0.2, 0, 693380, 0, -0.2, 737460), **options,
    ) as target:  # fmt: skip
        target.write(np.full((3, side, side), 90, dtype=np.uint8))
    return path


def test_an_image_that_is_cut_off_is_refused_and_nothing_is_written(town: Town, run: Run) -> None:
    path = image(town.folder / "cut.tif", side=512)
    path.write_bytes(path.read_bytes()[: 512 * 512])
    output = town.folder / "out.gpkg"
    assert_refused(run("extract", path, "-o", output), "cut.tif")
    assert not output.exists()


@pytest.mark.parametrize(
    "name", ["mit Leerzeichen", "Straße ÄÖÜ", "日本語", "a'b\"c", "x" * 200, "-dash", "50%", "#1"]
)
def test_odd_names_are_only_names(name: str, town: Town, coverage: Run, tmp_path: Path) -> None:
    folder = tmp_path / name
    folder.mkdir()
    anchors = folder / f"{name[:40]}.gpkg"
    shutil.copyfile(town.anchors_file(), anchors)
    output = folder / f"{name[:40]} out.gpkg"
    assert_works_like(coverage(), coverage("-o", output, anchors=anchors))
    assert len(gpd.read_file(output, layer="anchors")) == 8


def test_an_output_is_not_an_input_by_any_name(town: Town, coverage: Run, run: Run) -> None:
    anchors = town.anchors_file()
    before = snapshot(town.folder)
    assert_refused(coverage("-o", anchors, "--overwrite"), anchors.name)
    link = town.folder / "link.gpkg"
    link.symlink_to(anchors)
    assert_refused(coverage("-o", link, "--overwrite"), "link.gpkg")
    link.unlink()
    town.transit_file()
    assert {k: v for k, v in snapshot(town.folder).items() if k in before} == before


def test_an_existing_output_stays_unless_told_otherwise(
    town: Town, coverage: Run, tmp_path: Path
) -> None:
    output = tmp_path / "out.gpkg"
    output.write_bytes(b"mine")
    assert_refused(coverage("-o", output), "out.gpkg")
    assert output.read_bytes() == b"mine"
    assert coverage("-o", output, "--overwrite").code == 0


@pytest.mark.parametrize("extension", ["", ".docx", ".gpkg.bak", ".exe"])
def test_an_unknown_extension_of_the_output_is_refused(
    extension: str, coverage: Run, tmp_path: Path
) -> None:
    output = tmp_path / f"out{extension}"
    assert_refused(coverage("-o", output), output.name)
    assert list(tmp_path.glob("out*")) == []


def test_a_missing_folder_of_the_output_names_its_mend(coverage: Run, tmp_path: Path) -> None:
    outcome = coverage("-o", tmp_path / "absent" / "out.gpkg")
    assert_refused(outcome, "mkdir -p")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_read_only_folder_is_refused(coverage: Run, tmp_path: Path) -> None:
    folder = tmp_path / "locked"
    folder.mkdir()
    folder.chmod(stat.S_IRUSR | stat.S_IXUSR)
    assert_refused(coverage("-o", folder / "out.gpkg"), "out.gpkg")


def test_the_null_device_and_a_folder_are_no_outputs(coverage: Run, tmp_path: Path) -> None:
    (tmp_path / "folder.gpkg").mkdir()
    assert_refused(coverage("-o", tmp_path / "folder.gpkg", "--overwrite"), "folder.gpkg")
    outcome = coverage("-o", "/dev/full", "--overwrite")
    assert_refused(outcome, "/dev/full")


def test_a_locked_study_is_refused_and_stays(town: Town, run: Run) -> None:
    study = town.folder / "study.gpkg"
    shutil.copyfile(sample_folder() / SAMPLE_STUDY, study)
    before = study.read_bytes()
    with closing(sqlite3.connect(study)) as connection:
        connection.execute("BEGIN EXCLUSIVE")
        assert_refused(run("coverage", study, "--radius", 15, "--into", study), "study.gpkg")
    assert study.read_bytes() == before


def test_a_study_in_wal_mode_is_read_whole(town: Town, coverage: Run) -> None:
    path = town.folder / "wal.gpkg"
    shutil.copyfile(town.anchors_file(), path)
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("PRAGMA journal_mode=WAL")
        connection.execute("CREATE TABLE note (text TEXT)")
        connection.commit()
        assert_works_like(coverage(), coverage(anchors=path))


def test_a_pickle_named_npy_is_not_opened(town: Town, run: Run) -> None:
    path = town.folder / "a.npy"
    np.save(path, np.array([{"a": 1}], dtype=object), allow_pickle=True)
    assert_refused(run("coverage", "--anchors", path, "--transit", town.transit_file()), "a.npy")
    assert_refused(run("extract", path, "--gsd", 0.2, "-o", town.folder / "out.gpkg"), "a.npy")


ENTITY_BOMB = (
    '<?xml version="1.0"?><!DOCTYPE b [<!ENTITY a "' + "a" * 1000 + '">'
    + "".join(f'<!ENTITY {c} "{f"&{p};" * 10}">' for p, c in pairwise("abcdefghi"))
    + "]><{root}>&i;</{root}>"
)  # fmt: skip


@pytest.mark.parametrize(
    ("words", "name", "root"),
    [
        (["transit", "{path}", "-o", "{out}.gpkg"], "bomb.osm", "osm"),
        (["anchors", "parked", "--osm", "{path}", "-o", "{out}.gpkg"], "bomb.osm", "osm"),
        (
            ["congestion", "import", "{path}", "--format", "datex2", "-o", "{out}.csv"],
            "bomb.xml",
            "d2LogicalModel",
        ),
        (
            ["congestion", "import", "{path}", "--format", "sumo", "-o", "{out}.csv", "--time",
             "2026-01-01T00:00Z"],
            "bomb.xml",
            "meandata",
        ),
    ],
)  # fmt: skip
def test_an_entity_bomb_is_refused_at_once(
    words: list[str], name: str, root: str, town: Town, run: Run
) -> None:
    path = town.folder / name
    path.write_text(ENTITY_BOMB.replace("{root}", root))
    out = town.folder / "out"
    outcome = run(*(word.format(path=path, out=out) for word in words))
    assert_refused(outcome, name)
    assert not list(town.folder.glob("out*"))

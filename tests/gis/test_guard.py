"""What may be opened and written, and that a file is replaced whole or not at all."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from covertool.errors import FileError
from covertool.gis import guard
from covertool.gis.formats import RASTER_FORMATS, VECTOR_FORMATS

VRT = '<OGRVRTDataSource><OGRVRTLayer name="x"/></OGRVRTDataSource>'
RASTER_VRT = '<VRTDataset rasterXSize="1" rasterYSize="1"></VRTDataset>'


def test_a_layer_follows_the_last_colon_of_an_existing_file(tmp_path: Path) -> None:
    (tmp_path / "a:b.gpkg").touch()
    assert guard.layer_spec(f"{tmp_path}/a:b.gpkg:roads") == (tmp_path / "a:b.gpkg", "roads")


def test_a_file_with_that_whole_name_wins_over_a_layer(tmp_path: Path) -> None:
    (tmp_path / "a.gpkg").touch()
    (tmp_path / "a.gpkg:roads").touch()
    assert guard.layer_spec(f"{tmp_path}/a.gpkg:roads") == (tmp_path / "a.gpkg:roads", None)


@pytest.mark.parametrize(
    "path",
    [
        "http://example.org/a.gpkg",
        "https://example.org/a.tif",
        "/vsicurl/http://example.org/a.tif",
        "/vsizip/a.zip/a.shp",
        "s3://bucket/a.parquet",
        "",
        "a\0.gpkg",
    ],
)
def test_remote_virtual_and_senseless_paths_are_refused(path: str) -> None:
    with pytest.raises(FileError):
        guard.input_file(path, VECTOR_FORMATS)


def test_absent_folder_empty_and_unknown_files_are_told_apart(tmp_path: Path) -> None:
    (tmp_path / "empty.gpkg").touch()
    (tmp_path / "folder.gpkg").mkdir()
    (tmp_path / "town.xyz").write_text("x")
    told = {}
    for name in ("absent.gpkg", "empty.gpkg", "folder.gpkg", "town.xyz", "n" * 300 + ".gpkg"):
        with pytest.raises(FileError) as caught:
            guard.input_file(tmp_path / name, VECTOR_FORMATS)
        told[name[:6]] = caught.value
        assert name in caught.value.where
    assert "does not exist" in told["absent"].what
    assert "zero bytes" in told["empty."].what
    assert "folder" in told["folder"].what
    assert ".gpkg" in told["town.x"].mend
    assert "too long" in told["nnnnnn"].what


@pytest.mark.parametrize("name", ["a.tif", "a.png", "a.jp2"])
def test_a_vrt_with_the_name_of_an_image_is_not_opened(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_text(RASTER_VRT)
    with pytest.raises(FileError, match="content is not"):
        guard.input_file(path, RASTER_FORMATS)


@pytest.mark.parametrize("name", ["a.gpkg", "a.geojson", "a.fgb", "a.parquet", "a.shp"])
def test_garbage_and_a_vrt_with_the_name_of_a_layer_file_are_not_opened(
    tmp_path: Path, name: str
) -> None:
    for content in (VRT.encode(), os.urandom(200) + b"\n"):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(FileError, match="content is not"):
            guard.input_file(tmp_path / name, VECTOR_FORMATS)


def test_json_that_gdal_would_run_as_a_pipeline_is_not_opened(tmp_path: Path) -> None:
    path = tmp_path / "a.geojson"
    path.write_text(
        '{"type": "gdal_streamed_alg", "command_line": "gdal vector pipeline ! read x"}'
    )
    with pytest.raises(FileError):
        guard.input_file(path, VECTOR_FORMATS)


def test_a_missing_folder_is_mended_by_mkdir(tmp_path: Path) -> None:
    with pytest.raises(FileError) as caught:
        guard.output_file(tmp_path / "out" / "a.gpkg", VECTOR_FORMATS)
    assert caught.value.mend == f"mkdir -p {tmp_path / 'out'}"


def test_an_existing_output_is_refused_without_overwrite(tmp_path: Path) -> None:
    (tmp_path / "a.gpkg").touch()
    with pytest.raises(FileError, match="exists"):
        guard.output_file(tmp_path / "a.gpkg", VECTOR_FORMATS)
    assert guard.output_file(tmp_path / "a.gpkg", VECTOR_FORMATS, overwrite=True)[0].exists()


def test_an_output_that_is_an_input_is_refused_by_any_of_its_names(tmp_path: Path) -> None:
    path = tmp_path / "a.gpkg"
    path.touch()
    (tmp_path / "link.gpkg").symlink_to(path)
    for given in (path, f"{path}:anchors", tmp_path / "link.gpkg"):
        with pytest.raises(FileError, match="same file"):
            guard.output_file(path, VECTOR_FORMATS, overwrite=True, inputs=[given])


def test_a_failed_write_leaves_the_old_file_and_nothing_beside_it(tmp_path: Path) -> None:
    path = tmp_path / "a.gpkg"
    path.write_bytes(b"old")

    def fail() -> None:
        with guard.replacing(path) as temporary:
            temporary.write_bytes(b"half")
            temporary.with_name(temporary.name + "-journal").write_bytes(b"x")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_killed_writer_leaves_the_old_file_and_the_next_writer_sweeps_up(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("old")
    script = (
        "import sys, time; from pathlib import Path; from covertool.gis import guard\n"
        "with guard.replacing(Path(sys.argv[1])) as temporary:\n"
        "    temporary.write_text('half'); print('now', flush=True); time.sleep(60)\n"
    )
    writer = subprocess.Popen([sys.executable, "-c", script, path], stdout=subprocess.PIPE)
    assert writer.stdout is not None
    assert writer.stdout.readline() == b"now\n"
    with guard.replacing(path) as temporary:  # the other is alive and its part stays
        temporary.write_text("mine")
    assert len(list(tmp_path.iterdir())) == 2
    writer.kill()
    writer.communicate()
    assert path.read_text() == "mine"
    with guard.replacing(path) as temporary:
        temporary.write_text("new")
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


def test_a_full_disk_is_an_error_with_a_mend(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"

    def fill() -> None:
        with guard.replacing(path) as temporary:
            temporary.symlink_to("/dev/full")
            temporary.write_bytes(b"x" * 10)

    with pytest.raises(FileError) as caught:
        fill()
    assert "space" in caught.value.what
    assert list(tmp_path.iterdir()) == []


def test_of_a_symbolic_link_the_file_behind_it_is_replaced(tmp_path: Path) -> None:
    target, link = tmp_path / "real.csv", tmp_path / "link.csv"
    target.write_text("old")
    link.symlink_to(target)
    with guard.replacing(link) as temporary:
        temporary.write_text("new")
    assert link.is_symlink()
    assert target.read_text() == "new"

"""What a VRT or a list may name, with VRTs that GDAL's own program wrote where it is there."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import rasterio
from rasterio.transform import Affine

from covertool.errors import FileError
from covertool.gis import georaster
from covertool.gis.geotiff import open_raster
from covertool.gis.raster_lists import raster_files

BUILD = shutil.which("gdalbuildvrt")
needs_gdal = pytest.mark.skipif(BUILD is None, reason="gdalbuildvrt is not installed")


def tile(path: Path, column: int, *, bands: int = 3, crs: str = "EPSG:2157") -> Path:
    path.parent.mkdir(exist_ok=True)
    place = Affine(0.2, 0, 600_000 + 20 * column, 0, -0.2, 750_000)
    with rasterio.open(
        path, "w", driver="GTiff", width=100, height=80, count=bands, dtype="uint8", crs=crs,
        transform=place,
    ) as out:  # fmt: skip
        out.write(np.full((bands, 80, 100), 60 + column, np.uint8))
    return path


def vrt(
    folder: Path,
    source: str,
    *,
    relative: int = 1,
    kind: str = "SimpleSource",
    band: int = 1,
    seen: str = 'xOff="0" yOff="0" xSize="100" ySize="80"',
    drawn: str = 'xOff="0" yOff="0" xSize="100" ySize="80"',
    more: str = "",
    head: str = "",
    attributes: str = "",
) -> Path:
    path = folder / "town.vrt"
    path.write_text(
        f"""{head}<VRTDataset rasterXSize="200" rasterYSize="80" {attributes}>
  <SRS>EPSG:2157</SRS>
  <GeoTransform>600000.0, 0.2, 0.0, 750000.0, 0.0, -0.2</GeoTransform>
  <VRTRasterBand dataType="Byte" band="1"><ColorInterp>Red</ColorInterp>
    <{kind}><SourceFilename relativeToVRT="{relative}">{source}</SourceFilename>
      <SourceBand>{band}</SourceBand><SrcRect {seen}/><DstRect {drawn}/>{more}</{kind}>
  </VRTRasterBand>
</VRTDataset>
"""
    )
    return path


def test_a_raster_stands_for_itself() -> None:
    assert raster_files("a.tif") == [Path("a.tif")]


@needs_gdal
@pytest.mark.parametrize("more", [[], ["-addalpha"], ["-resolution", "highest"]])
def test_the_images_of_gdals_own_vrt_are_found_the_last_drawn_first(
    tmp_path: Path, more: list[str]
) -> None:
    names = [str(tile(tmp_path / "tiles" / f"{i}.tif", i)) for i in range(3)]
    path = tmp_path / "town.vrt"
    subprocess.run([str(BUILD), "-q", *more, str(path), *names], check=True)
    assert raster_files(path) == [Path(name).resolve() for name in names[::-1]]


@needs_gdal
def test_a_vrt_that_cuts_its_images_is_refused(tmp_path: Path) -> None:
    name = tile(tmp_path / "a.tif", 0)
    path = tmp_path / "cut.vrt"
    window = ["-te", "600004", "749990", "600016", "749998"]
    subprocess.run([str(BUILD), "-q", *window, str(path), str(name)], check=True)
    with pytest.raises(FileError, match=r"a part of a\.tif"):
        raster_files(path)


def test_a_vrt_written_by_hand_is_read_too(tmp_path: Path) -> None:
    name = tile(tmp_path / "a.tif", 0)
    assert raster_files(vrt(tmp_path, "a.tif")) == [name.resolve()]
    assert raster_files(vrt(tmp_path, str(name), relative=0)) == [name.resolve()]


@pytest.mark.parametrize(
    "source", ["../secret.tif", "sub/../../secret.tif", "/etc/passwd", "link/secret.tif"]
)
def test_a_vrt_never_reaches_outside_its_folder(tmp_path: Path, source: str) -> None:
    tile(tmp_path / "secret.tif", 0)
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "link").symlink_to(tmp_path, target_is_directory=True)
    with pytest.raises(FileError, match="outside its own folder"):
        raster_files(vrt(folder, source))


@pytest.mark.parametrize(
    "source",
    ["http://example.org/a.tif", "/vsicurl/http://example.org/a.tif", "/vsizip/a.zip/a.tif", ""],
)
def test_a_vrt_names_only_files_on_disk(tmp_path: Path, source: str) -> None:
    with pytest.raises(FileError):
        raster_files(vrt(tmp_path, source))


def test_what_a_vrt_names_passes_the_door_for_rasters(tmp_path: Path) -> None:
    (tmp_path / "inner.tif").write_text("<VRTDataset/>")
    with pytest.raises(FileError, match="not GeoTIFF"):
        raster_files(vrt(tmp_path, "inner.tif"))
    (tmp_path / "inner.vrt").write_text("<VRTDataset/>")
    with pytest.raises(FileError, match="extension"):
        raster_files(vrt(tmp_path, "inner.vrt"))
    with pytest.raises(FileError, match="does not exist"):
        raster_files(vrt(tmp_path, "absent.tif"))


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"kind": "KernelFilteredSource"}, "KernelFilteredSource"),
        ({"kind": "ComplexSource", "more": "<LUT>0:255,255:0</LUT>"}, "LUT"),
        ({"kind": "ComplexSource", "more": "<NODATA>7</NODATA>"}, "no data"),
        ({"band": 3}, "band 3 as band 1"),
        ({"seen": 'xOff="0" yOff="0" xSize="50" ySize="80"'}, "a part"),
        ({"drawn": 'xOff="40" yOff="0" xSize="100" ySize="80"'}, "another place"),
        ({"drawn": 'xOff="0" yOff="0" xSize="200" ySize="160"'}, "another place"),
        ({"drawn": 'xOff="x" yOff="0" xSize="200" ySize="160"'}, "cannot be read"),
        ({"attributes": 'subClass="VRTWarpedDataset"'}, "VRTWarpedDataset"),
        ({"head": '<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b "c">]>'}, "DOCTYPE"),
    ],
)
def test_a_vrt_that_does_more_than_a_mosaic_is_refused(
    tmp_path: Path, change: dict[str, object], told: str
) -> None:
    tile(tmp_path / "a.tif", 0)
    with pytest.raises(FileError, match=told):
        raster_files(vrt(tmp_path, "a.tif", **change))  # type: ignore[arg-type]


def test_a_vrt_that_is_no_xml_or_names_nothing_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "town.vrt"
    path.write_text("<VRTDataset><VRTRasterBand></VRTDataset>")
    with pytest.raises(FileError, match="no XML"):
        raster_files(path)
    path.write_text("<VRTDataset></VRTDataset>")
    with pytest.raises(FileError, match="names no image"):
        raster_files(path)


def test_a_list_names_files_beside_it_one_a_line(tmp_path: Path) -> None:
    path = tmp_path / "tiles.txt"
    path.write_text("# the town\na.tif\r\n\nsub/b.tif\n/data/c.tif\na.tif\n", encoding="utf-8-sig")
    assert raster_files(path) == [
        tmp_path / "a.tif", tmp_path / "sub" / "b.tif", Path("/data/c.tif")
    ]  # fmt: skip
    path.write_text("# nothing\n")
    with pytest.raises(FileError, match="names no file"):
        raster_files(path)
    path.write_text("/vsicurl/http://example.org/a.tif\n")
    with pytest.raises(FileError, match="not opened"):
        raster_files(path)


def test_a_mosaic_of_many_files_holds_few_of_them_open(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(georaster, "_MOST_OPEN", 2)
    rasters = [open_raster(tile(tmp_path / f"{i}.tif", i)) for i in range(5)]
    for _ in range(2):
        seen = [int(raster.read(0, 0, 1, 1)[0, 0, 0]) for raster in rasters]
        assert seen == [60, 61, 62, 63, 64]
        assert sum(raster._handles in georaster._OPENED.datasets for raster in rasters) <= 2

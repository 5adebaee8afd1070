"""Rasters of every kind: the right pixels, and each pixel at its right place in metres."""

import logging
import math
import pickle
import tracemalloc
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
from pyproj import CRS, Geod, Transformer
from rasterio.enums import ColorInterp
from rasterio.transform import Affine

from covertool import crs as crs_door
from covertool.errors import CrsError, FileError, OptionError
from covertool.gis.geotiff import open_raster

LON, LAT = -6.594, 53.381  # Maynooth
WIDTH, HEIGHT = 60, 40


def pixels(bands: int, dtype: str = "uint8") -> np.ndarray:
    rng = np.random.default_rng(7)
    top = 4000 if dtype == "uint16" else 256
    return rng.integers(1, top, (bands, HEIGHT, WIDTH)).astype(dtype)


def save(path: Path, data: np.ndarray, **profile: Any) -> Path:
    bands, height, width = data.shape
    drivers = {".tif": "GTiff", ".png": "PNG", ".jpg": "JPEG", ".jp2": "JP2OpenJPEG"}
    settings: dict[str, Any] = {
        "driver": drivers[path.suffix],
        "count": bands,
        "height": height,
        "width": width,
        "dtype": data.dtype,
        **profile,
    }
    colorinterp = settings.pop("colorinterp", None)
    with rasterio.open(path, "w", **settings) as dataset:
        if colorinterp:
            dataset.colorinterp = colorinterp
        dataset.write(data)
    return path


def placed(crs: CRS, size: float, turn: Callable[[Affine], Affine] = lambda a: a) -> Affine:
    x, y = Transformer.from_crs(4326, crs, always_xy=True).transform(LON, LAT)
    return turn(Affine.translation(x, y) @ Affine.scale(size, -size))


CASES = {
    "EPSG:2157": (CRS(2157), 0.2, lambda a: a),
    "UTM": (CRS(32629), 0.2, lambda a: a),
    "web mercator": (CRS(3857), 0.2, lambda a: a),
    "degrees": (CRS(4326), 2e-6, lambda a: a),
    "US feet": (CRS("+proj=utm +zone=29 +datum=WGS84 +units=us-ft"), 0.5, lambda a: a),
    "rotated": (CRS(2157), 0.2, lambda a: a @ Affine.rotation(31)),
    "sheared": (CRS(2157), 0.2, lambda a: a @ Affine.shear(20, 0)),
    "anisotropic": (CRS(2157), 0.2, lambda a: a @ Affine.scale(1, 2.5)),
    "south up": (CRS(2157), 0.2, lambda a: a @ Affine.scale(1, -1)),
    "west right": (CRS(2157), 0.2, lambda a: a @ Affine.scale(-1, 1)),
}


@pytest.mark.parametrize("case", CASES, ids=str)
def test_every_pixel_is_at_its_place_on_earth(tmp_path: Path, case: str) -> None:
    crs, size, turn = CASES[case]
    affine = placed(crs, size, turn)
    path = save(tmp_path / "a.tif", pixels(3), crs=crs.to_wkt(), transform=affine)
    raster = open_raster(path)
    assert crs_door.is_working(raster.crs)
    x_px, y_px = np.array([0.0, 60.0, 13.5]), np.array([0.0, 40.0, 27.25])
    x_m, y_m = raster.to_metres(x_px, y_px)
    got = Transformer.from_crs(raster.crs, 4326, always_xy=True).transform(x_m, y_m)
    expected = Transformer.from_crs(crs, 4326, always_xy=True).transform(*(affine @ (x_px, y_px)))
    np.testing.assert_allclose(got, expected, atol=1e-8)  # 1 mm
    np.testing.assert_allclose(raster.to_pixels(x_m, y_m), [x_px, y_px], atol=1e-4)


@pytest.mark.parametrize("case", CASES, ids=str)
def test_the_gsd_is_the_size_of_a_pixel_on_the_ground(tmp_path: Path, case: str) -> None:
    crs, size, turn = CASES[case]
    affine = placed(crs, size, turn)
    path = save(tmp_path / "a.tif", pixels(1), crs=crs.to_wkt(), transform=affine)
    to_wgs84 = Transformer.from_crs(crs, 4326, always_xy=True)
    corner, right, down = (to_wgs84.transform(*(affine @ p)) for p in ((9, 9), (10, 9), (9, 10)))
    geod = Geod(ellps="WGS84")
    expected = (geod.inv(*corner, *right)[2], geod.inv(*corner, *down)[2])
    assert open_raster(path).gsd_m(9.5, 9.5) == pytest.approx(expected, rel=1e-3)


def test_web_mercator_pixels_are_smaller_on_the_ground_and_that_is_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.WARNING, logger="covertool")
    logging.getLogger("covertool").propagate = True
    crs = CRS(3857)
    path = save(tmp_path / "a.tif", pixels(1), crs=crs.to_wkt(), transform=placed(crs, 0.2))
    gsd = open_raster(path).gsd_m(0, 0)
    assert gsd[0] == pytest.approx(0.2 * math.cos(math.radians(LAT)), rel=5e-3)
    assert "cos(latitude)" in caplog.text


@pytest.mark.parametrize(
    ("suffix", "bands", "dtype"),
    [
        (".tif", 1, "uint8"),
        (".tif", 3, "uint16"),
        (".tif", 4, "uint8"),
        (".tif", 1, "float32"),
        (".png", 3, "uint8"),
        (".png", 1, "uint16"),
        (".jp2", 3, "uint8"),
    ],
)
def test_windows_hold_the_right_pixels_and_zeros_outside(
    tmp_path: Path, suffix: str, bands: int, dtype: str
) -> None:
    data = pixels(bands, dtype)
    extra = {"QUALITY": "100", "REVERSIBLE": "YES"} if suffix == ".jp2" else {}
    if bands == 4:
        extra = {"photometric": "minisblack"}
    raster = open_raster(save(tmp_path / f"a{suffix}", data, **extra), gsd_m=0.5)
    assert (raster.width, raster.height, raster.bands) == (WIDTH, HEIGHT, bands)
    padded = np.pad(data, ((0, 0), (50, 50), (50, 50)))
    for x0, y0, width, height in ((0, 0, 60, 40), (-7, -9, 20, 20), (55, 35, 30, 9), (5, 6, 7, 8)):
        window = raster.read(x0, y0, width, height)
        expected = padded[:, y0 + 50 : y0 + 50 + height, x0 + 50 : x0 + 50 + width]
        np.testing.assert_array_equal(window, expected)
        assert window.dtype == data.dtype
        np.testing.assert_array_equal(raster.valid(x0, y0, width, height), expected[0] > 0)
    assert not raster.read(500, 500, 4, 4).any()
    assert not raster.valid(-50, 0, 4, 4).any()


def test_alpha_is_no_band_and_tells_what_is_valid(tmp_path: Path) -> None:
    data = pixels(4)
    data[3] = 255
    data[3, :10] = 0
    kinds = [ColorInterp.red, ColorInterp.green, ColorInterp.blue, ColorInterp.alpha]
    for name in ("a.tif", "a.png"):
        raster = open_raster(save(tmp_path / name, data, colorinterp=kinds), gsd_m=1)
        assert raster.bands == 3
        np.testing.assert_array_equal(raster.read(0, 0, WIDTH, HEIGHT), data[:3])
        np.testing.assert_array_equal(raster.valid(0, 0, WIDTH, HEIGHT), data[3] > 0)


def test_nodata_and_nan_are_not_valid(tmp_path: Path) -> None:
    data = pixels(1)
    data[0, 5, 5] = 0
    raster = open_raster(save(tmp_path / "a.tif", data, nodata=0), gsd_m=1)
    assert np.argwhere(~raster.valid(0, 0, WIDTH, HEIGHT)).tolist() == [[5, 5]]
    floats = pixels(2, "float32")
    floats[1, 3, 4] = np.nan
    raster = open_raster(save(tmp_path / "b.tif", floats), gsd_m=1)
    assert np.argwhere(~raster.valid(0, 0, WIDTH, HEIGHT)).tolist() == [[3, 4]]


def test_a_paletted_image_is_read_as_its_colours(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    data = np.zeros((1, HEIGHT, WIDTH), dtype=np.uint8)
    data[0, 3, 4] = 1
    with rasterio.open(
        path, "w", driver="PNG", count=1, height=HEIGHT, width=WIDTH, dtype="uint8"
    ) as dataset:
        dataset.write(data)
        dataset.write_colormap(1, {0: (10, 20, 30, 255), 1: (200, 100, 50, 255)})
    raster = open_raster(path, gsd_m=1)
    assert raster.bands == 3
    assert raster.read(4, 3, 1, 1).ravel().tolist() == [200, 100, 50]
    assert raster.read(0, 0, 1, 1).ravel().tolist() == [10, 20, 30]


def test_an_image_without_georeference_lies_in_the_image_plane(tmp_path: Path) -> None:
    path = save(tmp_path / "a.png", pixels(3))
    raster = open_raster(path, gsd_m=0.125)
    assert raster.crs == crs_door.IMAGE_PLANE
    x, y = raster.to_metres(np.array([0.0, WIDTH]), np.array([HEIGHT, 0.0]))
    assert x.tolist() == [0, WIDTH * 0.125]
    assert y.tolist() == [0, HEIGHT * 0.125]
    assert raster.gsd_m(3, 4) == (0.125, 0.125)


def test_crs_and_origin_place_the_lower_left_corner(tmp_path: Path) -> None:
    path = save(tmp_path / "a.png", pixels(3))
    raster = open_raster(path, gsd_m=0.5, crs="EPSG:2157", origin=(695000, 737000))
    x, y = raster.to_metres(np.array([0.0, 10.0]), np.array([HEIGHT, HEIGHT - 4.0]))
    assert x.tolist() == [695000, 695005]
    assert y.tolist() == [737000, 737002]
    assert raster.crs.to_epsg() == 2157


def test_an_image_without_georeference_needs_a_gsd(tmp_path: Path) -> None:
    path = save(tmp_path / "a.png", pixels(3))
    with pytest.raises(OptionError) as caught:
        open_raster(path)
    assert "--gsd" in caught.value.mend
    for wrong in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(OptionError):
            open_raster(path, gsd_m=wrong)
    with pytest.raises(OptionError, match="together"):
        open_raster(path, gsd_m=1, crs="EPSG:2157")
    with pytest.raises(OptionError, match="together"):
        open_raster(path, gsd_m=1, origin=(0, 0))
    for wrong_crs in ("EPSG:4326", "EPSG:3857"):
        with pytest.raises(CrsError):
            open_raster(path, gsd_m=1, crs=wrong_crs, origin=(0, 0))


def test_a_gsd_crs_or_origin_against_the_georeference_is_refused(tmp_path: Path) -> None:
    crs = CRS(2157)
    path = save(tmp_path / "a.tif", pixels(1), crs=crs.to_wkt(), transform=placed(crs, 0.2))
    assert open_raster(path, gsd_m=0.2).gsd_m(0, 0)[0] == pytest.approx(0.2, rel=1e-3)
    with pytest.raises(OptionError, match=r"0\.2.*0\.5"):
        open_raster(path, gsd_m=0.5)
    with pytest.raises(CrsError, match=r"EPSG:2157.*EPSG:32629"):
        open_raster(path, crs="EPSG:32629")
    with pytest.raises(OptionError):
        open_raster(path, origin=(0, 0))


def test_a_georeference_without_a_crs_needs_one_named(tmp_path: Path) -> None:
    path = save(tmp_path / "a.tif", pixels(1), transform=placed(CRS(2157), 0.2))
    with pytest.raises(CrsError) as caught:
        open_raster(path)
    assert "--crs" in caught.value.mend
    assert open_raster(path, crs="EPSG:2157").crs.to_epsg() == 2157


def test_metres_labelled_as_degrees_are_refused(tmp_path: Path) -> None:
    path = save(tmp_path / "a.tif", pixels(1), crs="EPSG:4326", transform=placed(CRS(2157), 0.2))
    with pytest.raises(CrsError, match="not in degrees"):
        open_raster(path)


def test_an_open_raster_travels_to_other_processes_and_threads(tmp_path: Path) -> None:
    data = pixels(3)
    raster = open_raster(save(tmp_path / "a.tif", data), gsd_m=1)
    raster.read(0, 0, 5, 5)
    copy = pickle.loads(pickle.dumps(raster))
    assert copy == raster
    with ThreadPoolExecutor(4) as pool:
        rows = list(pool.map(lambda y: copy.read(0, y, WIDTH, 1), range(HEIGHT)))
    np.testing.assert_array_equal(np.concatenate(rows, axis=1), data)


def test_a_huge_sparse_image_costs_only_its_window(tmp_path: Path) -> None:
    path = tmp_path / "a.tif"
    side = 200_000
    with rasterio.open(
        path,
        "w",
        driver="GTiff",
        count=3,
        width=side,
        height=side,
        dtype="uint8",
        tiled=True,
        compress="deflate",
        sparse_ok=True,
        bigtiff="yes",
        crs="EPSG:2157",
        transform=Affine(0.1, 0, 600000, 0, -0.1, 750000),
    ):
        pass
    raster = open_raster(path)
    tracemalloc.start()
    assert not raster.read(side - 256, side - 256, 512, 512).any()
    assert raster.valid(0, 0, 512, 512).shape == (512, 512)
    assert tracemalloc.get_traced_memory()[1] < 20e6
    tracemalloc.stop()


def test_a_broken_image_is_refused_not_guessed(tmp_path: Path) -> None:
    path = save(tmp_path / "a.tif", pixels(3, "uint16"))
    path.write_bytes(path.read_bytes()[:3000])
    with pytest.raises(FileError) as caught:
        open_raster(path, gsd_m=1).read(0, 0, WIDTH, HEIGHT)
    assert str(path) == caught.value.where
    for name in ("a.png", "a.jpg", "a.jp2"):
        cut = save(tmp_path / name, pixels(3))
        cut.write_bytes(cut.read_bytes()[: cut.stat().st_size // 2])
        with pytest.raises(FileError):
            open_raster(cut, gsd_m=1).read(0, 0, WIDTH, HEIGHT)
    path.write_bytes(b"II*\x00" + b"\xff" * 50)
    with pytest.raises(FileError):
        open_raster(path, gsd_m=1)


def test_reading_writes_nothing_beside_the_image(tmp_path: Path) -> None:
    path = save(tmp_path / "a.png", pixels(3))
    raster = open_raster(path, gsd_m=1)
    raster.read(0, 0, 9, 9)
    raster.valid(0, 0, 9, 9)
    assert list(tmp_path.iterdir()) == [path]

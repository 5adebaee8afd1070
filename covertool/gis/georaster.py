"""A raster file read window by window, each pixel at its exact place in metres."""

from __future__ import annotations

import math
import os
import threading
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt
import rasterio
from pyproj import CRS
from rasterio.enums import ColorInterp, MaskFlags
from rasterio.errors import NotGeoreferencedWarning, RasterioError
from rasterio.transform import Affine
from rasterio.windows import Window

from covertool import crs as crs_door
from covertool.errors import FileError
from covertool.gis.formats import RASTER_FORMATS
from covertool.model import Floats

# GDAL keeps decoded blocks up to 5 % of the machine's memory in each process; windows that are
# read once, row by row, need no more than one row of blocks. It asks once, before its first block.
os.environ.setdefault("GDAL_CACHEMAX", "64")

# Beside an image GDAL opens these by any driver; a VRT so named could read any file or address.
_COMPANIONS = (".msk", ".ovr", ".MSK", ".OVR")
_TIFF = tuple(sign for _, sign in RASTER_FORMATS[0].signatures)


@dataclass(frozen=True)
class GeoRaster:
    """A raster file that is read window by window; see `covertool.model.RasterSource`.

    Attributes
    ----------
    path : Path
        The file.
    name : str
        Its file name.
    width, height, bands : int
        Size in pixels, and number of bands without alpha (three for a colour table).
    crs : CRS
        Working CRS of the metres.
    raster_crs : CRS
        CRS of the affine transform.
    affine : tuple of 6 floats
        Pixel to raster CRS: x = a c + b r + c0, y = d c + e r + f0, as (a, b, c0, d, e, f0).
    dtype : str
        Type of the pixels, such as ``uint8``.
    """

    path: Path
    name: str
    width: int
    height: int
    bands: int
    crs: CRS
    raster_crs: CRS
    affine: tuple[float, float, float, float, float, float]
    dtype: str
    driver: str
    _handles: _Handles = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_handles", _Handles(self.path, self.driver))

    def read(self, x0: int, y0: int, width: int, height: int) -> npt.NDArray[Any]:
        """Return (bands, height, width) of a window; outside the image it is padded with zeros."""
        out = np.zeros((self.bands, height, width), dtype=self.dtype)
        inside = _overlap(self, x0, y0, width, height)
        if inside is not None:
            window, rows, columns = inside
            out[:, rows, columns] = self._pixels(window)
        return out

    def valid(self, x0: int, y0: int, width: int, height: int) -> npt.NDArray[np.bool_]:
        """Return (height, width): True where the pixel holds data (alpha, nodata, inside)."""
        out = np.zeros((height, width), dtype=bool)
        inside = _overlap(self, x0, y0, width, height)
        if inside is not None:
            window, rows, columns = inside
            good = self._mask(window)
            if np.issubdtype(np.dtype(self.dtype), np.floating):
                good &= np.isfinite(self._pixels(window)).all(axis=0)
            out[rows, columns] = good
        return out

    def to_metres(self, x_px: Floats, y_px: Floats) -> tuple[Floats, Floats]:
        """Return pixel coordinates as metres in ``crs``."""
        x, y = np.asarray(x_px, dtype=float), np.asarray(y_px, dtype=float)
        map_x, map_y = apply_affine(Affine(*self.affine), x, y)
        return crs_door.transform(map_x, map_y, self.raster_crs, self.crs)

    def to_pixels(self, x_m: Floats, y_m: Floats) -> tuple[Floats, Floats]:
        """Return metres in ``crs`` as pixel coordinates."""
        x, y = np.asarray(x_m, dtype=float), np.asarray(y_m, dtype=float)
        map_x, map_y = crs_door.transform(x, y, self.crs, self.raster_crs)
        return apply_affine(~Affine(*self.affine), map_x, map_y)

    def gsd_m(self, x_px: float, y_px: float) -> tuple[float, float]:
        """Return the ground size of a pixel along its x and y axis in metres at that place."""
        offsets_x = np.array([-0.5, 0.5, 0.0, 0.0, 0.0]) + x_px
        offsets_y = np.array([0.0, 0.0, -0.5, 0.5, 0.0]) + y_px
        x, y = self.to_metres(offsets_x, offsets_y)
        scale = crs_door.scale_factor(self.crs, float(x[4]), float(y[4]))
        along = math.hypot(x[1] - x[0], y[1] - y[0])
        down = math.hypot(x[3] - x[2], y[3] - y[2])
        return along / scale, down / scale

    def _mask(self, window: Window) -> npt.NDArray[np.bool_]:
        dataset = self._handles.dataset()
        if all(MaskFlags.all_valid in flags for flags in dataset.mask_flag_enums):
            return np.ones((window.height, window.width), dtype=bool)  # GDAL would fill it slowly
        with _Told(self.path):
            good: npt.NDArray[np.bool_] = dataset.dataset_mask(window=window) > 0
            return good

    def _pixels(self, window: Window) -> npt.NDArray[Any]:
        dataset = self._handles.dataset()
        with _Told(self.path):
            table = colour_table(dataset)
            if table is not None:
                return np.moveaxis(table[dataset.read(1, window=window)], -1, 0)
            pixels: npt.NDArray[Any] = dataset.read(data_bands(dataset), window=window)
            return pixels


class _Opened(threading.local):
    """The datasets that a thread holds open, the one used last at the end."""

    def __init__(self) -> None:
        self.datasets: WeakKeyDictionary[_Handles, Any] = WeakKeyDictionary()


_OPENED = _Opened()
_MOST_OPEN = 100
"""Systems let a process hold some hundred files open; a mosaic may have thousands."""


class _Handles:
    """Opens a raster once a thread; what is pickled is only the path."""

    def __init__(self, path: Path, driver: str) -> None:
        self.path = path
        self.driver = driver

    def __getstate__(self) -> tuple[Path, str]:
        return self.path, self.driver

    def __setstate__(self, state: tuple[Path, str]) -> None:
        self.path, self.driver = state

    def dataset(self) -> Any:
        """Return the open dataset; the one that was not used for longest is closed for it."""
        held = _OPENED.datasets
        opened = held.pop(self, None)
        if opened is None:
            opened = open_dataset(self.path, self.driver)
        held[self] = opened
        if len(held) > _MOST_OPEN:
            held.pop(next(iter(held))).close()
        return opened


class _Told:
    """Turn rasterio's errors into one that names the file."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __enter__(self) -> None:
        return None

    def __exit__(self, _kind: object, error: BaseException | None, _trace: object) -> None:
        if isinstance(error, RasterioError):
            cause = error.__cause__ or error
            raise FileError(
                f"the raster cannot be read: {cause}", str(self.path), "copy or export it again"
            ) from None


def open_dataset(path: Path, driver: str) -> Any:
    """Return an open rasterio dataset, by one driver only, without detours over other files."""
    for suffix in _COMPANIONS:
        _require_tiff(Path(f"{path}{suffix}"))
    with _Told(path), warnings.catch_warnings():
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        dataset = rasterio.open(path, driver=driver, sharing=False)
        if "OVERVIEW_FILE" in dataset.tags(ns="OVERVIEWS"):
            dataset.close()
            raise FileError(
                "the image says that its overviews are another file, which is not opened",
                str(path),
                "write it again without them: gdal_translate IN.tif OUT.tif",
            )
        return dataset


def _require_tiff(companion: Path) -> None:
    """Refuse a mask or overview beside an image that GDAL would open by any driver it has."""
    if not companion.is_file():
        return
    with companion.open("rb") as file:
        head = file.read(4)
    if head not in _TIFF:
        raise FileError(
            "the mask or overview beside the image is no TIFF",
            str(companion),
            "remove it, or make it anew with gdaladdo",
        )


def apply_affine(affine: Affine, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return pixel coordinates as map coordinates (or back, with the inverse)."""
    a, b, c, d, e, f = tuple(affine)[:6]
    return a * x + b * y + c, d * x + e * y + f


def data_bands(dataset: Any) -> list[int]:
    """Return the numbers of the bands that are not alpha."""
    interpretations = zip(dataset.indexes, dataset.colorinterp, strict=True)
    return [int(band) for band, kind in interpretations if kind != ColorInterp.alpha]


def colour_table(dataset: Any) -> npt.NDArray[np.uint8] | None:
    """Return (256, 3) colours of a paletted image, or None."""
    if dataset.count != 1 or dataset.colorinterp[0] != ColorInterp.palette:
        return None
    table = np.zeros((256, 3), dtype=np.uint8)
    for index, colour in dataset.colormap(1).items():
        table[index] = colour[:3]
    return table


def _overlap(
    raster: GeoRaster, x0: int, y0: int, width: int, height: int
) -> tuple[Window, slice, slice] | None:
    """Return the part of a window inside the image, and its rows and columns in the window."""
    left, right = max(x0, 0), min(x0 + width, raster.width)
    top, bottom = max(y0, 0), min(y0 + height, raster.height)
    if left >= right or top >= bottom:
        return None
    window = Window(left, top, right - left, bottom - top)
    return window, slice(top - y0, bottom - y0), slice(left - x0, right - x0)

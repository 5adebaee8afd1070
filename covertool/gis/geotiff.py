"""Rasters: opened window by window with exact places in metres, and written as level maps."""

from __future__ import annotations

import logging
import math
import threading
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import rasterio
from pyproj import CRS
from rasterio.enums import ColorInterp
from rasterio.errors import RasterioError
from rasterio.transform import Affine
from rasterio.windows import Window

from covertool import crs as crs_door
from covertool.errors import CrsError, FileError, OptionError
from covertool.gis import guard
from covertool.gis.formats import RASTER_FORMATS, Format
from covertool.gis.level_raster import write_level_raster
from covertool.model import Floats

__all__ = ["GeoRaster", "open_raster", "write_level_raster"]

_LOG = logging.getLogger(__name__)

_GSD_TOLERANCE = 0.05


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
            with _Told(self.path):
                good = self._handles.dataset().dataset_mask(window=window) > 0
            if np.issubdtype(np.dtype(self.dtype), np.floating):
                good &= np.isfinite(self._pixels(window)).all(axis=0)
            out[rows, columns] = good
        return out

    def to_metres(self, x_px: Floats, y_px: Floats) -> tuple[Floats, Floats]:
        """Return pixel coordinates as metres in ``crs``."""
        x, y = np.asarray(x_px, dtype=float), np.asarray(y_px, dtype=float)
        map_x, map_y = _apply(Affine(*self.affine), x, y)
        return crs_door.transform(map_x, map_y, self.raster_crs, self.crs)

    def to_pixels(self, x_m: Floats, y_m: Floats) -> tuple[Floats, Floats]:
        """Return metres in ``crs`` as pixel coordinates."""
        x, y = np.asarray(x_m, dtype=float), np.asarray(y_m, dtype=float)
        map_x, map_y = crs_door.transform(x, y, self.crs, self.raster_crs)
        return _apply(~Affine(*self.affine), map_x, map_y)

    def gsd_m(self, x_px: float, y_px: float) -> tuple[float, float]:
        """Return the ground size of a pixel along its x and y axis in metres at that place."""
        offsets_x = np.array([-0.5, 0.5, 0.0, 0.0, 0.0]) + x_px
        offsets_y = np.array([0.0, 0.0, -0.5, 0.5, 0.0]) + y_px
        x, y = self.to_metres(offsets_x, offsets_y)
        scale = crs_door.scale_factor(self.crs, float(x[4]), float(y[4]))
        along = math.hypot(x[1] - x[0], y[1] - y[0])
        down = math.hypot(x[3] - x[2], y[3] - y[2])
        return along / scale, down / scale

    def _pixels(self, window: Window) -> npt.NDArray[Any]:
        dataset = self._handles.dataset()
        with _Told(self.path):
            table = _colour_table(dataset)
            if table is not None:
                return np.moveaxis(table[dataset.read(1, window=window)], -1, 0)
            pixels: npt.NDArray[Any] = dataset.read(_data_bands(dataset), window=window)
            return pixels


class _Handles:
    """Opens a raster once a thread; what is pickled is only the path."""

    def __init__(self, path: Path, driver: str) -> None:
        self.path = path
        self.driver = driver
        self._local = threading.local()

    def __getstate__(self) -> tuple[Path, str]:
        return self.path, self.driver

    def __setstate__(self, state: tuple[Path, str]) -> None:
        self.path, self.driver = state
        self._local = threading.local()

    def dataset(self) -> Any:
        opened = getattr(self._local, "dataset", None)
        if opened is None:
            opened = _open(self.path, self.driver)
            self._local.dataset = opened
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


def _open(path: Path, driver: str) -> Any:
    import warnings

    with _Told(path), warnings.catch_warnings():
        warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)
        return rasterio.open(path, driver=driver, sharing=False)


def open_raster(
    path: str | Path,
    *,
    gsd_m: float | None = None,
    crs: str | CRS | None = None,
    origin: tuple[float, float] | None = None,
) -> GeoRaster:
    """Return a raster to read window by window, with places in metres.

    Parameters
    ----------
    path : str or Path
        A GeoTIFF (or COG), PNG, JPEG, JPEG2000, WebP or Erdas Imagine file.
    gsd_m : float or None
        Ground size of a pixel in metres, for an image without georeference.
    crs : str, CRS or None
        CRS of an image that names none. Together with ``gsd_m`` and ``origin`` it places an image
        without georeference, north up.
    origin : (float, float) or None
        Map x, y of the image's lower left corner in ``crs``.

    Raises
    ------
    FileError
        When the file cannot be opened.
    OptionError
        When the GSD is missing, not above zero, or not that of the georeference.
    CrsError
        When the georeference has no CRS, or another one than ``crs``.
    """
    checked, known = guard.input_file(path, RASTER_FORMATS)
    if gsd_m is not None and not (math.isfinite(gsd_m) and gsd_m > 0):
        raise OptionError(f"a GSD of {gsd_m} m is not above zero", "--gsd", "give metres, as 0.125")
    assigned = crs_door.parse(crs) if crs is not None else None
    dataset = _open(checked, known.driver)
    try:
        found = _raster_crs(dataset)
        if dataset.transform != Affine.identity():
            _refuse_origin(origin, checked)
            raster_crs = _settled(found, assigned, checked)
            raster = _raster(checked, known, dataset, raster_crs, tuple(dataset.transform)[:6])
            _compare_gsd(raster, gsd_m)
            return raster
        placed_in = assigned or (found if origin is not None else None)
        return _placed(checked, known, dataset, gsd_m, placed_in, origin)
    finally:
        dataset.close()


def _raster_crs(dataset: Any) -> CRS | None:
    if dataset.crs is None:
        return None
    found = CRS.from_wkt(dataset.crs.to_wkt())
    return crs_door.IMAGE_PLANE if crs_door.is_image_plane(found) else found


def _settled(found: CRS | None, assigned: CRS | None, path: Path) -> CRS:
    if found is None and assigned is None:
        raise CrsError(
            "the raster has a georeference and names no CRS", str(path), "add --crs EPSG:CODE"
        )
    if found is None:
        assert assigned is not None
        return assigned
    if assigned is not None and not found.equals(assigned, ignore_axis_order=True):
        raise CrsError(
            f"the raster is in {crs_door.name(found)} and --crs says {crs_door.name(assigned)}",
            str(path),
            "leave --crs out; it only names a missing CRS",
        )
    return found


def _refuse_origin(origin: tuple[float, float] | None, path: Path) -> None:
    if origin is not None:
        raise OptionError("the raster has a georeference of its own", str(path), "leave --origin")


def _placed(
    path: Path,
    known: Format,
    dataset: Any,
    gsd_m: float | None,
    crs: CRS | None,
    origin: tuple[float, float] | None,
) -> GeoRaster:
    """Return an image without georeference, placed by its GSD, CRS and origin."""
    if gsd_m is None:
        raise OptionError(
            "the image has no georeference, so the size of its pixels is not known",
            str(path),
            "add --gsd METRES, the ground size of a pixel, such as --gsd 0.125",
        )
    if (crs is None) != (origin is None):
        raise OptionError(
            "an image without georeference is placed by a CRS and an origin together",
            str(path),
            "give both --crs EPSG:CODE and --origin X,Y, or neither",
        )
    if crs is not None and not crs_door.is_working(crs):
        raise CrsError(
            f"{crs_door.name(crs)} is not a conformal CRS in metres",
            str(path),
            "place the image in a projected CRS, such as EPSG:2157 or a UTM zone",
        )
    x0, y0 = origin or (0.0, 0.0)
    affine = (gsd_m, 0.0, x0, 0.0, -gsd_m, y0 + gsd_m * dataset.height)
    return _raster(path, known, dataset, crs or crs_door.IMAGE_PLANE, affine)


def _raster(
    path: Path, known: Format, dataset: Any, raster_crs: CRS, affine: tuple[float, ...]
) -> GeoRaster:
    a, b, c, d, e, f = affine
    if abs(a * e - b * d) == 0 or not all(map(math.isfinite, affine)):
        raise FileError(
            "the georeference is degenerate", str(path), "georeference the image again in QGIS"
        )
    columns = np.array([0.0, dataset.width, dataset.width, 0.0])
    rows = np.array([0.0, 0.0, dataset.height, dataset.height])
    x, y = _apply(Affine(*affine), columns, rows)
    bounds = (float(x.min()), float(y.min()), float(x.max()), float(y.max()))
    if raster_crs.is_geographic and (abs(bounds[0]) > 360 or max(-bounds[1], bounds[3]) > 90):
        raise CrsError(
            f"the georeference is not in degrees, as {crs_door.name(raster_crs)} says",
            str(path),
            "give the raster its true CRS, with gdal_edit -a_srs or in QGIS",
        )
    if crs_door.is_web_mercator(raster_crs):
        _LOG.warning(
            "warning: %s: the metres of %s are 1 / cos(latitude) too long; corrected",
            path,
            crs_door.name(raster_crs),
        )
    colours = _colour_table(dataset) is not None
    return GeoRaster(
        path=path,
        name=path.name,
        width=dataset.width,
        height=dataset.height,
        bands=3 if colours else len(_data_bands(dataset)),
        crs=crs_door.working_crs(raster_crs, bounds),
        raster_crs=raster_crs,
        affine=(a, b, c, d, e, f),
        dtype=dataset.dtypes[0],
        driver=known.driver,
    )


def _apply(affine: Affine, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    a, b, c, d, e, f = tuple(affine)[:6]
    return a * x + b * y + c, d * x + e * y + f


def _compare_gsd(raster: GeoRaster, gsd_m: float | None) -> None:
    if gsd_m is None:
        return
    along, down = raster.gsd_m(raster.width / 2, raster.height / 2)
    if abs(math.sqrt(along * down) / gsd_m - 1) > _GSD_TOLERANCE:
        raise OptionError(
            f"the georeference gives pixels of {along:.4g} x {down:.4g} m, --gsd says {gsd_m:g} m",
            str(raster.path),
            "leave --gsd out",
        )


def _data_bands(dataset: Any) -> list[int]:
    """Return the numbers of the bands that are not alpha."""
    interpretations = zip(dataset.indexes, dataset.colorinterp, strict=True)
    return [int(band) for band, kind in interpretations if kind != ColorInterp.alpha]


def _colour_table(dataset: Any) -> npt.NDArray[np.uint8] | None:
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

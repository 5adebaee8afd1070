"""Rasters: opened window by window with exact places in metres, and written as level maps."""

from __future__ import annotations

import logging
import math
from pathlib import Path
from typing import Any

import numpy as np
from pyproj import CRS
from rasterio.transform import Affine

from covertool import crs as crs_door
from covertool.errors import CrsError, FileError, OptionError
from covertool.gis import guard
from covertool.gis.formats import RASTER_FORMATS, Format
from covertool.gis.georaster import GeoRaster, apply_affine, colour_table, data_bands, open_dataset
from covertool.gis.level_raster import write_level_raster

__all__ = ["GeoRaster", "has_georeference", "open_raster", "write_level_raster"]

_LOG = logging.getLogger(__name__)

_GSD_TOLERANCE = 0.05


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

    Examples
    --------
    >>> import tempfile
    >>> from covertool.gis.picture import write_picture
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_picture(f"{folder}/road.png", np.zeros((40, 100, 3), dtype=np.uint8))
    ...     raster = open_raster(f"{folder}/road.png", gsd_m=0.125)
    >>> raster.width, raster.height, raster.gsd_m(50.0, 20.0)
    (100, 40, (0.125, 0.125))
    """
    checked, known = guard.input_file(path, RASTER_FORMATS)
    if gsd_m is not None and not (math.isfinite(gsd_m) and gsd_m > 0):
        raise OptionError(f"a GSD of {gsd_m} m is not above zero", "--gsd", "give metres, as 0.125")
    assigned = crs_door.parse(crs) if crs is not None else None
    dataset = open_dataset(checked, known.driver)
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
    return crs_door.settled(CRS.from_wkt(dataset.crs.to_wkt()))


def _settled(found: CRS | None, assigned: CRS | None, path: Path) -> CRS:
    """Return the CRS of a georeference: its own, or the one that the user assigns to it."""
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
    """Return an opened raster at its place on the map, once its georeference has been checked."""
    a, b, c, d, e, f = affine
    if abs(a * e - b * d) == 0 or not all(map(math.isfinite, affine)):
        raise FileError(
            "the georeference is degenerate", str(path), "georeference the image again in QGIS"
        )
    columns = np.array([0.0, dataset.width, dataset.width, 0.0])
    rows = np.array([0.0, 0.0, dataset.height, dataset.height])
    x, y = apply_affine(Affine(*affine), columns, rows)
    bounds = (float(x.min()), float(y.min()), float(x.max()), float(y.max()))
    if raster_crs.is_geographic and (abs(bounds[0]) > 360 or max(-bounds[1], bounds[3]) > 90):
        raise CrsError(
            f"the georeference is not in degrees, as {crs_door.name(raster_crs)} says",
            str(path),
            "give the raster its true CRS, with gdal_edit -a_srs or in QGIS",
        )
    if crs_door.is_web_mercator(raster_crs):
        _LOG.warning(
            "%s: the metres of %s are 1 / cos(latitude) too long; corrected",
            path,
            crs_door.name(raster_crs),
        )
    colours = colour_table(dataset) is not None
    return GeoRaster(
        path=path,
        name=path.name,
        width=dataset.width,
        height=dataset.height,
        bands=3 if colours else len(data_bands(dataset)),
        crs=crs_door.working_crs(raster_crs, bounds),
        raster_crs=raster_crs,
        affine=(a, b, c, d, e, f),
        dtype=dataset.dtypes[0],
        driver=known.driver,
    )


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


def has_georeference(path: str | Path) -> bool:
    """Return True when a raster says itself where its pixels lie."""
    checked, known = guard.input_file(path, RASTER_FORMATS)
    dataset = open_dataset(checked, known.driver)
    try:
        return bool(dataset.transform != Affine.identity())
    finally:
        dataset.close()

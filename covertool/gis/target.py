"""The CRS to compute in, for data as it came."""

from __future__ import annotations

import logging

import numpy as np
import shapely
from pyproj import CRS

from covertool import crs as crs_door
from covertool.errors import CrsError
from covertool.model import Bounds, Objects

_LOG = logging.getLogger(__name__)

AnyCrs = str | CRS | None
_SCALE_TOLERANCE = 0.01


def pick(geometries: Objects, source: CRS, dst_crs: AnyCrs, where: str) -> CRS:
    """Return the working CRS for geometries of ``source``: the one asked for, else the best.

    What surprises is logged: the web's Mercator, a projection that does not keep circles round,
    and data so wide that no one projection is true all over.

    Parameters
    ----------
    geometries : (N,) the data
    source : its CRS
    dst_crs : what was asked for; None picks one
    where : the file and layer, for messages

    Raises
    ------
    CrsError
        When ``dst_crs`` cannot be computed in, or the data does not lie on Earth.
    """
    bounds = _bounds(geometries, source)
    target = _asked(dst_crs) or crs_door.working_crs(*((source, bounds) if bounds else _NOWHERE))
    if target == source or source.is_geographic:
        told = ""
    elif crs_door.is_web_mercator(source):
        told = "has metres that are 1 / cos(latitude) too long"
    elif not crs_door.is_conformal(source):
        told = "does not keep circles round"
    else:
        told = ""
    if told:
        _LOG.warning(
            "%s: %s %s; transformed to %s",
            where,
            crs_door.name(source),
            told,
            crs_door.name(target),
        )
    if bounds is not None:
        _warn_of_stretch(bounds, source, target, where)
    return target


_NOWHERE = (crs_door.WGS84, (0.0, 0.0, 0.0, 0.0))


def _asked(dst_crs: AnyCrs) -> CRS | None:
    if dst_crs is None:
        return None
    target = crs_door.parse(dst_crs, "--dst-crs")
    if not crs_door.is_working(target):
        raise CrsError(
            f"covertool cannot compute in {crs_door.name(target)}",
            "--dst-crs",
            "name a conformal projected CRS in metres, such as EPSG:2157 or a UTM zone",
        )
    return target


def _bounds(geometries: Objects, source: CRS) -> Bounds | None:
    """Return bounds whose middle is the data's, also where it spans the antimeridian."""
    if len(geometries) == 0:
        return None
    x0, y0, x1, y1 = (float(value) for value in shapely.total_bounds(geometries))
    if source.is_geographic and x1 - x0 > 180:
        east = shapely.bounds(geometries)[:, [0, 2]] % 360
        x0, x1 = float(east.min()), float(east.max())
    return (x0, y0, x1, y1)


def _warn_of_stretch(bounds: Bounds, source: CRS, target: CRS, where: str) -> None:
    """Warn when lengths at the corners of the data are off by more than one in a hundred."""
    if crs_door.is_image_plane(target):
        return
    x, y = np.array(bounds)[[0, 2, 0, 2]], np.array(bounds)[[1, 1, 3, 3]]
    x_m, y_m = crs_door.transform(x, y, source, target)
    corners = [crs_door.scale_factor(target, px, py) for px, py in zip(x_m, y_m, strict=True)]
    stretch = float(np.nanmax(np.abs(np.array(corners) - 1)))
    if not stretch <= _SCALE_TOLERANCE:
        _LOG.warning(
            "%s: the data is so wide that lengths in %s are off by up to %.1f %%",
            where,
            crs_door.name(target),
            100 * stretch,
        )

"""The one door for coordinate systems: parse, judge, pick and transform.

Coordinates are always in the order x (east), y (north), whatever order the CRS itself declares;
that is the order in which GIS files hold them. Inside covertool they are metres in one projected,
conformal CRS (or in the engineering CRS of a picture without georeference).
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
import shapely
from pyproj import CRS, Proj, Transformer
from pyproj.exceptions import CRSError as PyprojError

from covertool.errors import CrsError
from covertool.model import Bounds, Floats, Objects

if TYPE_CHECKING:
    import geopandas as gpd

WGS84 = CRS.from_epsg(4326)
IRISH_TM = CRS.from_epsg(2157)
_IRELAND: Bounds = (-10.56, 51.39, -5.34, 55.43)
_WEB_MERCATOR = (3857, 900913, 102100)
_CONFORMAL = ("mercator", "lambert conic conformal", "stereographic", "cassini", "krovak")

IMAGE_PLANE = CRS.from_wkt(
    'ENGCRS["image plane, metres",EDATUM["lower left corner of the image"],'
    'CS[Cartesian,2],AXIS["x",east,ORDER[1]],AXIS["y",north,ORDER[2]],LENGTHUNIT["metre",1]]'
)
"""Engineering CRS of a picture that has a GSD and no georeference: x east, y north, in metres."""


def parse(text: str | CRS, where: str = "--crs") -> CRS:
    """Return the CRS that a text names (``EPSG:2157``, WKT, PROJ string).

    Raises
    ------
    CrsError
        When PROJ does not know it.

    Examples
    --------
    >>> parse("EPSG:2157").to_epsg()
    2157
    """
    try:
        return CRS.from_user_input(text)
    except PyprojError:
        raise CrsError(
            f"the coordinate reference system {text!r} is not known to PROJ",
            where,
            "name it by its EPSG code, such as EPSG:2157 (Ireland) or EPSG:32632 (UTM 32N)",
        ) from None


def is_image_plane(crs: CRS) -> bool:
    """Return True for the engineering CRS of a picture, which has no place on Earth."""
    return crs.is_engineering or crs.type_name == "Engineering CRS"


def settled(crs: CRS) -> CRS:
    """Return the CRS of a file; every image plane is the one that covertool computes in."""
    return IMAGE_PLANE if is_image_plane(crs) else crs


def name(crs: CRS) -> str:
    """Return ``EPSG:n`` where there is one, else the name of the CRS.

    >>> name(WGS84)
    'EPSG:4326'
    """
    authority = crs.to_authority(min_confidence=70)
    return ":".join(authority) if authority else crs.name


def is_web_mercator(crs: CRS) -> bool:
    """Return True for the web's Mercator, whose metres are 1 / cos(latitude) too long."""
    return crs.to_epsg(min_confidence=70) in _WEB_MERCATOR or "pseudo-mercator" in crs.name.lower()


def unit_m(crs: CRS) -> float:
    """Return the length of the CRS's unit in metres, NaN for degrees.

    >>> round(unit_m(CRS(2263)), 6)
    0.304801
    """
    if crs.is_geographic:
        return math.nan
    return float(crs.axis_info[0].unit_conversion_factor)


def is_conformal(crs: CRS) -> bool:
    """Return True when the projection keeps circles round (a Mercator or conic conformal kind).

    >>> is_conformal(CRS(2157)), is_conformal(CRS(3035))
    (True, False)
    """
    operation = crs.coordinate_operation
    method = operation.method_name.lower() if operation is not None else ""
    return any(kind in method for kind in _CONFORMAL)


def is_working(crs: CRS) -> bool:
    """Return True when covertool can compute in this CRS: metres, east and north, conformal.

    The declared order of the axes does not matter: coordinates are held in the order x, y.
    """
    if is_image_plane(crs):
        return True
    if not crs.is_projected or is_web_mercator(crs) or not is_conformal(crs):
        return False
    directions = {axis.direction.lower() for axis in crs.axis_info[:2]}
    return abs(unit_m(crs) - 1.0) < 1e-12 and directions == {"east", "north"}


def transform(x: Floats, y: Floats, source: CRS, target: CRS) -> tuple[Floats, Floats]:
    """Return coordinates of ``source`` in ``target``; both in the order x, y.

    Parameters
    ----------
    x, y : (N,) east and north, or longitude and latitude, in the unit of ``source``
    source, target : the two systems

    Points that cannot be transformed come back as infinity.

    Raises
    ------
    CrsError
        When one of the two has no place on Earth and the other has.

    Examples
    --------
    >>> x, y = transform(np.array([-8.0]), np.array([53.5]), WGS84, IRISH_TM)
    >>> print(round(float(x[0]), 3), round(float(y[0]), 3))
    600000.0 750000.0
    """
    if source == target:
        return np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    _refuse_image_plane(source, target)
    new_x, new_y = _transformer(source, target).transform(x, y)
    return np.asarray(new_x, dtype=float), np.asarray(new_y, dtype=float)


def transform_geometries(geometries: Objects, source: CRS, target: CRS) -> Objects:
    """Return shapely geometries of ``source`` in ``target``, vertex by vertex."""
    if source == target:
        return geometries
    _refuse_image_plane(source, target)

    def move(points: Floats) -> Floats:
        return np.column_stack(transform(points[:, 0], points[:, 1], source, target))

    moved: Objects = shapely.transform(geometries, move)
    return moved


def transform_frame(frame: gpd.GeoDataFrame, target: CRS) -> gpd.GeoDataFrame:
    """Return a layer in another CRS, vertex by vertex, with all its columns."""
    source = CRS.from_user_input(frame.crs)
    if source == target:
        return frame
    moved = transform_geometries(np.asarray(frame.geometry.array, dtype=object), source, target)
    return frame.set_geometry(list(moved), crs=None).set_crs(target, allow_override=True)


def working_crs(source: CRS, bounds: Bounds) -> CRS:
    """Return the CRS in which to compute for data of ``source`` within ``bounds``.

    The source itself when it is projected, conformal and in metres; in Ireland EPSG:2157;
    elsewhere the UTM zone (or polar stereographic) of the middle of the bounds.

    Examples
    --------
    >>> working_crs(WGS84, (-6.61, 53.37, -6.58, 53.39)).to_epsg()
    2157
    >>> working_crs(WGS84, (24.9, 60.1, 25.0, 60.2)).to_epsg()
    32635
    """
    if is_working(source):
        return source
    x, y = np.array([(bounds[0] + bounds[2]) / 2]), np.array([(bounds[1] + bounds[3]) / 2])
    lon_array, lat_array = transform(x, y, source, WGS84)
    lon, lat = float(lon_array[0]), float(lat_array[0])
    if 180 < abs(lon) <= 360:  # data that crosses the antimeridian
        lon -= math.copysign(360, lon)
    if not (math.isfinite(lon) and math.isfinite(lat) and abs(lat) <= 90 and abs(lon) <= 180):
        raise CrsError(
            f"the coordinates do not lie on Earth (middle at {x[0]:.6g}, {y[0]:.6g})",
            f"data in {name(source)}",
            "assign the CRS that the coordinates really have with --crs",
        )
    if _IRELAND[0] <= lon <= _IRELAND[2] and _IRELAND[1] <= lat <= _IRELAND[3]:
        return IRISH_TM
    return utm(lon, lat)


def utm(lon: float, lat: float) -> CRS:
    """Return the WGS 84 UTM zone of a place; beyond 84 N and 80 S the polar stereographic.

    >>> utm(11.57, 48.14).to_epsg()
    32632
    """
    if lat > 84:
        return CRS.from_epsg(5041)
    if lat < -80:
        return CRS.from_epsg(5042)
    zone = min(int((lon + 180) // 6) + 1, 60)
    return CRS.from_epsg((32600 if lat >= 0 else 32700) + zone)


def scale_factor(crs: CRS, x: float, y: float) -> float:
    """Return map metres for each metre on the ground at a place; 1 for an image plane.

    Examples
    --------
    >>> round(scale_factor(IRISH_TM, 600000.0, 750000.0), 6)
    0.99982
    """
    if is_image_plane(crs):
        return 1.0
    geodetic = crs.geodetic_crs
    assert geodetic is not None
    lon, lat = transform(np.array([x]), np.array([y]), crs, geodetic)
    return float(Proj(crs).get_factors(float(lon[0]), float(lat[0])).parallel_scale)


@lru_cache(maxsize=64)
def _transformer(source: CRS, target: CRS) -> Transformer:
    return Transformer.from_crs(source, target, always_xy=True)


def _refuse_image_plane(source: CRS, target: CRS) -> None:
    if is_image_plane(source) or is_image_plane(target):
        raise CrsError(
            "coordinates of an image plane have no place on Earth",
            f"{name(source)} to {name(target)}",
            "extract again with --crs EPSG:CODE and --origin X,Y of the lower left corner",
        )

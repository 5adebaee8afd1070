"""What comes in: anchors, transit areas, polygons and whole studies, in metres in one CRS."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from pyproj import CRS

from covertool import crs as crs_door
from covertool.dsrc import DEVICE_CLASSES
from covertool.errors import ColumnError, CrsError, FileError, GeometryError
from covertool.gis import guard, repair, tables
from covertool.gis.formats import GEOPACKAGE
from covertool.gis.layers import Layer, column, geometry_layers, read_layer, readable
from covertool.gis.repair import Repairs
from covertool.model import ORIGINS, SITES, Anchors, Floats, Objects, Study, TransitArea, Vehicles

if TYPE_CHECKING:
    import geopandas as gpd

_LOG = logging.getLogger(__name__)

AnyCrs = str | CRS | None


def read_anchors(spec: str | Path, *, crs: AnyCrs = None, dst_crs: AnyCrs = None) -> Anchors:
    """Return the anchors of a GIS layer or CSV file in a working CRS.

    Points are taken as they are, multipoints one by one, polygons (cars seen from above) by their
    centroid. Columns ``id``, ``radius_m``, ``device_class``, ``sigma_m`` and ``origin`` are read
    when they are there.

    Parameters
    ----------
    spec : str or Path
        ``FILE`` or ``FILE:LAYER``; without a layer ``anchors``, else the only one.
    crs : str, CRS or None
        CRS of a file that names none.
    dst_crs : str, CRS or None
        Working CRS to transform to; picked by `covertool.crs.working_crs` when None.

    Raises
    ------
    FileError, CrsError, ColumnError, GeometryError
        When the input cannot be used; what is repaired is counted in a logged warning.
    """
    layer = read_layer(spec, "anchors", crs)
    repairs = Repairs(layer.where)
    rows, x, y = _places(layer, repairs)
    target = _working(layer, np.asarray(shapely.points(x, y)), dst_crs)
    x_m, y_m = crs_door.transform(x, y, layer.crs, target)
    keep = np.isfinite(x_m) & np.isfinite(y_m)
    repairs.note(f"points that {crs_door.name(target)} cannot hold dropped", int((~keep).sum()))
    _require_some(len(layer.frame), int(keep.sum()), layer.where)
    frame = layer.frame.iloc[rows[keep]]
    tables.warn_of_near_misses([str(name) for name in frame.columns], layer.where)
    anchors = Anchors(
        id=_ids(frame, repairs),
        x_m=x_m[keep],
        y_m=y_m[keep],
        radius_m=_radii(frame, layer.where),
        device_class=_letters(frame, layer.where),
        sigma_m=_floats(frame, "sigma_m", layer.where),
        origin=_origins(frame, layer.where),
        crs=target,
    )
    repairs.tell()
    return anchors


def read_transit(spec: str | Path, *, crs: AnyCrs = None, dst_crs: AnyCrs = None) -> TransitArea:
    """Return the transit area of a polygon layer in a working CRS, as valid, disjoint parts.

    Parameters are those of `read_anchors`; the default layer is ``transit``.

    Raises
    ------
    FileError, CrsError, GeometryError
        When the input cannot be used or holds no area.
    """
    layer = read_layer(spec, "transit", crs)
    frame = _polygon_frame(layer, dst_crs)
    return TransitArea(repair.unite(np.asarray(frame.geometry.array), layer.where), frame.crs)


def read_polygons(
    spec: str | Path, *, crs: AnyCrs = None, dst_crs: AnyCrs = None
) -> gpd.GeoDataFrame:
    """Return a polygon layer (zones, an area of interest) with its columns, in a working CRS.

    Parameters are those of `read_anchors`; without a layer name the only layer is read.
    """
    return _polygon_frame(read_layer(spec, None, crs), dst_crs)


def read_study(path: str | Path, *, dst_crs: AnyCrs = None) -> Study:
    """Return what a study GeoPackage holds, with anchors, transit area and vehicles in one CRS.

    Raises
    ------
    FileError
        When the file is no GeoPackage or has neither anchors nor a transit area.
    """
    checked, known = guard.input_file(path, (GEOPACKAGE,))
    with readable(checked, known) as opened:
        names = geometry_layers(opened, checked)
    if not {"anchors", "transit", "vehicles"} & set(names):
        raise FileError(
            f"the study has no layer anchors, transit or vehicles (found: {', '.join(names)})",
            str(checked),
            "make one with covertool extract, or name layers with --anchors and --transit",
        )
    transit = read_transit(f"{checked}:transit", dst_crs=dst_crs) if "transit" in names else None
    target = transit.crs if transit is not None else dst_crs
    anchors = read_anchors(f"{checked}:anchors", dst_crs=target) if "anchors" in names else None
    target = anchors.crs if target is None and anchors is not None else target
    vehicles = _read_vehicles(f"{checked}:vehicles", target) if "vehicles" in names else None
    return Study(anchors, transit, vehicles)


def _places(layer: Layer, repairs: Repairs) -> tuple[Any, Floats, Floats]:
    """Return for each usable place its row in the layer and its coordinates."""
    geometries: Objects = np.asarray(layer.frame.geometry.array, dtype=object)
    rows = np.flatnonzero(repair.usable(geometries, repairs))
    rows = rows[repair.within_degrees(geometries[rows], layer.crs, repairs)]
    kinds = shapely.get_type_id(geometries[rows])
    polygon = np.isin(kinds, repair.POLYGONS)
    geometries = geometries.copy()
    geometries[rows[polygon]] = shapely.centroid(geometries[rows[polygon]])
    repairs.note("polygons taken by their centroid", int(polygon.sum()))
    other = ~polygon & ~np.isin(kinds, repair.POINTS)
    repairs.note("geometries that are neither points nor polygons dropped", int(other.sum()))
    rows = rows[~other]
    _require_some(len(layer.frame), rows.size, layer.where)
    xy, owner = shapely.get_coordinates(geometries[rows], return_index=True)
    return rows[owner], xy[:, 0], xy[:, 1]


def _require_some(given: int, kept: int, where: str) -> None:
    if given and not kept:
        raise GeometryError(
            f"none of the {given} geometries can be used",
            where,
            "check its coordinates and CRS in QGIS",
        )
    if not given:
        _LOG.warning("warning: %s: the layer is empty", where)


def _polygon_frame(layer: Layer, dst_crs: AnyCrs) -> gpd.GeoDataFrame:
    repairs = Repairs(layer.where)
    geometries: Objects = np.asarray(layer.frame.geometry.array, dtype=object).copy()
    rows = np.flatnonzero(repair.usable(geometries, repairs))
    rows = rows[repair.within_degrees(geometries[rows], layer.crs, repairs)]
    found = repair.polygons(geometries[rows], repairs)
    keep = ~shapely.is_missing(found)
    rows, found = rows[keep], found[keep]
    _require_some(len(layer.frame), rows.size, layer.where)
    target = _working(layer, found, dst_crs)
    moved = crs_door.transform_geometries(found, layer.crs, target)
    good = repair.usable(moved, repairs)
    moved = repair.polygons(moved[good], repairs)
    repairs.tell()
    frame = layer.frame.iloc[rows[good]].reset_index(drop=True)
    return frame.set_geometry(list(moved), crs=None).set_crs(target, allow_override=True)


def _working(layer: Layer, geometries: Objects, dst_crs: AnyCrs) -> CRS:
    """Return the working CRS for a layer; the transformations that surprise are logged."""
    target = _given_target(dst_crs)
    if target is None:
        target = crs_door.working_crs(layer.crs, _bounds(geometries, layer.crs))
    if target != layer.crs and not layer.crs.is_geographic:
        reason = "does not keep circles round"
        if crs_door.is_web_mercator(layer.crs):
            reason = "has metres that are 1 / cos(latitude) too long"
        elif crs_door.is_working(layer.crs) or crs_door.is_conformal(layer.crs):
            return target
        _LOG.warning(
            "warning: %s: %s %s; transformed to %s",
            layer.where,
            crs_door.name(layer.crs),
            reason,
            crs_door.name(target),
        )
    return target


def _given_target(dst_crs: AnyCrs) -> CRS | None:
    if dst_crs is None:
        return None
    target = crs_door.parse(dst_crs, "--dst-crs")
    if not crs_door.is_working(target):
        raise CrsError(
            f"covertool cannot compute in {crs_door.name(target)}; circles and metres must be true",
            "--dst-crs",
            "name a conformal projected CRS in metres, such as EPSG:2157 or a UTM zone",
        )
    return target


def _bounds(geometries: Objects, crs: CRS) -> tuple[float, float, float, float]:
    """Return bounds whose middle is the data's, also where it spans the antimeridian."""
    if len(geometries) == 0:
        return (0.0, 0.0, 0.0, 0.0)
    x0, y0, x1, y1 = (float(value) for value in shapely.total_bounds(geometries))
    if crs.is_geographic and x1 - x0 > 180:
        x = shapely.bounds(geometries)[:, 0] % 360
        middle = (float(x.min()) + float(x.max())) / 2
        middle = middle - 360 if middle > 180 else middle
        return (middle, y0, middle, y1)
    return (x0, y0, x1, y1)


def _ids(frame: gpd.GeoDataFrame, repairs: Repairs) -> Objects:
    """Return ids as text; numbered from 1 where missing, renumbered where not unique."""
    numbered = np.array([str(i + 1) for i in range(len(frame))], dtype=object)
    name = column(frame, "id")
    if name is None:
        return numbered
    given = frame[name]
    ids = np.array([_plain_id(value) for value in given], dtype=object)
    missing = given.isna().to_numpy()
    ids[missing] = ""
    _, first = np.unique(ids.astype(str), return_index=True)
    repeated = np.ones(len(ids), dtype=bool)
    repeated[first] = False
    bad = repeated | missing
    if not bad.any():
        return ids
    repairs.note("repeated or missing ids numbered anew", int(bad.sum()))
    taken = set(ids[~bad])
    fresh = (str(n) for n in range(1, 2 * len(ids) + 1) if str(n) not in taken)
    ids[bad] = [next(fresh) for _ in range(int(bad.sum()))]
    return ids


def _plain_id(value: object) -> str:
    return str(int(value)) if isinstance(value, float) and value.is_integer() else str(value)


def _floats(frame: gpd.GeoDataFrame, name: str, where: str) -> Floats:
    """Return a column as floats that are positive or NaN (unknown)."""
    found = column(frame, name)
    if found is None:
        return np.full(len(frame), np.nan)
    values = tables.numbers(frame[found]).to_numpy(dtype=float)
    text = np.isnan(values) & ~frame[found].isna().to_numpy()
    if text.any():
        worst = frame[found].to_numpy()[text][0]
        raise ColumnError(f"{name} holds {worst!r}, which is not a number", where, "correct it")
    return values


def _radii(frame: gpd.GeoDataFrame, where: str) -> Floats:
    radii = _floats(frame, "radius_m", where)
    bad = (radii <= 0) | np.isinf(radii)
    if bad.any():
        raise ColumnError(
            f"radius_m must be above zero; {int(bad.sum())} are not, such as {radii[bad][0]:g}",
            where,
            "give metres above zero, or leave the cell empty where no radius is known",
        )
    return radii


def _choices(
    frame: gpd.GeoDataFrame, name: str, known: tuple[str, ...], default: str | None, where: str
) -> Objects:
    found = column(frame, name)
    values = np.full(len(frame), default, dtype=object)
    if found is None:
        return values
    given = frame[found].astype("string").str.strip()
    there = given.notna().to_numpy() & (given != "").fillna(False).to_numpy(dtype=bool)
    lookup = {choice.lower(): choice for choice in known}
    chosen = given[there].str.lower().map(lookup)
    if chosen.isna().any():
        worst = given[there][chosen.isna()].iloc[0]
        raise ColumnError(f"{name} holds {worst!r}", where, f"use one of: {', '.join(known)}")
    values[there] = chosen.to_numpy(dtype=object)
    return values


def _letters(frame: gpd.GeoDataFrame, where: str) -> Objects:
    return _choices(frame, "device_class", tuple(DEVICE_CLASSES), None, where)


def _origins(frame: gpd.GeoDataFrame, where: str) -> Objects:
    return _choices(frame, "origin", ORIGINS, "parked", where)


def _read_vehicles(spec: str, dst_crs: AnyCrs) -> Vehicles:
    """Return the vehicles layer of a study; place and heading come from the footprints."""
    layer = read_layer(spec, "vehicles")
    repairs = Repairs(layer.where)
    geometries: Objects = np.asarray(layer.frame.geometry.array, dtype=object)
    good = np.flatnonzero(repair.usable(geometries, repairs))
    frame, centres = layer.frame.iloc[good], shapely.centroid(geometries[good])
    target = _working(layer, centres, dst_crs)
    x, y = shapely.get_x(centres), shapely.get_y(centres)
    x_m, y_m = crs_door.transform(x, y, layer.crs, target)
    heading = _floats(frame, "heading_deg", layer.where)
    if target != layer.crs:
        heading = _turned(x, y, heading, layer.crs, target)
    parked = column(frame, "parked")
    given = [None] * len(frame) if parked is None else list(frame[parked])
    repairs.tell()
    return Vehicles(
        id=_ids(frame, repairs),
        x_m=x_m,
        y_m=y_m,
        heading_deg=heading,
        length_m=_floats(frame, "length_m", layer.where),
        width_m=_floats(frame, "width_m", layer.where),
        score=_floats(frame, "score", layer.where),
        site=_choices(frame, "site", SITES, None, layer.where),
        parked=np.array([None if v is None or v != v else bool(v) for v in given], dtype=object),
        image=_texts(frame, "image"),
        image_x_px=_floats(frame, "image_x_px", layer.where),
        image_y_px=_floats(frame, "image_y_px", layer.where),
        crs=target,
    )


def _texts(frame: gpd.GeoDataFrame, name: str) -> Objects:
    found = column(frame, name)
    if found is None:
        return np.full(len(frame), None, dtype=object)
    return np.array([None if v != v else v for v in frame[found]], dtype=object)


def _turned(x: Floats, y: Floats, heading_deg: Floats, source: CRS, target: CRS) -> Floats:
    """Return headings from the grid north of one projected CRS to that of another."""
    angle = np.radians(heading_deg)
    x0, y0 = crs_door.transform(x, y, source, target)
    x1, y1 = crs_door.transform(x + np.sin(angle), y + np.cos(angle), source, target)
    turned = np.degrees(np.arctan2(x1 - x0, y1 - y0)) % 360
    half = np.nanmax(heading_deg, initial=0.0) <= 180
    return turned % 180 if half else turned

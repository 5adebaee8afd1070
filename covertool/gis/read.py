"""What comes in: anchors, transit areas, polygons and whole studies, in metres in one CRS."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from pyproj import CRS

from covertool import crs as crs_door
from covertool.errors import FileError, GeometryError
from covertool.gis import attributes, repair, tables, target
from covertool.gis.layers import Layer, geo_frame, read_layer
from covertool.gis.repair import Repairs
from covertool.gis.study import layer_names
from covertool.gis.target import AnyCrs
from covertool.gis.vehicles import read_vehicles
from covertool.model import Anchors, Floats, Objects, Study, TransitArea
from covertool.model.tables import within

if TYPE_CHECKING:
    import geopandas as gpd

_LOG = logging.getLogger(__name__)

_APART_M = 1000.0
"""Anchors all further than this from the transit area are most likely of another place."""


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

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     cars = Path(folder) / "cars.csv"
    ...     _ = cars.write_text("lon,lat\\n-6.26,53.35\\n-6.26,53.36\\n")
    ...     anchors = read_anchors(cars)
    >>> len(anchors), anchors.crs.to_epsg()
    (2, 2157)
    """
    layer = read_layer(spec, "anchors", crs)
    repairs = Repairs(layer.where)
    rows, x, y = _places(layer, repairs)
    working = target.pick(np.asarray(shapely.points(x, y)), layer.crs, dst_crs, layer.where)
    x_m, y_m = crs_door.transform(x, y, layer.crs, working)
    keep = np.isfinite(x_m) & np.isfinite(y_m)
    repairs.note(f"points that {crs_door.name(working)} cannot hold dropped", int((~keep).sum()))
    _require_some(len(layer), int(keep.sum()), repairs)
    table = attributes.Table(layer.rows(rows[keep]), int(keep.sum()), layer.where)
    tables.warn_of_near_misses(list(layer.columns), layer.where)
    anchors = Anchors(
        id=attributes.ids(table, repairs),
        x_m=x_m[keep],
        y_m=y_m[keep],
        radius_m=attributes.radii(table),
        device_class=attributes.device_classes(table),
        sigma_m=attributes.sigmas(table),
        origin=attributes.origins(table),
        crs=working,
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

    Examples
    --------
    >>> from covertool.gis.sample import SAMPLE_STUDY, sample_folder
    >>> transit = read_transit(f"{sample_folder() / SAMPLE_STUDY}:transit")
    >>> transit.crs.to_epsg(), transit.area_m2 > 0
    (2157, True)
    """
    layer = read_layer(spec, "transit", crs)
    _, found, working = _polygons(layer, dst_crs)
    return TransitArea(repair.unite(found, layer.where), working)


def read_polygons(
    spec: str | Path, *, crs: AnyCrs = None, dst_crs: AnyCrs = None
) -> gpd.GeoDataFrame:
    """Return a polygon layer (zones, an area of interest) with its columns, in a working CRS.

    Parameters are those of `read_anchors`; without a layer name the only layer is read.
    """
    layer = read_layer(spec, None, crs)
    rows, found, working = _polygons(layer, dst_crs)
    return geo_frame(layer.rows(rows), found, working)


def read_study(path: str | Path, *, dst_crs: AnyCrs = None) -> Study:
    """Return what a study GeoPackage holds, with anchors, transit area and vehicles in one CRS.

    Raises
    ------
    FileError
        When the file is no GeoPackage or has none of these layers.

    Examples
    --------
    >>> from covertool.gis.sample import SAMPLE_STUDY, sample_folder
    >>> study = read_study(sample_folder() / SAMPLE_STUDY)
    >>> study.anchors is not None and study.anchors.crs == study.transit.crs
    True
    """
    names = layer_names(path)
    if not {"anchors", "transit", "vehicles"} & set(names):
        raise FileError(
            f"the study has no layer anchors, transit or vehicles (found: {', '.join(names)})",
            str(path),
            "make one with covertool extract, or name layers with --anchors and --transit",
        )
    transit = read_transit(f"{path}:transit", dst_crs=dst_crs) if "transit" in names else None
    shared = transit.crs if transit is not None else dst_crs
    anchors = read_anchors(f"{path}:anchors", dst_crs=shared) if "anchors" in names else None
    if transit is not None and anchors is not None:
        warn_when_apart(anchors, transit, str(path))
    shared = anchors.crs if anchors is not None else shared
    vehicles = read_vehicles(f"{path}:vehicles", dst_crs=shared) if "vehicles" in names else None
    return Study(anchors, transit, vehicles)


def warn_when_apart(anchors: Anchors, transit: TransitArea, where: str) -> None:
    """Log a warning when no anchor lies within the bounds of the transit area, 1 km around."""
    around = shapely.buffer(shapely.box(*transit.polygons.bounds), _APART_M).bounds
    if len(anchors) and not within(anchors.x_m, anchors.y_m, around).any():
        _LOG.warning(
            "%s: no anchor is within 1 km of the transit area; "
            "are longitude and latitude swapped, or is a CRS wrong?",
            where,
        )


def _places(layer: Layer, repairs: Repairs) -> tuple[Any, Floats, Floats]:
    """Return for each usable place its row in the layer and its coordinates."""
    geometries: Objects = layer.geometries.copy()
    rows = np.flatnonzero(repair.usable(geometries, repairs))
    rows = rows[repair.within_degrees(geometries[rows], layer.crs, repairs)]
    kinds = shapely.get_type_id(geometries[rows])
    polygon = np.isin(kinds, repair.POLYGONS)
    geometries[rows[polygon]] = shapely.centroid(geometries[rows[polygon]])
    repairs.note("polygons taken by their centroid", int(polygon.sum()))
    other = ~polygon & ~np.isin(kinds, repair.POINTS)
    repairs.note("geometries that are neither points nor polygons dropped", int(other.sum()))
    rows = rows[~other]
    _require_some(len(layer), rows.size, repairs)
    xy, owner = shapely.get_coordinates(geometries[rows], return_index=True)
    return rows[owner], xy[:, 0], xy[:, 1]


def _polygons(layer: Layer, dst_crs: AnyCrs) -> tuple[Any, Objects, CRS]:
    """Return for each usable row of polygons its number and its shape, and the working CRS."""
    repairs = Repairs(layer.where)
    geometries = layer.geometries
    rows = np.flatnonzero(repair.usable(geometries, repairs))
    rows = rows[repair.within_degrees(geometries[rows], layer.crs, repairs)]
    found = repair.polygons(geometries[rows], repairs)
    keep = ~shapely.is_missing(found)
    rows, found = rows[keep], found[keep]
    _require_some(len(layer), rows.size, repairs)
    working = target.pick(found, layer.crs, dst_crs, layer.where)
    moved = crs_door.transform_geometries(found, layer.crs, working)
    good = repair.usable(moved, repairs)
    moved = repair.polygons(moved[good], repairs)
    repairs.tell()
    return rows[good], moved, working


def _require_some(given: int, kept: int, repairs: Repairs) -> None:
    """Refuse a layer of which nothing can be used; an empty one only deserves a warning."""
    if given and not kept:
        told = "; ".join(f"{count} {what}" for what, count in repairs.counts.items())
        raise GeometryError(
            f"none of the {given} geometries can be used: {told}",
            repairs.where,
            "check its coordinates, geometry type and CRS in QGIS",
        )
    if not given:
        _LOG.warning("%s: the layer is empty", repairs.where)

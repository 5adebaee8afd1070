"""Sources that are read by bounding box: what a tile needs, wherever the tile is computed.

A source goes to a worker as a file name and a CRS. GeoParquet that `covertool convert` wrote is
read piece by piece; of any other file each process reads the whole once and keeps it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from pyproj import CRS

from covertool import crs as crs_door
from covertool.dsrc import DEVICE_CLASSES
from covertool.errors import FileError, GeometryError
from covertool.gis import guard
from covertool.gis.formats import GEOPARQUET
from covertool.gis.parquet import (
    ParquetAnchors,
    geometry_column,
    open_parquet,
    rows_near,
    write_along_curve,
)
from covertool.gis.read import read_anchors, read_transit
from covertool.model import Anchors, Bounds, Objects, TransitArea
from covertool.model.tables import within

_POLYGON = 3
_VERTICES_IN_PIECE = 512
_PIECES_IN_GROUP = 64
_COVERING = ("bbox.xmin", "bbox.ymin", "bbox.xmax", "bbox.ymax")


@dataclass(frozen=True)
class LoadedAnchors:
    """Anchors of files of any format, read whole once in each process."""

    specs: tuple[str, ...]
    crs: CRS
    assigned: str | None = None

    def _all(self) -> Anchors:
        return _load_anchors(self.specs, self.assigned, self.crs)

    @property
    def bounds(self) -> Bounds:
        """Least and greatest coordinates: x0, y0, x1, y1."""
        return bounds_of(self._all())

    def read(self, bounds: Bounds | None = None) -> Anchors:
        """Return the anchors inside bounds (closed), or all of them."""
        anchors = self._all()
        if bounds is None:
            return anchors
        return anchors.take(within(anchors.x_m, anchors.y_m, bounds))


@dataclass(frozen=True)
class LoadedTransit:
    """A transit area of any format, read whole once in each process."""

    spec: str
    crs: CRS
    assigned: str | None = None

    @property
    def bounds(self) -> Bounds:
        """Least and greatest coordinates: x0, y0, x1, y1."""
        x0, y0, x1, y1 = self.read().polygons.bounds
        return (float(x0), float(y0), float(x1), float(y1))

    def read(self, bounds: Bounds | None = None) -> TransitArea:
        """Return the whole transit area: the tile cuts out what it needs."""
        return _load_transit(self.spec, self.assigned, self.crs)


@dataclass(frozen=True)
class ParquetTransit:
    """A transit area in a file of `write_transit`, read by bounding box."""

    path: Path
    crs: CRS
    bounds: Bounds

    def read(self, bounds: Bounds | None = None) -> TransitArea:
        """Return the transit area inside bounds, or all of it."""
        table = rows_near(self.path, ("geometry",), bounds, box=_COVERING)
        pieces = shapely.from_wkb(table.column("geometry").to_numpy())
        if bounds is not None:
            pieces = _inside(pieces, bounds)
        return _united(pieces, self.crs)


def open_anchors(
    specs: tuple[str, ...], crs: str | None, target: CRS
) -> LoadedAnchors | ParquetAnchors:
    """Return a source of anchors in a CRS: streamed where the one file allows it."""
    path, layer = guard.layer_spec(specs[0])
    if len(specs) == 1 and layer is None and _is_sorted(path, "x_m"):
        streamed = ParquetAnchors(path)
        if streamed.crs == target:
            return streamed
    return LoadedAnchors(specs, target, crs)


def open_transit(spec: str, crs: str | None, dst_crs: str | None) -> LoadedTransit | ParquetTransit:
    """Return a source of the transit area: streamed where the file allows it."""
    path, layer = guard.layer_spec(spec)
    if layer is None and dst_crs is None and _is_sorted(path, "piece", "bbox"):
        told = geometry_column(open_parquet(path))
        x0, y0, x1, y1 = told["bbox"]
        own = crs_door.settled(CRS.from_json_dict(told["crs"]))
        return ParquetTransit(path, own, (x0, y0, x1, y1))
    return LoadedTransit(spec, read_transit(spec, crs=crs, dst_crs=dst_crs).crs, crs)


def write_transit(path: str | Path, transit: TransitArea, *, overwrite: bool = False) -> None:
    """Write a transit area as GeoParquet 1.1 in small pieces along a Hilbert curve.

    A town's streets are often one polygon; cut in pieces, a tile reads only its own part.

    Raises
    ------
    FileError
        When the path may not be written.
    """
    import geopandas as gpd

    pieces = subdivided(transit)
    frame = gpd.GeoDataFrame({"piece": np.arange(len(pieces))}, geometry=pieces, crs=transit.crs)
    write_along_curve(path, frame, rows_in_group=_PIECES_IN_GROUP, overwrite=overwrite)


def subdivided(transit: TransitArea) -> list[shapely.Polygon]:
    """Return the transit area cut into polygons of few vertices: halved again and again.

    Examples
    --------
    >>> ring = shapely.Point(0, 0).buffer(100, quad_segs=1000)
    >>> pieces = subdivided(TransitArea(shapely.MultiPolygon([ring]), CRS(2157)))
    >>> len(pieces) > 1, abs(sum(piece.area for piece in pieces) - ring.area) < 1e-6
    (True, True)
    """
    small: list[shapely.Polygon] = []
    large = list(transit.polygons.geoms)
    while large:
        polygon = large.pop()
        if shapely.get_num_coordinates(polygon) <= _VERTICES_IN_PIECE:
            small.append(polygon)
            continue
        x0, y0, x1, y1 = polygon.bounds
        if x1 - x0 > y1 - y0:
            middle = (x0 + x1) / 2
            halves = [shapely.box(x0, y0, middle, y1), shapely.box(middle, y0, x1, y1)]
        else:
            middle = (y0 + y1) / 2
            halves = [shapely.box(x0, y0, x1, middle), shapely.box(x0, middle, x1, y1)]
        parts = shapely.get_parts(shapely.intersection(polygon, halves))
        large.extend(parts[shapely.get_type_id(parts) == _POLYGON])
    return small


def _inside(pieces: Objects, bounds: Bounds) -> Objects:
    """Return the pieces inside bounds; only those that cross the border are cut."""
    box = shapely.box(*bounds)
    shapely.prepare(box)
    whole = shapely.covers(box, pieces)
    return np.concatenate([pieces[whole], shapely.intersection(pieces[~whole], box)])


def _united(pieces: Objects, crs: CRS) -> TransitArea:
    """Return pieces that touch along shared edges as one; fast where their vertices match."""
    parts = _polygons(pieces)
    try:
        return TransitArea(_multi(shapely.coverage_union_all(parts)), crs)
    except (shapely.errors.GEOSException, GeometryError):
        # a tile's border crosses an edge beside a shared vertex
        return TransitArea(_multi(shapely.union_all(parts)), crs)


def _multi(united: shapely.Geometry) -> shapely.MultiPolygon:
    return shapely.MultiPolygon(list(_polygons([united])))


def _polygons(geometries: Any) -> Objects:
    parts = shapely.get_parts(shapely.get_parts(geometries))
    polygons: Objects = parts[shapely.get_type_id(parts) == _POLYGON]
    return polygons


def bounds_of(anchors: Anchors) -> Bounds:
    """Return the least and greatest coordinates of anchors; NaN when there are none."""
    if not len(anchors):
        return (np.nan, np.nan, np.nan, np.nan)
    x, y = anchors.x_m, anchors.y_m
    return (float(x.min()), float(y.min()), float(x.max()), float(y.max()))


@dataclass(frozen=True)
class AnchorSummary:
    """What a plan of tiles must know of its anchors.

    Attributes
    ----------
    count : anchors in the source
    largest_own_m : largest radius that an anchor names, itself or by its class; 0 if none does
    all_own : whether every anchor names one
    """

    count: int
    largest_own_m: float
    all_own: bool


def summary_of(source: LoadedAnchors | ParquetAnchors) -> AnchorSummary:
    """Return the count and the own radii of a source's anchors, reading only what that needs."""
    if isinstance(source, LoadedAnchors):
        anchors = source.read()
        radii, classes = anchors.radius_m, anchors.device_class
    else:
        import pyarrow.parquet as pq

        table = pq.read_table(source.path, columns=["radius_m", "device_class"])
        radii = np.asarray(table.column("radius_m").to_numpy(), dtype=float)
        classes = np.array([*table.column("device_class").to_pylist(), None], dtype=object)[:-1]
    known = {name: kind.radius_m for name, kind in DEVICE_CLASSES.items()}
    own = np.where(np.isfinite(radii), radii, [known.get(name, np.nan) for name in classes])
    found = own[np.isfinite(own)]
    return AnchorSummary(len(own), float(found.max(initial=0.0)), found.size == len(own) > 0)


@lru_cache(maxsize=2)
def _load_anchors(specs: tuple[str, ...], crs: str | None, target: CRS) -> Anchors:
    return Anchors.concatenate([read_anchors(spec, crs=crs, dst_crs=target) for spec in specs])


@lru_cache(maxsize=2)
def _load_transit(spec: str, crs: str | None, target: CRS) -> TransitArea:
    return read_transit(spec, crs=crs, dst_crs=target)


def _is_sorted(path: Path, *columns: str) -> bool:
    """Return whether a file is GeoParquet that `covertool convert` wrote, by columns it adds."""
    if not path.name.lower().endswith(GEOPARQUET.suffixes):
        return False
    checked, _ = guard.input_file(path, (GEOPARQUET,))
    try:
        return set(columns) <= set(open_parquet(checked).schema_arrow.names)
    except FileError:
        return False

"""Parked cars where OpenStreetMap says that cars park: synthetic, seeded, by occupancy."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import shapely

from covertool.crs import transform_geometries
from covertool.errors import GeometryError, OptionError
from covertool.extract.bays import SPACING_M, kerb_bays, kerb_orientation, lot_bays
from covertool.extract.carriageways import RoadChoice, carriageway_width_m, is_transit
from covertool.extract.transit import transit_from_roads
from covertool.model import Anchors, Floats, Objects

if TYPE_CHECKING:
    import geopandas as gpd

_LOG = logging.getLogger(__name__)

JUNCTION_CLEARANCE_M = 5.0
"""No parking this near to a junction, counted from the crossing kerb (as in German law)."""

_ALL_ROADS = RoadChoice(tunnels=False, private=True, yards=True)
_HIDDEN = ("underground", "multi-storey", "rooftop", "sheds", "garage_boxes")


@dataclass(frozen=True)
class Bays:
    """Places where cars can stand, with what each of them is part of.

    Attributes
    ----------
    xy_m : (N, 2) centres
    kerb : (N,) True at a kerb, False in a parking area
    """

    xy_m: Floats
    kerb: npt.NDArray[np.bool_]


def parked_anchors(
    roads: gpd.GeoDataFrame,
    areas: gpd.GeoDataFrame,
    *,
    occupancy: float = 0.8,
    seed: int = 1,
) -> Anchors:
    """Return synthetic parked cars along tagged kerbs and in parking areas.

    Each bay is taken with probability ``occupancy``, independently of the others.

    Parameters
    ----------
    roads : GeoDataFrame
        Lines in a projected CRS in metres, with a column ``tags`` of dicts.
    areas : GeoDataFrame
        Polygons tagged ``amenity=parking``, in any CRS, with a column ``tags``; may be empty.
    occupancy : float
        Share of the bays that are taken, 0 to 1.
    seed : int
        Same seed, same cars.

    Raises
    ------
    OptionError
        When the occupancy is no share.
    GeometryError
        When the extract names no place to park.

    Examples
    --------
    >>> import geopandas as gpd
    >>> street = {"highway": "residential", "parking:both": "lane"}
    >>> line = shapely.LineString([(0, 0), (120, 0)])
    >>> roads = gpd.GeoDataFrame({"tags": [street]}, geometry=[line], crs=2157)
    >>> len(parked_anchors(roads, roads.iloc[:0], occupancy=1.0))
    40
    """
    if not 0 <= occupancy <= 1:
        raise OptionError(f"an occupancy of {occupancy} is no share", "--occupancy", "use 0 to 1")
    chance = np.random.default_rng(seed)
    bays = parking_bays(roads, areas, chance)
    if len(bays.xy_m) == 0:
        raise GeometryError(
            "the extract names no place to park",
            "tags parking:* of roads, areas with amenity=parking",
            "use a larger extract, or anchors from imagery or a file",
        )
    _LOG.info(
        "%d bays: %d at kerbs, %d in areas", len(bays.kerb), bays.kerb.sum(), (~bays.kerb).sum()
    )
    taken = bays.xy_m[chance.random(len(bays.xy_m)) < occupancy]
    return Anchors.from_points(taken[:, 0], taken[:, 1], roads.crs, origin="parked")


def parking_bays(
    roads: gpd.GeoDataFrame, areas: gpd.GeoDataFrame, chance: np.random.Generator
) -> Bays:
    """Return the bays at kerbs and in areas that lie on no carriageway and in no other bay's area.

    ``chance`` picks which bays of an area stay when its ``capacity`` tag allows fewer.
    """
    rows = np.array([is_transit(tags, _ALL_ROADS) for tags in roads["tags"]], dtype=bool)
    lots = _lots(areas, roads)
    in_lots = [_of_lot(area, tags, chance) for area, tags in lots]
    lot_xy = np.concatenate([np.empty((0, 2)), *in_lots])
    if not rows.any():
        return Bays(lot_xy, np.zeros(len(lot_xy), dtype=bool))
    drivable = roads[rows]
    kerb_xy = _clear_of_junctions(*_kerb_bays(drivable), drivable)
    kerb_xy = kerb_xy[~_within(kerb_xy, shapely.union_all([area for area, _ in lots]))]
    xy = np.concatenate([kerb_xy, lot_xy])
    kerb = np.arange(len(xy)) < len(kerb_xy)
    free = ~_within(xy, transit_from_roads(drivable, _ALL_ROADS).polygons)
    return Bays(xy[free], kerb[free])


def _kerb_bays(roads: gpd.GeoDataFrame) -> tuple[Floats, Floats]:
    """Return the centres of all bays at kerbs, and half of the kerb that each takes."""
    centres: list[Floats] = [np.empty((0, 2))]
    halves: list[Floats] = [np.empty(0)]
    for geometry, tags in zip(roads.geometry, roads["tags"], strict=True):
        half_m = carriageway_width_m(tags) / 2
        for side in ("left", "right"):
            orientation = kerb_orientation(tags, side)
            if orientation is None:
                continue
            for line in shapely.get_parts(geometry):
                centres.append(kerb_bays(line, side, orientation, half_m))
                halves.append(np.full(len(centres[-1]), SPACING_M[orientation] / 2))
    return np.concatenate(centres), np.concatenate(halves)


def _clear_of_junctions(xy: Floats, half_m: Floats, roads: gpd.GeoDataFrame) -> Floats:
    """Return the bays that keep their distance from every junction."""
    from scipy.spatial import cKDTree

    nodes, reach_m = _junctions(roads)
    if len(xy) == 0 or len(nodes) == 0:
        return xy
    clear = np.ones(len(xy), dtype=bool)
    near = cKDTree(xy).query_ball_point(nodes, reach_m + half_m.max())
    for node, reach, found in zip(nodes, reach_m, near, strict=True):
        rows = np.array(found, dtype=int)
        away = np.hypot(*(xy[rows] - node).T)
        clear[rows[away < reach + half_m[rows]]] = False
    return xy[clear]


def _junctions(roads: gpd.GeoDataFrame) -> tuple[Floats, Floats]:
    """Return the places where three or more arms meet, and how far no car parks around them."""
    lines: Objects = np.asarray(roads.geometry.array, dtype=object)
    parts, owner = shapely.get_parts(lines, return_index=True)
    half_m = np.array([carriageway_width_m(tags) / 2 for tags in roads["tags"]])[owner]
    xy, part = shapely.get_coordinates(parts, return_index=True)
    arms = np.full(len(xy), 2)
    ends = np.flatnonzero(np.diff(part, prepend=-1) != 0)
    arms[ends] = 1
    arms[np.append(ends[1:] - 1, len(xy) - 1)] = 1
    places, node = np.unique(np.round(xy, 2), axis=0, return_inverse=True)
    node = node.ravel()
    meeting = np.bincount(node, weights=arms) >= 3
    widest = np.zeros(len(places))
    np.maximum.at(widest, node, half_m[part])
    return places[meeting], widest[meeting] + JUNCTION_CLEARANCE_M


def _lots(
    areas: gpd.GeoDataFrame, roads: gpd.GeoDataFrame
) -> list[tuple[shapely.Polygon, dict[str, str]]]:
    """Return the open-air parking areas as single polygons in the CRS of the roads."""
    if areas.empty:
        return []
    moved = transform_geometries(
        np.asarray(areas.geometry.array, dtype=object), areas.crs, roads.crs
    )
    return [
        (part, tags)
        for area, tags in zip(moved, areas["tags"], strict=True)
        if tags.get("parking", "surface") not in _HIDDEN
        for part in shapely.get_parts(area)
        if part.geom_type == "Polygon"
    ]


def _of_lot(area: shapely.Polygon, tags: dict[str, str], chance: np.random.Generator) -> Floats:
    bays = lot_bays(area)
    capacity = tags.get("capacity", "")
    if capacity.isdigit() and int(capacity) < len(bays):
        chosen = np.sort(chance.choice(len(bays), int(capacity), replace=False))
        return bays[chosen]
    return bays


def _within(xy: Floats, area: shapely.Geometry) -> npt.NDArray[np.bool_]:
    shapely.prepare(area)
    inside: npt.NDArray[np.bool_] = shapely.intersects_xy(area, xy[:, 0], xy[:, 1])
    return inside

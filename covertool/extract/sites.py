"""Parked or driving: decided by where a car lies to the edge of the transit area."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from covertool.errors import OptionError
from covertool.model import Floats, Objects

_RIM_M = 0.5
"""An edge this near to the image's border is where the picture ends, not a kerb."""


@dataclass(frozen=True)
class ParkedRule:
    """Which cars count as parked, by their place to the transit area's edge.

    A driver keeps the car's side about half a metre or more from the edge of the lane, so the
    centre of a car 1.8 m wide is 1.4 m or more inside; in lanes of 3 m it is 1.5 m. A car parked at
    the kerb beside the transit area has its centre about 1.1 m outside. A mask drawn by hand is
    true to about a metre, so the edge itself, which lies midway, decides by default.
    Where the transit area reaches from kerb to kerb and so holds the parking lane, a parked car's
    centre is 1.1 m inside: use 1.3 m there.

    Attributes
    ----------
    inside_m : a car whose centre lies deeper than this inside the transit area is driving
    kerb_m : a parked car whose rectangle is nearer to the transit area than this is on the street;
        0.5 m of gutter or gap and the metre by which a mask may be off
    """

    inside_m: float = 0.0
    kerb_m: float = 1.5

    def __post_init__(self) -> None:
        if not (np.isfinite(self.inside_m) and np.isfinite(self.kerb_m) and self.kerb_m >= 0):
            raise OptionError(
                f"the parked rule ({self.inside_m}, {self.kerb_m}) m is out of range",
                "--parked-inside, --kerb",
                "give metres; the second at least 0",
            )


def depth_m(
    x_m: Floats, y_m: Floats, polygons: shapely.MultiPolygon, outline: shapely.Polygon | None = None
) -> Floats:
    """Return the signed distance of places to the edge of an area: inside is positive.

    Parameters
    ----------
    outline : outline of the picture; edges along it are no edges of the area

    Examples
    --------
    >>> square = shapely.MultiPolygon([shapely.box(0, 0, 10, 10)])
    >>> depth_m(np.array([2.0, 13.0]), np.array([5.0, 5.0]), square).tolist()
    [2.0, -3.0]
    """
    points = shapely.points(x_m, y_m)
    if polygons.is_empty:
        return np.full(x_m.shape, -np.inf)
    edge: shapely.Geometry = polygons.boundary
    if outline is not None:
        edge = shapely.intersection(edge, outline.buffer(-_RIM_M, join_style="mitre"))
    pieces = _segments(edge)
    away = np.full(x_m.shape, np.inf)
    if pieces.size > 0:
        nearest, distance = shapely.STRtree(pieces).query_nearest(
            points, return_distance=True, all_matches=False
        )
        away[nearest[0]] = distance
    shapely.prepare(polygons)
    inside = shapely.intersects(polygons, points)
    signed: Floats = np.where(inside, away, -away)
    return signed


def judge(
    x_m: Floats,
    y_m: Floats,
    footprints: Objects,
    transit: shapely.MultiPolygon,
    *,
    rule: ParkedRule,
    lots: shapely.MultiPolygon | None = None,
    outline: shapely.Polygon | None = None,
) -> tuple[Objects, Objects]:
    """Return the site and the parked flag of each car.

    Parameters
    ----------
    x_m, y_m : (N,) centres
    footprints : (N,) oriented rectangles
    transit : the transit area in the same CRS
    rule : where driving begins
    lots : parking areas; None when they are not known
    outline : outline of the picture, whose border is no kerb

    Returns
    -------
    site : (N,) carriageway, lot, on_street or off_street
    parked : (N,) bool as objects
    """
    driving = depth_m(x_m, y_m, transit, outline) > rule.inside_m
    shapely.prepare(transit)
    near = shapely.dwithin(transit, footprints, rule.kerb_m) & (not transit.is_empty)
    site = np.where(near, "on_street", "off_street").astype(object)
    if lots is not None and not lots.is_empty:
        shapely.prepare(lots)
        site[shapely.intersects(lots, shapely.points(x_m, y_m))] = "lot"
    site[driving] = "carriageway"
    return site, (~driving).astype(object)


def _segments(edge: shapely.Geometry) -> npt.NDArray[np.object_]:
    """Return the pieces of a boundary, cut short, so that a tree over them is quick."""
    lines = [part for part in shapely.get_parts(edge) if part.length > 0]
    pieces = []
    for line in lines:
        points = shapely.get_coordinates(line)
        starts = range(0, len(points) - 1, 32)
        pieces += [shapely.linestrings(points[i : i + 33]) for i in starts]
    return np.array(pieces, dtype=object)

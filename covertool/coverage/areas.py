"""Discs and a transit area to the exact areas of Levels 0, 1, 2 and 3.

Each grid cell of the transit area gathers the discs near it. Three that cover the whole cell
decide it. Elsewhere the arcs of the circles are cut at each other and at the transit edges, and
Green's theorem over the arcs and the covered parts of the edges gives the area of every level.
Keeping the depth of cover only up to k goes back to the perimeter sweep of Huang and Tseng, The
Coverage Problem in a Wireless Sensor Network, Mobile Networks and Applications 10 (2005).
"""

# mypy: disable-error-code="no-untyped-def,no-untyped-call"

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from covertool.coverage.cells import level_boundaries
from covertool.coverage.compiled import announced, borrowing
from covertool.coverage.discs import DiscGrid, disc_grid
from covertool.coverage.edges import EdgeGrid, directed_edges, edge_grid
from covertool.coverage.radii import check_points, check_radii
from covertool.errors import ComputationError
from covertool.model import Floats

CLOSURE_LIMIT_M = 1e-6
_ATTEMPTS = 3


@dataclass(frozen=True)
class LevelAreas:
    """What the exact engine returns for one set of discs.

    Attributes
    ----------
    areas_m2 : areas of Levels 0, 1, 2, 3 in square metres; they sum to the transit area
    boundary_m : lengths inside the transit area of the circles' arcs that bound the places heard
        by at least 1, 2 and 3 anchors; this is how fast those areas grow with the radius
    closure_m : greatest length over the levels of the sum of the boundary's chords, which is zero
        for closed curves
    """

    areas_m2: tuple[float, float, float, float]
    boundary_m: tuple[float, float, float]
    closure_m: float


def level_areas(
    x_m: npt.ArrayLike,
    y_m: npt.ArrayLike,
    radius_m: npt.ArrayLike,
    polygons: shapely.MultiPolygon | shapely.Polygon,
    *,
    weights: npt.ArrayLike | None = None,
) -> LevelAreas:
    """Return the exact areas of Levels 0 to 3 that discs make within polygons.

    ``A_k = 1/2 sum (x dy - y dx)`` over the boundary of the places that at least k discs cover
    (Green's theorem); Level 1 is A_1 - A_2, Level 2 is A_2 - A_3, Level 3 is A_3.

    Parameters
    ----------
    x_m, y_m : (N,) centres in metres
    radius_m : (N,) or a number, in metres
    polygons : valid and disjoint, in the same CRS
    weights : (N,) anchors at each centre; 1 by default

    Raises
    ------
    GeometryError
        When a coordinate is not finite or a radius is not positive.
    ComputationError
        When the boundaries of a level do not close.

    Examples
    --------
    >>> areas = level_areas([0.0], [0.0], 1.0, shapely.box(-2, -2, 2, 2)).areas_m2
    >>> print(round(areas[1], 12))
    3.14159265359
    """
    x, y, radius, weight = disc_arrays(x_m, y_m, radius_m, weights)
    edges = directed_edges(polygons)
    if len(edges) == 0:
        return LevelAreas((0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0)
    if x.size == 0:
        return LevelAreas((float(polygons.area), 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0)
    closure = math.inf
    for attempt in range(_ATTEMPTS):
        with announced():
            transit, discs = grids(x, y, radius, weight, edges, attempt)
            found = _level_areas(discs, transit)
        closure = found.closure_m
        if closure <= CLOSURE_LIMIT_M:
            return found
    raise ComputationError(
        f"the boundaries of a coverage level stay open by {closure:.3g} m",
        "coverage areas",
        "check that the transit area's polygons are valid and do not overlap",
    )


def disc_arrays(
    x_m: npt.ArrayLike, y_m: npt.ArrayLike, radius_m: npt.ArrayLike, weights: npt.ArrayLike | None
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return checked x, y, radius and weight as float arrays of one length."""
    x, y = np.asarray(x_m, dtype=float).ravel(), np.asarray(y_m, dtype=float).ravel()
    radius = np.array(np.broadcast_to(np.asarray(radius_m, dtype=float), x.shape))
    weight = np.ones(x.size) if weights is None else np.asarray(weights, dtype=float).ravel()
    check_points(x, y)
    check_radii(radius)
    return x, y, radius, weight


def grids(
    x: Floats, y: Floats, radius: Floats, weight: Floats, edges: Floats, attempt: int = 0
) -> tuple[EdgeGrid, DiscGrid]:
    """Return transit edges and discs in grids that share one local origin.

    The cells are a radius wide where few discs overlap and half of one where many do, for then
    most cells are decided whole; there are no more of them than the input is worth.
    """
    width, height = (float(np.ptp(edges[:, axis])) for axis in (0, 1))
    overlap = math.pi * float(np.sum(radius**2)) / (width * height)
    wished = (0.5 + 0.5 * min(1.0, 2.0 / overlap)) * float(np.median(radius))
    smallest = math.sqrt(width * height / (4096 + 64 * (x.size + len(edges))))
    transit = edge_grid(edges, max(wished, smallest), attempt)
    return transit, disc_grid(x - transit.x0_m, y - transit.y0_m, radius, weight)


def _level_areas(discs: DiscGrid, transit: EdgeGrid) -> LevelAreas:
    # For levels >= 1, 2, 3: the area, the length of arcs, and the sum of chords (x, y).
    sums = np.zeros((3, 4))
    for boundaries in level_boundaries(discs, transit):
        add_boundaries(boundaries, sums)
    covered = [transit.area_m2, *sums[:, 0], 0.0]
    none, one, two, three = (max(float(covered[k] - covered[k + 1]), 0.0) for k in range(4))
    first, second, third = (float(length) for length in sums[:, 1])
    closure = float(np.hypot(sums[:, 2], sums[:, 3]).max())
    return LevelAreas((none, one, two, three), (first, second, third), closure)


@borrowing
def add_boundaries(out, sums):
    """Add level boundaries to the sums of the levels that they bound."""
    for i in range(out.shape[0]):
        px, py, x, y, r = out[i, 0], out[i, 1], out[i, 2], out[i, 3], out[i, 4]
        dx, dy = x - px, y - py
        area, length = 0.5 * (px * dy - py * dx), 0.0
        if r > 0.0:
            # Half the chord over the radius is the sine of half the arc's angle.
            sine = min(0.5 * math.sqrt(dx * dx + dy * dy) / r, 1.0)
            angle = math.asin(sine)
            area += r * r * (angle - sine * math.sqrt(1.0 - sine * sine))
            length = 2.0 * r * angle
        for level in range(int(out[i, 5] + 0.5), min(int(out[i, 6] + 0.5), 3)):
            sums[level, 0] += area
            sums[level, 1] += length
            sums[level, 2] += dx
            sums[level, 3] += dy

"""Geometries as short lists of integers for the page: simplified, thinned, in decimetres."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import shapely

from covertool.model import Bounds, Floats, Integers, Objects

BUDGET_VERTICES = 130_000
"""About 1.6 MB of the page."""
BUDGET_MARKS = 20_000
_LADDER_M = (0.25, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000)


@dataclass(frozen=True)
class Drawn:
    """Shapes ready for the page.

    Attributes
    ----------
    x, y : of areas nested lists (part, polygon, ring), of lines lists, of marks integers
    row : (N,) integers, the row of the layer that each shape came from
    """

    x: list[object]
    y: list[object]
    row: Integers


@dataclass(frozen=True)
class MapFrame:
    """The map's origin and extent; its unit is the decimetre."""

    x0_m: float
    y0_m: float
    width_m: float
    height_m: float

    @classmethod
    def around(cls, bounds: Bounds, *, flattest: float = 2.2, tallest: float = 0.9) -> MapFrame:
        """Return a frame around some bounds with a margin, neither too flat nor too tall.

        Examples
        --------
        >>> MapFrame.around((0.0, 0.0, 900.0, 100.0)).height_m > 400
        True
        """
        x0, y0, x1, y1 = bounds
        margin = 0.02 * max(x1 - x0, y1 - y0, 50.0)
        width, height = x1 - x0 + 2 * margin, y1 - y0 + 2 * margin
        wide, high = max(width, tallest * height), max(height, width / flattest)
        middle_x, middle_y = (x0 + x1) / 2, (y0 + y1) / 2
        return cls(float(np.floor(middle_x - wide / 2)), float(np.floor(middle_y - high / 2)),
                   float(wide), float(high))  # fmt: skip

    def integers(self, coordinates: Floats) -> Integers:
        """Return (N, 2) coordinates in decimetres from the origin."""
        whole: Integers = np.rint((coordinates - (self.x0_m, self.y0_m)) * 10).astype(np.int64)
        return whole


def choose_tolerance(geometries: Iterable[Objects], budget: int = BUDGET_VERTICES) -> float:
    """Return the smallest tolerance in metres at which all the shapes fit the page.

    Examples
    --------
    >>> choose_tolerance([np.array([shapely.Point(0, 0).buffer(9)])])
    0.25
    """
    layers = list(geometries)
    for tolerance_m in _LADDER_M:
        parts = (simplified(shapes, tolerance_m)[0] for shapes in layers)
        if sum(int(shapely.get_num_coordinates(part).sum()) for part in parts) <= budget:
            return tolerance_m
    return _LADDER_M[-1]


def simplified(geometries: Objects, tolerance_m: float) -> tuple[Objects, Integers]:
    """Return the parts of areas and lines, simplified, and the row of each.

    No point moves by more than the tolerance. Areas below the square of twice the tolerance and
    lines below twice the tolerance, which nobody would see, are left out.
    """
    parts, rows = shapely.get_parts(geometries, return_index=True)
    areal = shapely.get_dimensions(parts) == 2
    size = np.where(areal, np.sqrt(shapely.area(parts)), shapely.length(parts))
    kept = size >= 2 * tolerance_m
    shapes: Objects = shapely.simplify(parts[kept], tolerance_m, preserve_topology=True)
    return shapes, rows[kept]


def draw_areas(geometries: Objects, frame: MapFrame, tolerance_m: float) -> Drawn:
    """Return polygons, one shape a part, each a list of rings with the outer one first."""
    shapes, rows = simplified(geometries, tolerance_m)
    rings = [[polygon.exterior, *polygon.interiors] for polygon in shapes]
    places = [[frame.integers(shapely.get_coordinates(ring)[:-1]) for ring in p] for p in rings]
    xs: list[object] = [[[ring[:, 0].tolist() for ring in polygon]] for polygon in places]
    ys: list[object] = [[[ring[:, 1].tolist() for ring in polygon]] for polygon in places]
    return Drawn(xs, ys, rows)


def draw_lines(geometries: Objects, frame: MapFrame, tolerance_m: float) -> Drawn:
    """Return lines, one shape a part."""
    shapes, rows = simplified(geometries, tolerance_m)
    places = [frame.integers(shapely.get_coordinates(line)) for line in shapes]
    return Drawn([p[:, 0].tolist() for p in places], [p[:, 1].tolist() for p in places], rows)


def draw_marks(
    x_m: Floats, y_m: Floats, frame: MapFrame, budget: int = BUDGET_MARKS
) -> tuple[Drawn, float]:
    """Return points and the cell in metres of which only the first point is drawn; 0 for all.

    Examples
    --------
    >>> frame = MapFrame.around((0.0, 0.0, 100.0, 100.0))
    >>> draw_marks(np.array([1.0, 1.2, 50.0]), np.array([1.0, 1.0, 50.0]), frame, 2)[1]
    1.0
    """
    kept: Integers = np.arange(len(x_m))
    cell_m = 0.0
    while len(kept) > budget:
        cell_m = 2 * cell_m or 1.0
        cells = np.floor(np.column_stack([x_m, y_m]) / cell_m).astype(np.int64)
        kept = np.sort(np.unique(cells, axis=0, return_index=True)[1])
    whole = frame.integers(np.column_stack([x_m, y_m])[kept])
    return Drawn(whole[:, 0].tolist(), whole[:, 1].tolist(), kept), cell_m

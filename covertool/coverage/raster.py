# mypy: disable-error-code="no-untyped-def, no-untyped-call"
"""Levels as pixels: one addition where a disc begins on a row and one where it ends."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from covertool.coverage.compiled import announced, compiled
from covertool.coverage.scanlines import crossings, downward_edges, within_rows
from covertool.errors import OptionError
from covertool.model import Floats

OUTSIDE = 255
"""Value of a pixel whose centre is not in the transit area."""

_PIXELS_AT_ONCE = 500_000
_MOST_PIXELS = 2**31


@dataclass(frozen=True)
class RasterGrid:
    """A north-up grid of square pixels, in metres of the transit area's CRS."""

    left_m: float
    top_m: float
    gsd_m: float
    width: int
    height: int


def grid_over(polygons: shapely.MultiPolygon, gsd_m: float) -> RasterGrid:
    """Return the grid over polygons whose lines lie at multiples of the pixel size.

    Raises
    ------
    OptionError
        When the pixel size is not positive, or gives more pixels than a file should hold.

    Examples
    --------
    >>> grid = grid_over(shapely.MultiPolygon([shapely.box(0.2, 0, 10, 4)]), 0.5)
    >>> grid.left_m, grid.top_m, grid.width, grid.height
    (0.0, 4.0, 20, 8)
    """
    if not (np.isfinite(gsd_m) and gsd_m > 0):
        raise OptionError(
            f"a pixel of {gsd_m} m is not possible", "--raster", "use a positive number of metres"
        )
    x0, y0, x1, y1 = polygons.bounds
    column, row = np.floor(x0 / gsd_m), np.ceil(y1 / gsd_m)
    width = max(int(np.ceil(x1 / gsd_m) - column), 1)
    height = max(int(row - np.floor(y0 / gsd_m)), 1)
    if width * height > _MOST_PIXELS:
        raise OptionError(
            f"{width} x {height} pixels are too many", f"--raster {gsd_m:g}", "use larger pixels"
        )
    return RasterGrid(float(column * gsd_m), float(row * gsd_m), gsd_m, width, height)


def level_rows(
    x_m: Floats, y_m: Floats, radius_m: Floats, polygons: shapely.MultiPolygon, grid: RasterGrid
) -> Iterator[tuple[int, npt.NDArray[np.uint8]]]:
    """Yield the level of each pixel's centre, some rows at a time from the top.

    Yields
    ------
    int, (rows, width) uint8
        The first row, and 0, 1, 2, 3 (three or more anchors), or ``OUTSIDE``.

    Examples
    --------
    >>> square = shapely.MultiPolygon([shapely.box(0, 0, 4, 2)])
    >>> row = np.array([1.0])
    >>> for first, rows in level_rows(row, row, row * 1.2, square, grid_over(square, 1.0)):
    ...     print(first, rows.tolist())
    0 [[1, 1, 0, 0], [1, 1, 0, 0]]
    """
    x, y = x_m - grid.left_m, grid.top_m - y_m
    edges = downward_edges(polygons, grid.left_m, grid.top_m)
    at_once = max(_PIXELS_AT_ONCE // grid.width, 1)
    for first in range(0, grid.height, at_once):
        rows = min(at_once, grid.height - first)
        top = first * grid.gsd_m
        near = within_rows(y, radius_m, top, top + rows * grid.gsd_m)
        with announced():
            block = _levels(
                x[near], y[near], radius_m[near], edges, top, grid.gsd_m, rows, grid.width
            )
        yield first, block


@compiled
def _levels(x, y, radius, edges, top, gsd, rows, width):
    """Return (rows, width) level of each pixel's centre."""
    change = np.zeros((rows, width + 1), dtype=np.int32)
    for i in range(len(x)):
        a = max(int(np.ceil((y[i] - radius[i] - top) / gsd - 0.5)), 0)
        b = min(int(np.ceil((y[i] + radius[i] - top) / gsd - 0.5)), rows)
        for row in range(a, b):
            off = top + (row + 0.5) * gsd - y[i]
            half = np.sqrt(max(radius[i] * radius[i] - off * off, 0.0))
            start = min(max(int(np.ceil((x[i] - half) / gsd - 0.5)), 0), width)
            stop = min(max(int(np.ceil((x[i] + half) / gsd - 0.5)), start), width)
            change[row, start] += 1
            change[row, stop] -= 1
    levels = np.full((rows, width), OUTSIDE, dtype=np.uint8)
    spans, offsets = crossings(edges, top, gsd, rows)
    for row in range(rows):
        depth, column = 0, 0
        for s in range(offsets[row], offsets[row + 1] - 1, 2):
            start = max(int(np.ceil(spans[s] / gsd - 0.5)), 0)
            stop = min(int(np.ceil(spans[s + 1] / gsd - 0.5)), width)
            while column < start:
                depth += change[row, column]
                column += 1
            while column < stop:
                depth += change[row, column]
                levels[row, column] = min(depth, 3)
                column += 1
    return levels

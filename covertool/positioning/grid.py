"""Points sorted into square cells, so that who is near is found without looking at everyone."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from covertool.model import Floats
from covertool.positioning.kernel import copied, kernel
from covertool.positioning.noise import Indices

ANCHOR, PSEUDO_ANCHOR, BLIND = 1, 2, 3
"""Priorities of the paper's section IV-D; 1 is the highest."""

_POINTS_A_CELL = 2.0
SLACK_M = 1e-6


class Grid(NamedTuple):
    """Points sorted by cell: those of cell ``c`` are rows ``start[c]`` to ``start[c + 1]``.

    ``highest`` is the least number, and so the highest priority, among them.
    """

    start: Indices
    x: Floats
    y: Floats
    code: Indices
    priority: Indices
    highest: int
    x0: float
    y0: float
    cell_m: float
    columns: int
    rows: int


@kernel
def _sort_into_cells(
    x: Floats,
    y: Floats,
    code: Indices,
    priority: Indices,
    x0: float,
    y0: float,
    cell_m: float,
    columns: int,
    rows: int,
) -> tuple[Indices, Floats, Floats, Indices, Indices]:
    """Return the start of each cell, and the points in the order of their cells."""
    size, cells = x.size, 1.0 / cell_m
    cell, start = np.empty(size, np.int64), np.zeros(columns * rows + 2, np.int64)
    for i in range(size):
        cell[i] = int((y[i] - y0) * cells) * columns + int((x[i] - x0) * cells)
        start[np.uintp(cell[i] + 2)] += 1
    for c in range(2, start.size):
        start[c] += start[c - 1]
    order = np.empty(size, np.int64)
    for i in range(size):
        late = np.uintp(cell[i] + 1)  # one cell late, so that what is filled becomes the start
        order[np.uintp(start[late])] = i
        start[late] += 1
    return start[:-1], x[order], y[order], code[order], priority[order]


def build_grid(x: Floats, y: Floats, code: Indices, priority: Indices, radius_m: float) -> Grid:
    """Return points sorted into square cells of one or two points, at least an eighth of the zone.

    Parameters
    ----------
    x, y : (N,) coordinates in metres
    code : (N,) car number, or ``ANCHOR_BIT`` plus anchor number
    priority : (N,) ``ANCHOR``, ``PSEUDO_ANCHOR`` or ``BLIND``
    radius_m : communication zone in metres
    """
    if x.size == 0:
        none = np.empty(0)
        start = np.zeros(2, np.int64)
        return Grid(start, none, none, code, priority, BLIND, 0.0, 0.0, radius_m + 1.0, 1, 1)
    x0, y0 = float(x.min()), float(y.min())
    width, height = float(x.max()) - x0, float(y.max()) - y0
    share = _POINTS_A_CELL / x.size
    cell_m = max(radius_m / 8, (width * height * share) ** 0.5, max(width, height) * share)
    if cell_m >= 2.0 * (radius_m + SLACK_M):  # four cells hold a zone: no wider than need be
        cell_m = max(cell_m * 0.5**0.5, 2.0 * (radius_m + SLACK_M))
    cell_m = max(cell_m, SLACK_M)
    cells = 1.0 / cell_m
    lattice = (x0, y0, cell_m, int(width * cells) + 1, int(height * cells) + 1)
    x, y = np.ascontiguousarray(x), np.ascontiguousarray(y)
    points = _sort_into_cells(x, y, code, priority, *lattice)
    return Grid(*points, int(priority.min()), *lattice)


@copied
def rows_within(grid: Grid, y: float, radius_m: float) -> tuple[int, int, int]:
    """Return the row of a place and how many rows lie within reach below and above it."""
    row = int(np.floor((y - grid.y0) / grid.cell_m))
    low = int(np.floor((y - radius_m - SLACK_M - grid.y0) / grid.cell_m))
    high = int(np.floor((y + radius_m + SLACK_M - grid.y0) / grid.cell_m))
    return row, row - max(low, 0), min(high, grid.rows - 1) - row


@copied
def row_span(grid: Grid, row: int, x: float, y: float, reach2: float) -> tuple[int, int]:
    """Return first and last point of the cells of one row that a disc touches."""
    bottom = grid.y0 + row * grid.cell_m
    dy = max(bottom - y, y - bottom - grid.cell_m, 0.0)
    dy = max(dy - SLACK_M, 0.0)
    if row < 0 or row >= grid.rows or dy * dy > reach2:
        return 0, 0
    half = np.sqrt(reach2 - dy * dy) + SLACK_M
    left = max(int(np.floor((x - half - grid.x0) / grid.cell_m)), 0)
    right = min(int(np.floor((x + half - grid.x0) / grid.cell_m)), grid.columns - 1)
    if left > right:
        return 0, 0
    return grid.start[row * grid.columns + left], grid.start[row * grid.columns + right + 1]

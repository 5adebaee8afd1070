"""Points sorted into square cells, so that who is near is found without looking at everyone."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from covertool.model import Floats
from covertool.positioning.kernel import copied, kernel
from covertool.positioning.noise import Indices

_POINTS_A_CELL = 2.0
SLACK_M = 1e-6


class Grid(NamedTuple):
    """Points sorted by cell: those of cell ``c`` are rows ``start[c]`` to ``start[c + 1]``."""

    start: Indices
    x: Floats
    y: Floats
    code: Indices
    priority: Indices
    x0: float
    y0: float
    cell_m: float
    columns: int
    rows: int


@kernel
def _sort_into_cells(cell: Indices, cells: int) -> tuple[Indices, Indices]:
    start = np.zeros(cells + 1, np.int64)
    for c in cell:
        start[c + 1] += 1
    for c in range(cells):
        start[c + 1] += start[c]
    free = start[:-1].copy()
    order = np.empty(cell.size, np.int64)
    for i in range(cell.size):
        order[free[cell[i]]] = i
        free[cell[i]] += 1
    return start, order


def build_grid(x: Floats, y: Floats, code: Indices, priority: Indices, radius_m: float) -> Grid:
    """Return points sorted into square cells of about two points, at least an eighth of the zone.

    Parameters
    ----------
    x, y : (N,) coordinates in metres
    code : (N,) car number, or ``ANCHOR_BIT`` plus anchor number
    priority : (N,) ``ANCHOR``, ``PSEUDO_ANCHOR`` or ``BLIND``
    radius_m : communication zone in metres
    """
    if x.size == 0:
        none = np.empty(0)
        return Grid(np.zeros(2, np.int64), none, none, code, priority, 0.0, 0.0, radius_m, 1, 1)
    x0, y0 = float(x.min()), float(y.min())
    width, height = float(x.max()) - x0, float(y.max()) - y0
    share = _POINTS_A_CELL / x.size
    cell_m = max(radius_m / 8, (width * height * share) ** 0.5, max(width, height) * share)
    columns, rows = int(width / cell_m) + 1, int(height / cell_m) + 1
    column = ((x - x0) / cell_m).astype(np.int64)
    row = ((y - y0) / cell_m).astype(np.int64)
    start, order = _sort_into_cells(row * columns + column, columns * rows)
    return Grid(
        start, x[order], y[order], code[order], priority[order], x0, y0, cell_m, columns, rows
    )


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

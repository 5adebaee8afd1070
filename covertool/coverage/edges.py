"""The transit area as directed edges in a uniform grid.

Each edge has the interior on its left and is cut at the grid lines, so that every piece lies in
one cell; a cell also knows whether its centre lies inside. Coordinates are local: the grid lines
are the multiples of the cell size. The grid is shifted by an odd share of a cell, so that drawn
edges do not run along grid lines.
"""

# mypy: disable-error-code="no-untyped-def,no-untyped-call"

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from covertool.coverage.compiled import borrowing, inlined
from covertool.coverage.gathering import gathered
from covertool.model import Floats, Integers

MAX_CELLS = 1 << 24
_SHIFTS = ((0.382, 0.618), (0.271, 0.843), (0.157, 0.429))


@dataclass(frozen=True)
class EdgeGrid:
    """Directed transit edges, cut at the lines of a grid and stored cell by cell.

    Attributes
    ----------
    x0_m, y0_m : origin of the local coordinates
    cell_m : size of a cell
    columns, rows : cells of the grid; cell ``row * columns + column``
    first : (cells + 1,) the edges of cell c are ``first[c]:first[c + 1]``
    edges : (M, 4) local start x, y and end x, y
    inside : (cells,) 1 where the centre of the cell lies in the transit area
    area_m2 : area of the transit area
    """

    x0_m: float
    y0_m: float
    cell_m: float
    columns: int
    rows: int
    first: Integers
    edges: Floats
    inside: npt.NDArray[np.int8]
    area_m2: float


def directed_edges(polygons: shapely.MultiPolygon | shapely.Polygon) -> Floats:
    """Return (M, 4) start x, y and end x, y of every edge, the interior on its left.

    Examples
    --------
    >>> directed_edges(shapely.box(0, 0, 2, 1))[0].tolist() in ([2, 0, 2, 1], [0, 0, 2, 0])
    True
    """
    parts = shapely.get_parts(polygons)
    parts = parts[~shapely.is_empty(parts)]
    if len(parts) == 0:
        return np.empty((0, 4))
    rings, owner = shapely.get_rings(parts, return_index=True)
    is_shell = np.append(True, owner[1:] != owner[:-1])
    points, ring = shapely.get_coordinates(rings, return_index=True)
    same = ring[1:] == ring[:-1]
    edges = np.column_stack([points[:-1], points[1:]])[same]
    ring = ring[:-1][same]
    near = edges[np.searchsorted(ring, np.arange(len(rings))), :2]
    local = edges - np.tile(near[ring], 2)
    twice = np.bincount(ring, local[:, 0] * local[:, 3] - local[:, 1] * local[:, 2])
    backwards = ((twice > 0) != is_shell)[ring]
    edges[backwards] = edges[backwards][:, [2, 3, 0, 1]]
    return np.ascontiguousarray(edges)


def edge_grid(edges: Floats, cell_m: float, attempt: int = 0) -> EdgeGrid:
    """Return directed edges in a grid of a wished cell size.

    The cells are made larger when there would be too many of them. ``attempt`` chooses one of
    three shifts of the grid.
    """
    low = np.array([edges[:, axis].min() for axis in (0, 1)])
    high = np.array([edges[:, axis].max() for axis in (0, 1)])
    width, height = (float(size) for size in high - low)
    while (width / cell_m + 3) * (height / cell_m + 3) > MAX_CELLS:
        cell_m *= 1.25
    # A coarse binary fraction: subtracting it from a coordinate is exact.
    quantum = 2.0 ** math.floor(math.log2(cell_m)) / 1024
    shift = np.array(_SHIFTS[attempt]) * cell_m
    x0, y0 = (float(value) for value in np.floor((low - shift) / quantum) * quantum)
    columns, rows = int((high[0] - x0) / cell_m) + 2, int((high[1] - y0) / cell_m) + 2
    local = edges - np.array([x0, y0, x0, y0])
    pieces, owner = _cut(local, cell_m, columns)
    order, first = gathered(owner, columns * rows)
    inside = _centres_inside(pieces, owner, cell_m, columns, rows)
    twice = float(np.sum(local[:, 0] * local[:, 3] - local[:, 1] * local[:, 2]))
    return EdgeGrid(x0, y0, cell_m, columns, rows, first, pieces[order], inside, twice / 2)


@inlined
def grid_line(place, cell):
    """Return the number of the last grid line at or before a place."""
    return math.floor(place / cell)


def _cut(edges: Floats, cell: float, columns: int) -> tuple[Floats, Integers]:
    """Return the pieces of the edges between grid lines, and the cell of each piece."""
    count = _pieces(edges, cell)
    pieces, owner = np.empty((count, 4)), np.empty(count, np.int64)
    _cut_edges(edges, cell, columns, pieces, owner)
    return pieces, owner


@borrowing
def _pieces(edges, cell):
    """Return into how many pieces the grid lines cut the edges."""
    count = 0
    for e in range(edges.shape[0]):
        steps_x = abs(grid_line(edges[e, 2], cell) - grid_line(edges[e, 0], cell))
        steps_y = abs(grid_line(edges[e, 3], cell) - grid_line(edges[e, 1], cell))
        count += steps_x + steps_y + 1
    return count


@borrowing
def _cut_edges(edges, cell, columns, pieces, owner):
    """Write the pieces of all edges and their cells."""
    n = 0
    for e in range(edges.shape[0]):
        n = _cut_edge(
            edges[e, 0], edges[e, 1], edges[e, 2], edges[e, 3], cell, columns, pieces, owner, n
        )


@borrowing
def _cut_edge(ax, ay, bx, by, cell, columns, pieces, owner, n):
    """Write the pieces of one edge and their cells; return the number of pieces so far."""
    column, row = grid_line(ax, cell), grid_line(ay, cell)
    left_x, left_y = grid_line(bx, cell) - column, grid_line(by, cell) - row
    step_x, step_y = (1 if left_x > 0 else -1), (1 if left_y > 0 else -1)
    x, y, t = ax, ay, 0.0
    while left_x != 0 or left_y != 0:
        line_x, line_y = cell * (column + max(step_x, 0)), cell * (row + max(step_y, 0))
        tx = (line_x - ax) / (bx - ax) if left_x != 0 else 2.0
        ty = (line_y - ay) / (by - ay) if left_y != 0 else 2.0
        t = min(max(t, min(tx, ty)), 1.0)
        if tx <= ty:
            new_x, new_y = line_x, ay + t * (by - ay)
        else:
            new_x, new_y = ax + t * (bx - ax), line_y
        pieces[n, 0], pieces[n, 1], pieces[n, 2], pieces[n, 3] = x, y, new_x, new_y
        owner[n] = row * columns + column
        n += 1
        x, y = new_x, new_y
        if tx <= ty:
            column += step_x
            left_x -= step_x
        else:
            row += step_y
            left_y -= step_y
    pieces[n, 0], pieces[n, 1], pieces[n, 2], pieces[n, 3] = x, y, bx, by
    owner[n] = row * columns + column
    return n + 1


def _centres_inside(
    pieces: Floats, owner: Integers, cell: float, columns: int, rows: int
) -> npt.NDArray[np.int8]:
    """Return 1 for each cell whose centre has winding number 1: the sum along its row."""
    turn = np.zeros(columns * rows, np.int32)
    _turns(pieces, owner, cell, columns, turn)
    winding = np.cumsum(turn.reshape(rows, columns), axis=1, dtype=np.int32)
    return (winding > 0).ravel().astype(np.int8)


@borrowing
def _turns(pieces, owner, cell, columns, turn):
    """Write where along its row the winding number changes, and by how much."""
    for i in range(pieces.shape[0]):
        row, column = owner[i] // columns, owner[i] % columns
        middle_x, middle_y = cell * (column + 0.5), cell * (row + 0.5)
        ax, ay, bx, by = pieces[i, 0], pieces[i, 1], pieces[i, 2], pieces[i, 3]
        if (ay <= middle_y) != (by <= middle_y):
            # The centre lies to the right of the edge, or the next centre does.
            at = ax + (middle_y - ay) / (by - ay) * (bx - ax)
            here = owner[i] if at < middle_x else owner[i] + 1
            if here < (row + 1) * columns:
                turn[here] += 1 if by < ay else -1

"""The grid cells of the transit area: the discs near each, and all level boundaries in it."""

# mypy: disable-error-code="no-untyped-def,no-untyped-call"

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from covertool.coverage.arcs import sweep_arc, sweep_edge
from covertool.coverage.compiled import borrowing, inlined
from covertool.coverage.crossings import quadrant_in_cell
from covertool.coverage.discs import DiscGrid
from covertool.coverage.edges import EdgeGrid
from covertool.model import Floats

_ROWS = 2048
"""Room for level boundaries that stays in the processor's cache."""


def level_boundaries(discs: DiscGrid, transit: EdgeGrid) -> Iterator[Floats]:
    """Yield the level boundaries of all cells in rows that ``sweep_cell`` describes.

    Each array is overwritten by the next one.
    """
    space, c = _working_space(_ROWS), 0
    while c < transit.inside.size:
        done, n = _next_boundaries(
            c, discs.discs, discs.shape, discs.place, discs.first,
            transit.cell_m, transit.columns, transit.first, transit.edges, transit.inside, *space,
        )  # fmt: skip
        yield space[-1][:n]
        if done == c:  # there is no room for this cell alone
            space = _working_space(2 * len(space[-1]))
        c = done


def _working_space(size: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Return arrays for discs near a cell, transit crossings, events on an arc, and boundaries."""
    return np.empty((size, 6)), np.empty((size, 3)), np.empty((size, 4)), np.empty((size, 8))


@borrowing
def _next_boundaries(
    c, discs, shape, place, first_disc, cell, columns, first_edge, edges, inside,
    near, hits, events, out,
):  # fmt: skip
    """Write the boundaries of the cells from c on that fit in ``out``.

    Returns the first cell that did not fit, and the number of boundaries.
    """
    n = 0
    while c < inside.size:
        m = cell_boundaries(
            c, discs, shape, place, first_disc, cell, columns, first_edge, edges, inside,
            near, hits, events, out[n:],
        )  # fmt: skip
        if m < 0:
            break
        n += m
        c += 1
    return c, n


@borrowing
def cell_boundaries(
    c, discs, shape, place, first_disc, cell, columns, first_edge, edges, inside,
    near, hits, events, out,
):  # fmt: skip
    """Write the level boundaries of cell c to ``out``; return their number, -1 if too many.

    See ``DiscGrid`` and ``EdgeGrid`` for the arguments, ``sweep_cell`` for the rows of ``out``.
    """
    e0, e1 = first_edge[c], first_edge[c + 1]
    if e0 == e1 and inside[c] == 0:
        return 0
    column, row = c % columns, c // columns
    x0, y0, x1, y1 = cell * column, cell * row, cell * (column + 1), cell * (row + 1)
    half = 0.5 * cell * (1.0 + 1e-9)
    base, k = gather(0.5 * (x0 + x1), 0.5 * (y0 + y1), half, discs, shape, place, first_disc, near)
    if k < 0 or 2 * (k + e1 - e0) > events.shape[0]:
        return -1
    return sweep_cell(
        near, k, base, x0, y0, x1, y1, inside[c] > 0, edges, e0, e1, hits, events, out
    )


@borrowing
def sweep_cell(near, k, base, x0, y0, x1, y1, centre_inside, edges, e0, e1, hits, events, out):
    """Write every level boundary of one cell to ``out``; return their number, -1 if too many.

    Parameters
    ----------
    near : (>= k, 6) discs whose circle may cross the cell: x, y, radius, weight, index, and
        room for the last of their hits
    base : depth of the discs that cover the whole cell
    x0, y0, x1, y1 : the cell's lower left and upper right corner
    edges, e0, e1 : the transit edges of the cell are ``edges[e0:e1]``
    hits : (capacity, 3) working space: where circles cross edges, and the disc's hit before
    events : (>= 2 k + 2 (e1 - e0), 4) working space
    out : (capacity, 8) rows of start x, y, end x, y, radius (0 for an edge), depth on the right,
        depth on the left, disc (-1 for an edge)
    """
    m, h = 0, 0
    for j in range(k):
        near[j, 5] = -1.0
    for e in range(e0, e1):
        m, h = sweep_edge(near, k, base, edges, e, hits, h, events, out, m)
        if m < 0:
            return -1
    qx, qy = 0.5 * (x0 + x1), 0.5 * (y0 + y1)
    for i in range(k):
        for quadrant in range(4):
            u0, u1, from_x, from_y, to_x, to_y = quadrant_in_cell(
                near[i, 0], near[i, 1], near[i, 2], quadrant, x0, y0, x1, y1
            )
            if u0 < u1:
                m = sweep_arc(
                    i, near, k, base, quadrant, u0, u1, from_x, from_y, to_x, to_y,
                    qx, qy, centre_inside, edges, e0, e1, hits, events, out, m,
                )  # fmt: skip
                if m < 0:
                    return -1
    return m


@borrowing
def gather(qx, qy, half, discs, shape, place, first, near):
    """Find the discs that matter in the square of half-width ``half`` around q, nearest first.

    Returns the depth of the discs that cover all of it, and how many others reach it; these are
    written to ``near``. Stops at depth 3, where the others no longer matter. Their number is -1
    when ``near`` is too small.
    """
    base, k = 0.0, 0
    for c in range(shape.shape[0]):
        columns, rows, offset = shape[c, 0], shape[c, 1], shape[c, 2]
        size, reach = place[c, 2], place[c, 3] + half * math.sqrt(2.0)
        column, row = (
            math.floor((qx - place[c, 0]) / size),
            math.floor((qy - place[c, 1]) / size),
        )
        for ring in range(int(reach / size) + 2):
            for y in range(max(row - ring, 0), min(row + ring, rows - 1) + 1):
                step = 1 if abs(y - row) == ring or ring == 0 else 2 * ring
                for x in range(column - ring, column + ring + 1, step):
                    if 0 <= x < columns:
                        at = offset + y * columns + x
                        base, k = gather_cell(
                            qx, qy, half, discs, first[at], first[at + 1], near, base, k
                        )
                        if base >= 3.0:
                            return base, 0
                        if k < 0:
                            return base, k
    return base, k


@inlined
def gather_cell(qx, qy, half, discs, d0, d1, near, base, k):
    """Sort the discs of one grid cell into those that cover, cross, and miss; see ``gather``."""
    for d in range(d0, d1):
        squared = discs[d, 2] * discs[d, 2]
        dx, dy = abs(discs[d, 0] - qx), abs(discs[d, 1] - qy)
        if max(dx - half, 0.0) ** 2 + max(dy - half, 0.0) ** 2 >= squared:
            continue
        if (dx + half) ** 2 + (dy + half) ** 2 <= squared:
            base += discs[d, 3]
            if base >= 3.0:
                return base, k
            continue
        if k >= near.shape[0]:
            return base, -1
        near[k, 0], near[k, 1], near[k, 2] = discs[d, 0], discs[d, 1], discs[d, 2]
        near[k, 3], near[k, 4] = discs[d, 3], np.float64(d)
        k += 1
    return base, k

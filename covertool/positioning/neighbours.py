"""Whom a car ranges to: everyone in its communication zone, and the best three of them.

Points lie in square cells. A car looks at the rows of cells that its zone touches, and only as far
as a better neighbour could be. No list of all pairs is made unless an option needs one.
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np

from covertool.model import Floats
from covertool.positioning.grid import ANCHOR, Grid, row_span, rows_within
from covertool.positioning.kernel import kernel
from covertool.positioning.nearest import Hits, best_of_all, insert, nobody
from covertool.positioning.noise import ANCHOR_BIT, Indices

GDOP_POOL = 8
"""Nearest candidates of the last priority among which the best geometry is sought."""


class Selection(NamedTuple):
    """The chosen neighbours of each car, best first.

    ``neighbour`` is (cars, most) with the number of a moving car, or ``ANCHOR_BIT`` plus the number
    of an anchor, or -1; ``filled`` and ``anchors`` are (cars,): how many, and how many of them
    have the priority of an anchor.
    """

    neighbour: Indices
    filled: Indices
    anchors: Indices


class Candidates(NamedTuple):
    """Everyone in each car's zone: those of car i are rows ``start[i]`` to ``start[i + 1]``."""

    start: Indices
    code: Indices
    priority: Indices
    dx: Floats
    dy: Floats


def select_nearest(cars: Grid, anchors: Grid, radius_m: float, most: int = 3) -> Selection:
    """Return for each car its best neighbours: by priority, then the nearest first.

    Parameters
    ----------
    cars, anchors : from :func:`~covertool.positioning.grid.build_grid`; car i has code i
    radius_m : communication zone in metres; its edge belongs to it
    most : neighbours at most

    Examples
    --------
    >>> from covertool.positioning.grid import BLIND, build_grid
    >>> x, y = np.array([0.0, 3.0]), np.array([0.0, 4.0])
    >>> cars = build_grid(x, y, np.arange(2), np.full(2, BLIND), 5.0)
    >>> none = build_grid(x[:0], y[:0], np.arange(0), np.arange(0), 5.0)
    >>> select_nearest(cars, none, 5.0).neighbour[:, 0].tolist()
    [1, 0]
    """
    return Selection(*best_of_all(cars, anchors, radius_m, most))


@kernel
def _list(
    grid: Grid, car: int, x: float, y: float, radius2: float, found: int, out: Candidates
) -> int:
    """Write the candidates of one car from one grid; with no room, only count them."""
    centre, below, above = rows_within(grid, y, np.sqrt(radius2))
    for row in range(centre - below, centre + above + 1):
        first, last = row_span(grid, row, x, y, radius2)
        for k in range(first, last):
            dx, dy = grid.x[k] - x, grid.y[k] - y
            if dx * dx + dy * dy <= radius2 and grid.code[k] != car:
                if found < out.code.size:
                    out.code[found], out.priority[found] = grid.code[k], grid.priority[k]
                    out.dx[found], out.dy[found] = dx, dy
                found += 1
    return found


@kernel
def _list_all(
    x: Floats, y: Floats, cars: Grid, anchors: Grid, radius_m: float, out: Candidates
) -> int:
    found = 0
    for i in range(x.size):
        out.start[i] = found
        found = _list(anchors, i, x[i], y[i], radius_m * radius_m, found, out)
        found = _list(cars, i, x[i], y[i], radius_m * radius_m, found, out)
    out.start[x.size] = found
    return found


def _room(cars: int, size: int) -> Candidates:
    whole, real = np.empty((3, size), np.int64), np.empty((2, size))
    return Candidates(np.empty(cars + 1, np.int64), whole[0], whole[1], real[0], real[1])


def list_candidates(x: Floats, y: Floats, cars: Grid, anchors: Grid, radius_m: float) -> Candidates:
    """Return everyone in each car's zone, for the options that look at all of them."""
    size = _list_all(x, y, cars, anchors, radius_m, _room(x.size, 0))
    out = _room(x.size, size)
    _list_all(x, y, cars, anchors, radius_m, out)
    return out


def select_ranked(listed: Candidates, metric: Floats, most: int = 3) -> Selection:
    """Return for each car its best candidates: by priority, then by a metric of each candidate."""
    cars = listed.start.size - 1
    best = nobody(cars, most)
    who = np.repeat(np.arange(cars), np.diff(listed.start))
    hits = Hits(who, np.arange(who.size), metric)
    insert(np.full(cars, -1), listed.code, listed.priority, hits, who.size, best)
    return Selection(best.neighbour, best.filled, (best.priority == ANCHOR).sum(axis=1))


def select_all(listed: Candidates) -> Selection:
    """Return everyone in each car's zone, by priority and then the nearest first."""
    most = int(np.diff(listed.start).max(initial=1))
    return select_ranked(listed, listed.dx**2 + listed.dy**2, max(most, 1))


def select_gdop(listed: Candidates, most: int = 3) -> Selection:
    """Return for each car the best candidates: by priority, then by their geometry.

    Higher priorities are taken whole. Of the first priority that does not fit, the choice among
    its ``GDOP_POOL`` nearest is the one with the least geometric dilution of precision,
    ``sqrt(trace((U' U)^-1))`` for unit vectors U to all that are chosen.
    """
    nearest = select_ranked(listed, listed.dx**2 + listed.dy**2, most + GDOP_POOL)
    chosen, n = nearest.neighbour[:, :most].copy(), len(nearest.filled)
    for i in range(n):
        rows = slice(int(listed.start[i]), int(listed.start[i + 1]))
        if rows.stop - rows.start > most:
            chosen[i] = _best_geometry(listed, rows, nearest.neighbour[i], most)
    return Selection(chosen, np.minimum(nearest.filled, most), np.minimum(nearest.anchors, most))


def _best_geometry(listed: Candidates, rows: slice, ranked: Indices, most: int) -> Indices:
    where = {int(code): k for k, code in enumerate(listed.code[rows])}
    order = np.array([where[int(code)] for code in ranked if code >= 0])
    priority = listed.priority[rows][order]
    last = priority[most - 1]
    fixed = np.flatnonzero(priority < last)
    pool = np.flatnonzero(priority == last)[:GDOP_POOL]
    direction = np.stack([listed.dx[rows], listed.dy[rows]], axis=1)[order]
    direction /= np.maximum(np.hypot(*direction.T), 1e-9)[:, None]
    sets = [[*fixed, *more] for more in combinations(pool, most - len(fixed))]
    best = min(sets, key=lambda chosen: _dilution(direction[chosen]))
    return ranked[best]


def _dilution(direction: Floats) -> float:
    """Return the squared GDOP of unit vectors; infinite when they lie on one line."""
    normal = direction.T @ direction
    determinant = float(np.linalg.det(normal))
    return float(np.trace(normal)) / determinant if determinant > 1e-12 else float("inf")


def anchor_codes(count: int) -> Indices:
    """Return the codes of ``count`` anchors."""
    return np.arange(count, dtype=np.int64) | ANCHOR_BIT

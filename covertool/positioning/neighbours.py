"""Whom a car ranges to: everyone in its communication zone, and the best three of them.

Points lie in square cells. A car looks row by row outwards, and only as far as a better neighbour
could be. Selection happens while looking: no list of pairs is made unless an option needs one.
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np

from covertool.model import Floats
from covertool.positioning.grid import SLACK_M, Grid, row_span, rows_within
from covertool.positioning.kernel import copied, kernel
from covertool.positioning.noise import ANCHOR_BIT, Indices

ANCHOR, PSEUDO_ANCHOR, BLIND = 1, 2, 3
"""Priorities of the paper's section IV-D; 1 is the highest."""

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


@copied
def _insert(
    neighbour: Indices, priority: Indices, metric: Floats, count: int, code: int, p: int, d: float
) -> int:
    """Insert a candidate into the sorted best; equal ones go by number, whatever the order."""
    most = neighbour.size
    k = count
    while k > 0 and (
        p < priority[k - 1]
        or (
            p == priority[k - 1]
            and (d < metric[k - 1] or (d == metric[k - 1] and code < neighbour[k - 1]))
        )
    ):
        if k < most:
            neighbour[k], priority[k] = neighbour[k - 1], priority[k - 1]
            metric[k] = metric[k - 1]
        k -= 1
    if k == most:
        return count
    neighbour[k], priority[k], metric[k] = code, p, d
    return min(count + 1, most)


@copied
def _scan(
    grid: Grid,
    car: int,
    x: float,
    y: float,
    radius2: float,
    neighbour: Indices,
    priority: Indices,
    metric: Floats,
    count: int,
) -> int:
    last_place = neighbour.size - 1
    radius_m = np.sqrt(radius2) + SLACK_M
    u, v, reach = (x - grid.x0) / grid.cell_m, (y - grid.y0) / grid.cell_m, radius_m / grid.cell_m
    left, right = int(max(u - reach, 0.0)), int(max(min(u + reach, grid.columns - 1.0), -1.0))
    low, high = int(max(v - reach, 0.0)), int(max(min(v + reach, grid.rows - 1.0), -1.0))
    if u + reach < 0.0 or v + reach < 0.0 or left > right or low > high:
        return count
    near = reach < 1.0  # three rows at most: to look at their whole width costs less than to trim
    centre = min(max(int(v), low), high)
    reach2 = radius2
    for step in range(2 * max(centre - low, high - centre) + 1):
        # 0, +1, -1, +2, -2 ...: what is found early shortens the way to go
        row = centre + ((step + 1) // 2 if step % 2 else -(step // 2))
        if row < low or row > high:
            continue
        if near:
            first = grid.start[row * grid.columns + left]
            last = grid.start[row * grid.columns + right + 1]
        else:
            first, last = row_span(grid, row, x, y, reach2)
        for k in range(first, last):
            dx, dy = grid.x[k] - x, grid.y[k] - y
            d2 = dx * dx + dy * dy
            if d2 > reach2:
                continue
            p = grid.priority[k]
            if count > last_place and (
                p > priority[last_place] or (p == priority[last_place] and d2 > metric[last_place])
            ):
                continue
            if grid.code[k] != car:
                count = _insert(neighbour, priority, metric, count, grid.code[k], p, d2)
                if count > last_place and priority[last_place] == ANCHOR:
                    reach2 = metric[last_place]
    return count


@kernel
def _select_nearest(
    cars: Grid, anchors: Grid, radius_m: float, most: int
) -> tuple[Indices, Indices, Indices]:
    n = cars.code.size
    chosen = np.full((n, most), -1, np.int64)
    count, known = np.zeros(n, np.int64), np.zeros(n, np.int64)
    priority, metric, best = np.empty(most, np.int64), np.empty(most), np.empty(most, np.int64)
    radius2 = radius_m * radius_m
    best_car = cars.priority.min() if n > 0 else BLIND
    for place in range(n):  # in the order of the cells, so that what is near is in the cache
        i, own_x, own_y = cars.code[place], cars.x[place], cars.y[place]
        filled = _scan(anchors, i, own_x, own_y, radius2, best, priority, metric, 0)
        if filled < most or best_car == ANCHOR:
            filled = _scan(cars, i, own_x, own_y, radius2, best, priority, metric, filled)
        count[place] = filled
        for k in range(filled):
            chosen[place, k] = best[k]
            known[place] += priority[k] == ANCHOR
    back = np.empty(n, np.int64)
    for place in range(n):
        back[cars.code[place]] = place
    return chosen[back], count[back], known[back]


def select_nearest(cars: Grid, anchors: Grid, radius_m: float, most: int = 3) -> Selection:
    """Return for each car its best neighbours: by priority, then the nearest first.

    Parameters
    ----------
    cars, anchors : from :func:`~covertool.positioning.grid.build_grid`; car i has code i
    radius_m : communication zone in metres; its edge belongs to it
    most : neighbours at most

    Examples
    --------
    >>> from covertool.positioning.grid import build_grid
    >>> x, y = np.array([0.0, 3.0]), np.array([0.0, 4.0])
    >>> cars = build_grid(x, y, np.arange(2), np.full(2, BLIND), 5.0)
    >>> none = build_grid(x[:0], y[:0], np.arange(0), np.arange(0), 5.0)
    >>> select_nearest(cars, none, 5.0).neighbour[:, 0].tolist()
    [1, 0]
    """
    return Selection(*_select_nearest(cars, anchors, radius_m, most))


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


@kernel
def _select_ranked(
    listed: Candidates, metric: Floats, most: int
) -> tuple[Indices, Indices, Indices]:
    n = listed.start.size - 1
    chosen = np.full((n, most), -1, np.int64)
    count, known = np.zeros(n, np.int64), np.zeros(n, np.int64)
    priority, ranked = np.empty(most, np.int64), np.empty(most)
    for i in range(n):
        filled = 0
        for k in range(listed.start[i], listed.start[i + 1]):
            code, p = listed.code[k], listed.priority[k]
            filled = _insert(chosen[i], priority, ranked, filled, code, p, metric[k])
        count[i] = filled
        for k in range(filled):
            known[i] += priority[k] == ANCHOR
    return chosen, count, known


def select_ranked(listed: Candidates, metric: Floats, most: int = 3) -> Selection:
    """Return for each car its best candidates: by priority, then by a metric of each candidate."""
    return Selection(*_select_ranked(listed, metric, most))


def select_all(listed: Candidates) -> Selection:
    """Return everyone in each car's zone, by priority and then the nearest first."""
    most = int(np.diff(listed.start).max(initial=1))
    return select_ranked(listed, np.hypot(listed.dx, listed.dy), max(most, 1))


def select_gdop(listed: Candidates, most: int = 3) -> Selection:
    """Return for each car the best candidates: by priority, then by their geometry.

    Higher priorities are taken whole. Of the first priority that does not fit, the choice among
    its ``GDOP_POOL`` nearest is the one with the least geometric dilution of precision,
    ``sqrt(trace((U' U)^-1))`` for unit vectors U to all that are chosen.
    """
    nearest = select_ranked(listed, np.hypot(listed.dx, listed.dy), most + GDOP_POOL)
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

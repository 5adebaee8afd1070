"""The best neighbours of every car: by priority, then the nearest first.

A block of cars passes loops that are each simple enough to run without waiting for memory or for a
branch: which cells a car's zone touches; which points in them lie in the zone; and which of those
are its best. Where points are far apart, the cells are wide and the first is four cells for each
car. No list of all pairs is made. Where every point is looked at, places in arrays are unsigned: of
a signed one, the compiled loop also asks whether it counts from the end.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from covertool.model import Floats
from covertool.positioning.grid import ANCHOR, SLACK_M, Grid
from covertool.positioning.kernel import kernel
from covertool.positioning.noise import Indices

BLOCK = 512
"""Cars whose cells and best neighbours are in the cache together."""

Counts = npt.NDArray[np.int16]
"""Counts of a few, kept small where they are written in no order."""

_ROOM = 64
_ENOUGH = 16
"""Points found in zones that are worth a look at whether they are better than the best so far."""

_AT_ONCE = 8
"""Points of a car that are listed without asking how many there are: seldom are there more."""

_NOBODY = np.iinfo(np.int64).max


class Best(NamedTuple):
    """The best of each car so far, best first: (cars, most), and how many of them: (cars,)."""

    neighbour: Indices
    priority: Indices
    metric: Floats
    filled: Indices


class _Spans(NamedTuple):
    """Points in a row of cells that a zone touches: whose zone, which, and how far the row is."""

    who: Indices
    first: Indices
    last: Indices
    gap2: Floats


class _Runs(NamedTuple):
    """Points of two runs of rows for each car: ``size`` from ``first`` on, then others to ``end``.

    The t-th is row ``first + t`` while t is below ``size``, and then ``other + t``.
    """

    first: Indices
    size: Indices
    other: Indices
    end: Indices


class Hits(NamedTuple):
    """Points in a zone: whose zone, which point of the grid, and its squared distance."""

    who: Indices
    where: Indices
    metric: Floats


@kernel
def nobody(cars: int, most: int) -> Best:
    """Return the best neighbours of cars that know of none yet."""
    neighbour, priority = np.full((cars, most), -1), np.full((cars, most), _NOBODY)
    return Best(neighbour, priority, np.full((cars, most), np.inf), np.zeros(cars, np.int64))


@kernel
def insert(
    own: Indices, code: Indices, priority: Indices, hits: Hits, size: int, best: Best
) -> None:
    """Insert hits into the sorted best of their cars; equal ones go by number, not by order.

    ``own`` are the codes of the cars, which do not hear themselves; ``code`` and ``priority`` those
    of the points.
    """
    who, where, metric = hits.who, hits.where, hits.metric
    neighbour, rank, distance, filled = best.neighbour, best.priority, best.metric, best.filled
    most = neighbour.shape[1]
    for hit in range(size):
        h = np.uintp(hit)
        i, q, d = np.uintp(who[h]), np.uintp(where[h]), metric[h]
        c, p, k = code[q], priority[q], filled[i]
        if c == own[i]:
            continue
        while k > 0:
            here, above = np.uintp(k), np.uintp(k - 1)
            r, e = rank[i, above], distance[i, above]
            if r < p or (r == p and (e < d or (e == d and neighbour[i, above] <= c))):
                break
            if k < most:
                neighbour[i, here], rank[i, here], distance[i, here] = neighbour[i, above], r, e
            k -= 1
        if k < most:
            here = np.uintp(k)
            neighbour[i, here], rank[i, here], distance[i, here] = c, p, d
            filled[i] = min(filled[i] + 1, most)


@kernel
def _four_cells(x: Floats, y: Floats, grid: Grid, best: Best) -> _Runs:
    """Return where the points of the four cells around each car lie.

    A zone no wider than a cell lies in them. Cars whose best all go before the highest priority of
    the grid, and those far outside it, have none.
    """
    start, columns, rows, cells = grid.start, grid.columns, grid.rows, 1.0 / grid.cell_m
    worst, highest, x0, y0 = best.priority[:, -1], grid.highest, grid.x0, grid.y0
    whole = np.empty((4, x.size), np.int64)
    firsts, sizes, others, ends = whole[0], whole[1], whole[2], whole[3]
    for car in range(x.size):
        i = np.uintp(car)
        column = math.floor((x[i] - x0) * cells - 0.5)
        row = math.floor((y[i] - y0) * cells - 0.5)
        outside = column < -1 or row < -1 or column >= columns or row >= rows
        left, right = min(max(column, 0), columns), max(min(column + 2, columns), 0)
        low, high = min(max(row, 0), rows - 1) * columns, max(min(row + 1, rows - 1), 0) * columns
        first, last = start[np.uintp(low + left)], start[np.uintp(low + right)]
        size = last - first
        other = start[np.uintp(high + left)] - size
        end = start[np.uintp(high + right)] - other if high > low else size
        firsts[i], sizes[i], others[i] = first, size, other
        ends[i] = 0 if outside or worst[i] < highest else end
    return _Runs(firsts, sizes, others, ends)


@kernel
def _list_points(runs: _Runs) -> tuple[Hits, int]:
    """List each car with each point of its runs; return the list and its length."""
    firsts, sizes, others, ends = runs.first, runs.size, runs.other, runs.end
    room = ends.sum() + _AT_ONCE
    listed = Hits(np.empty(room, np.int64), np.empty(room, np.int64), np.empty(room))
    who, where, n = listed.who, listed.where, 0
    for car in range(ends.size):
        i = np.uintp(car)
        first, size, other, end = firsts[i], sizes[i], others[i], ends[i]
        for t in range(_AT_ONCE):  # always so many: what was too many is written over
            free = np.uintp(n + t)
            who[free], where[free] = car, t + (first if t < size else other)
        for t in range(_AT_ONCE, end):
            free = np.uintp(n + t)
            who[free], where[free] = car, t + (first if t < size else other)
        n += end
    return listed, n


@kernel
def _keep_within(x: Floats, y: Floats, grid: Grid, radius_m: float, listed: Hits, size: int) -> int:
    """Move what lies within the zones to the front of a list; return how much that is."""
    who, where, metric = listed.who, listed.where, listed.metric
    points_x, points_y, n, zone2 = grid.x, grid.y, 0, radius_m * radius_m
    for pair in range(size):
        p, free = np.uintp(pair), np.uintp(n)
        i, q = np.uintp(who[p]), np.uintp(where[p])
        dx, dy = points_x[q] - x[i], points_y[q] - y[i]
        d2 = dx * dx + dy * dy
        who[free], where[free], metric[free] = i, q, d2
        n += d2 <= zone2
    return n


@kernel
def _look_around(
    x: Floats, y: Floats, own: Indices, grid: Grid, radius_m: float, best: Best
) -> None:
    """Look at the points of the four cells around each car."""
    listed, size = _list_points(_four_cells(x, y, grid, best))
    near = _keep_within(x, y, grid, radius_m, listed, size)
    insert(own, grid.code, grid.priority, listed, near, best)


@kernel
def _touched(x: Floats, y: Floats, grid: Grid, radius_m: float, best: Best, spans: _Spans) -> int:
    """Write the cells that the zones touch, the row of each car first; return how many spans.

    Cars whose best all go before the highest priority of the grid look at none.
    """
    who, first, last, gap2 = spans.who, spans.first, spans.last, spans.gap2
    start, columns, rows, cells = grid.start, grid.columns, grid.rows, 1.0 / grid.cell_m
    worst, highest, reach = best.priority[:, -1], grid.highest, (radius_m + SLACK_M) * cells
    n, around = 0, 2 * int(reach) + 3
    for i in range(x.size):
        if worst[i] < highest:
            continue
        u, v = (x[i] - grid.x0) * cells, (y[i] - grid.y0) * cells
        middle = math.floor(v)
        for step in range(around):  # 0, +1, -1, +2 ...
            row = middle + ((step + 1) // 2 if step % 2 else -(step // 2))
            dy = max(row - v, v - row - 1.0, 0.0)
            half = math.sqrt(max(reach * reach - dy * dy, 0.0))
            left, right = max(u - half, 0.0), min(u + half, columns - 1.0)
            begin = min(max(row, 0), rows - 1) * columns
            who[n], gap2[n] = i, max(dy * grid.cell_m - SLACK_M, 0.0) ** 2
            first[n] = start[begin + int(min(left, columns - 1.0))]
            last[n] = start[begin + int(max(right, 0.0)) + 1]
            inside = 0 <= row < rows and dy <= reach and right >= 0.0 and left < columns
            n += inside and first[n] < last[n]
    return n


@kernel
def _look(
    x: Floats,
    y: Floats,
    own: Indices,
    grid: Grid,
    radius_m: float,
    spans: _Spans,
    size: int,
    best: Best,
) -> None:
    """Look at the points of the spans, and not beyond the best of the highest priority."""
    who, first, last, gap2 = spans.who, spans.first, spans.last, spans.gap2
    points_x, points_y, code, priority = grid.x, grid.y, grid.code, grid.priority
    worst, farthest, highest = best.priority[:, -1], best.metric[:, -1], grid.highest
    hits = Hits(np.empty(_ROOM, np.int64), np.empty(_ROOM, np.int64), np.empty(_ROOM))
    whose, where, metric = hits.who, hits.where, hits.metric
    n, zone2 = 0, radius_m * radius_m
    for s in range(size):
        i, k = who[s], first[s]
        own_x, own_y = x[i], y[i]
        reach2 = farthest[i] if worst[i] == highest else zone2
        if gap2[s] > reach2:
            continue
        while k < last[s]:
            stop = min(last[s], k + _ROOM - n)
            for t in range(k, stop):
                q, free = np.uintp(t), np.uintp(n)
                dx, dy = points_x[q] - own_x, points_y[q] - own_y
                d2 = dx * dx + dy * dy
                whose[free], where[free], metric[free] = i, q, d2
                n += d2 <= reach2
            k = stop
            if n >= _ENOUGH:
                insert(own, code, priority, hits, n, best)
                n = 0
    insert(own, code, priority, hits, n, best)


@kernel
def _hand_out(own: Indices, best: Best, neighbour: Indices, anchors: Counts) -> None:
    """Write the best of a block of cars to their own rows, which lie anywhere."""
    for i in range(own.size):
        row, car, known = np.uintp(i), np.uintp(own[i]), 0
        for k in range(neighbour.shape[1]):
            place = np.uintp(k)
            neighbour[car, place] = best.neighbour[row, place]
            known += best.priority[row, place] == ANCHOR
        anchors[car] = known


@kernel
def _count(neighbour: Indices) -> Indices:
    """Return how many neighbours each car has."""
    filled = np.empty(neighbour.shape[0], np.int64)
    for i in range(filled.size):
        row, n = np.uintp(i), 0
        for k in range(neighbour.shape[1]):
            n += neighbour[row, np.uintp(k)] >= 0
        filled[row] = n
    return filled


@kernel
def best_of_all(
    cars: Grid, anchors: Grid, radius_m: float, most: int
) -> tuple[Indices, Indices, Indices]:
    """Return for each car its best neighbours, how many, and how many of them are anchors."""
    size, least_m = cars.code.size, min(cars.cell_m, anchors.cell_m)
    neighbour, known = np.empty((size, most), np.int64), np.empty(size, np.int16)
    room = BLOCK * (2 * int((radius_m + SLACK_M) / least_m) + 3)
    whole = np.empty((3, room), np.int64)
    spans = _Spans(whole[0], whole[1], whole[2], np.empty(room))
    for first in range(0, size, BLOCK):
        some = slice(first, min(first + BLOCK, size))
        x, y, own = cars.x[some], cars.y[some], cars.code[some]
        best = nobody(own.size, most)
        for grid in (anchors, cars):
            if grid.cell_m >= 2.0 * (radius_m + SLACK_M):
                _look_around(x, y, own, grid, radius_m, best)
            else:
                n = _touched(x, y, grid, radius_m, best, spans)
                _look(x, y, own, grid, radius_m, spans, n, best)
        _hand_out(own, best, neighbour, known)
    return neighbour, _count(neighbour), known.astype(np.int64)

"""Arcs and edges as polylines that keep the arcs' area and do not cross one another."""

# mypy: disable-error-code="no-untyped-def,no-untyped-call"

from __future__ import annotations

import math

import numpy as np

from covertool.coverage.compiled import compiled
from covertool.model import Floats, Integers

_ROUNDS = 6
_FINER = 4


def chords(
    starts: Floats,
    ends: Floats,
    discs: Floats,
    owner: Integers,
    angle: Floats,
    tolerance_m: float,
) -> tuple[Floats, Integers]:
    """Return the vertices of all lines one after another, and the place of each line's first.

    Lines of owner -1 are straight. Where two polylines cross, as arcs that nearly touch may,
    both are drawn four times finer, until none do.

    Parameters
    ----------
    starts, ends : (N, 2) ends of the lines
    discs : (M, 4) x, y, radius and weight
    owner : (N,) the disc of each arc, -1 for an edge
    angle : (N,) the angle of each arc in radians
    tolerance_m : greatest distance between an arc and its chords
    """
    arc = owner >= 0
    disc = discs[np.where(arc, owner, 0)]
    widest = np.minimum(2 * np.arccos(np.clip(1 - tolerance_m / disc[:, 2], -1, 1)), np.pi / 4)
    count = np.where(arc, np.maximum(np.ceil(angle / widest), 2), 1).astype(np.int64)
    points, first = _drawn(starts, ends, disc, angle, count)
    for _ in range(_ROUNDS):
        steps = np.diff(points, axis=0)
        cell_m = 2 * float(np.sqrt(np.mean(np.delete(steps, first[1:-1] - 1, axis=0) ** 2)))
        crossed = _crossing_lines(points, first, max(cell_m, 1e-9)) & arc
        if not crossed.any():
            break
        count[crossed] *= _FINER
        points, first = _drawn(starts, ends, disc, angle, count)
    return points, first


def _drawn(
    starts: Floats, ends: Floats, disc: Floats, angle: Floats, count: Integers
) -> tuple[Floats, Integers]:
    """Return the vertices for a number of chords each.

    An arc of n chords of angle d keeps its ends; the vertices between lie at the radius rho for
    which the area is kept: ``2 r rho + (n - 2) rho^2 = r^2 n d / sin d``.
    """
    radius, step = disc[:, 2], angle / count
    wanted = radius * np.divide(angle, np.sin(step), out=np.ones_like(step), where=step > 0)
    # The root of (n - 2) rho^2 + 2 r rho - r wanted, in the form that also holds for n = 2.
    rho = radius * wanted / (radius + np.sqrt(radius**2 + (count - 2) * radius * wanted))
    first = np.append(0, np.cumsum(count + 1))
    points: Floats = _vertices(starts, ends, disc, rho, count, step, first)
    return points, first


@compiled
def _vertices(starts, ends, disc, rho, count, step, first):
    """Write the vertices of all lines one after another."""
    points = np.empty((first[-1], 2))
    for i in range(count.size):
        points[first[i]] = starts[i]
        cx, cy = disc[i, 0], disc[i, 1]
        dx, dy = starts[i, 0] - cx, starts[i, 1] - cy
        size = rho[i] / max(math.sqrt(dx * dx + dy * dy), 1e-300)
        for v in range(1, count[i]):
            cosine, sine = math.cos(v * step[i]), math.sin(v * step[i])
            points[first[i] + v, 0] = cx + size * (dx * cosine - dy * sine)
            points[first[i] + v, 1] = cy + size * (dx * sine + dy * cosine)
        points[first[i] + count[i]] = ends[i]
    return points


@compiled
def _crossing_lines(points, first, cell):
    """Return which lines cross another one, by a hashed grid of their segments."""
    lines = first.size - 1
    owner = np.empty(points.shape[0], np.int64)
    for i in range(lines):
        owner[first[i] : first[i + 1]] = i
    buckets = 1024
    while buckets < points.shape[0]:
        buckets *= 2
    place = np.zeros(buckets + 1, np.int64)
    segments = np.empty(0, np.int64)
    for fill in range(2):
        for p in range(points.shape[0] - 1):
            if owner[p] != owner[p + 1]:
                continue
            x0, x1 = min(points[p, 0], points[p + 1, 0]), max(points[p, 0], points[p + 1, 0])
            y0, y1 = min(points[p, 1], points[p + 1, 1]), max(points[p, 1], points[p + 1, 1])
            for column in range(int(x0 // cell), int(x1 // cell) + 1):
                for row in range(int(y0 // cell), int(y1 // cell) + 1):
                    bucket = ((column * 73856093) ^ (row * 19349663)) & (buckets - 1)
                    if fill == 0:
                        place[bucket + 1] += 1
                    else:
                        segments[place[bucket]] = p
                        place[bucket] += 1
        if fill == 0:
            for b in range(buckets):
                place[b + 1] += place[b]
            segments = np.empty(place[buckets], np.int64)
    crossed = np.zeros(lines, np.bool_)
    begin = 0
    for b in range(buckets):
        for i in range(begin, place[b]):
            for j in range(begin, i):
                p, q = segments[i], segments[j]
                if owner[p] != owner[q] and _cross(points, p, q):
                    crossed[owner[p]] = True
                    crossed[owner[q]] = True
        begin = place[b]
    return crossed


@compiled
def _cross(points, p, q):
    """Return whether two segments cross in a point that is an end of neither."""
    ax, ay, bx, by = points[p, 0], points[p, 1], points[p + 1, 0], points[p + 1, 1]
    cx, cy, dx, dy = points[q, 0], points[q, 1], points[q + 1, 0], points[q + 1, 1]
    if max(ax, bx) < min(cx, dx) or max(cx, dx) < min(ax, bx):
        return False
    if max(ay, by) < min(cy, dy) or max(cy, dy) < min(ay, by):
        return False
    c_side = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    d_side = (bx - ax) * (dy - ay) - (by - ay) * (dx - ax)
    a_side = (dx - cx) * (ay - cy) - (dy - cy) * (ax - cx)
    b_side = (dx - cx) * (by - cy) - (dy - cy) * (bx - cx)
    return c_side * d_side < 0.0 and a_side * b_side < 0.0

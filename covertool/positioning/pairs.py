"""Ranges between two cars that both do not know their place: each corrects the two of them."""

from __future__ import annotations

import math

import numpy as np

from covertool.model import Floats
from covertool.positioning.circle import Spread, excess, moments, shrink
from covertool.positioning.correlations import LANES, Links, look_on, pair_of
from covertool.positioning.ekf import LEAST_VARIANCE_M2
from covertool.positioning.kernel import kernel
from covertool.positioning.mirror import Side, doubt_m2
from covertool.positioning.noise import ANCHOR_BIT, Indices

Square = tuple[float, float, float, float]
"""A covariance of two cars, or a gain: xx, xy, yx, yy."""


@kernel
def pairs_of(count: Indices, neighbour: Indices) -> Indices:
    """Return (pairs, 4): two cars that range, and where each is in the other's list, or -1."""
    out = np.empty((count.sum(), 4), np.int64)
    found = 0
    for i in range(count.size):
        for m in range(count[i]):
            j = neighbour[i, m]
            if j < 0 or j >= ANCHOR_BIT:
                continue
            back = -1
            for k in range(count[j]):
                if neighbour[j, k] == i:
                    back = k
            if back < 0 or i < j:
                out[found, 0], out[found, 1], out[found, 2], out[found, 3] = i, j, m, back
                found += 1
    return out[:found]


@kernel
def _fuse_pair(
    x_i: Floats,
    x_j: Floats,
    p_i: Floats,
    p_j: Floats,
    c: Square,
    measured_m: float,
    r: float,
) -> tuple[Square, Square, Square, float]:
    """Fuse a range between two cars of covariance c, which corrects both.

    Returns c after it, and both gains and the root of doubt for :func:`correlations.look_on`.
    """
    dx, dy = x_i[0] - x_j[0], x_i[1] - x_j[1]
    own = (p_i[0] - c[0], p_i[1] - c[1], p_i[1] - c[2], p_i[2] - c[3])  # cov(x_i, x_i - x_j)
    other = (c[0] - p_j[0], c[2] - p_j[1], c[1] - p_j[1], c[3] - p_j[2])
    before = (own[0] - other[0], own[1] - other[1], own[3] - other[3])
    doubt = excess(dx, dy, before, measured_m, r)
    before = (doubt * before[0], doubt * before[1], doubt * before[2])
    mx, my, xx, xy, yy = moments(dx, dy, before[0], before[1], before[2], measured_m, r)
    w, inverse, widest = shrink(before, (xx, xy, yy))
    if widest > 1.0:  # on either side of each other: less is known than before
        before = (widest * before[0], widest * before[1], widest * before[2])
        doubt *= widest
        w, inverse, _ = shrink(before, (xx, xy, yy))
    own = (doubt * own[0], doubt * own[1], doubt * own[2], doubt * own[3])
    other = (doubt * other[0], doubt * other[1], doubt * other[2], doubt * other[3])
    mx, my = mx - dx, my - dy
    pull = (inverse[0] * mx + inverse[1] * my, inverse[1] * mx + inverse[2] * my)
    g = _correct(x_i, p_i, own, w, pull, doubt)
    h = _correct(x_j, p_j, other, w, pull, doubt)
    c = (
        doubt * c[0] - g[0] * other[0] - g[1] * other[1],
        doubt * c[1] - g[0] * other[2] - g[1] * other[3],
        doubt * c[2] - g[2] * other[0] - g[3] * other[1],
        doubt * c[3] - g[2] * other[2] - g[3] * other[3],
    )
    return c, g, h, math.sqrt(doubt)


@kernel
def _correct(
    x: Floats, p: Floats, own: Square, w: Spread, pull: tuple[float, float], doubt: float
) -> Square:
    """Correct one end of a range by its covariance ``own`` with the difference; its gain."""
    x[0] += own[0] * pull[0] + own[1] * pull[1]
    x[1] += own[2] * pull[0] + own[3] * pull[1]
    g = (
        own[0] * w[0] + own[1] * w[1],
        own[0] * w[1] + own[1] * w[2],
        own[2] * w[0] + own[3] * w[1],
        own[2] * w[1] + own[3] * w[2],
    )
    p[0] = doubt * p[0] - (g[0] * own[0] + g[1] * own[1])
    p[1] = doubt * p[1] - (g[0] * own[2] + g[1] * own[3])
    p[2] = doubt * p[2] - (g[2] * own[2] + g[3] * own[3])
    return g


@kernel
def _doubt_m2(x_i: Floats, x_j: Floats, other_i: Side, other_j: Side) -> float:
    """Return what a range is in doubt by because either car may be on another side."""
    if other_i[0] == 0.0 and other_j[0] == 0.0:
        return 0.0
    dx, dy = x_i[0] - x_j[0], x_i[1] - x_j[1]
    d = max(math.sqrt(dx * dx + dy * dy), 1e-9)
    return doubt_m2(other_i, x_i, dx / d, dy / d) + doubt_m2(other_j, x_j, dx / d, dy / d)


@kernel
def fuse_pairs(
    x: Floats,
    p: Floats,
    other: Floats,
    block: Floats,
    linked: Links,
    seat: Indices,
    pairs: Indices,
    ranges: Floats,
    variance: Floats,
) -> None:
    """Fuse the ranges between cars, one pair after the other, in the runs of one group.

    Two cars that both measure their distance know its mean, weighted by their information. Where
    one of them may be on another side, the range is blurred by that.
    """
    root, gain = np.ones(LANES), np.zeros((2, 4 * LANES))
    for k in range(len(pairs)):
        i, j, there, back = pairs[k, 0], pairs[k, 1], pairs[k, 2], pairs[k, 3]
        c = block[pair_of(seat[i], seat[j])]
        xy, yx = (1, 2) if seat[i] < seat[j] else (2, 1)
        for run in range(len(x)):
            measured_m, r = ranges[run, i, there], max(variance[run, i, there], LEAST_VARIANCE_M2)
            if back >= 0:
                r_back = max(variance[run, j, back], LEAST_VARIANCE_M2)
                measured_m = (measured_m * r_back + ranges[run, j, back] * r) / (r + r_back)
                r = r * r_back / (r + r_back)
            r += _doubt_m2(x[run, i], x[run, j], other[run, seat[i]], other[run, seat[j]])
            common = (c[run], c[xy * LANES + run], c[yx * LANES + run], c[3 * LANES + run])
            common, g, h, root[run] = _fuse_pair(
                x[run, i], x[run, j], p[run, i], p[run, j], common, measured_m, r
            )
            c[run], c[xy * LANES + run] = common[0], common[1]
            c[yx * LANES + run], c[3 * LANES + run] = common[2], common[3]
            for q in range(4):
                gain[0, q * LANES + run], gain[1, q * LANES + run] = g[q], h[q]
        linked[pair_of(seat[i], seat[j])] = 1
        look_on(block, linked, seat, i, j, root, gain)

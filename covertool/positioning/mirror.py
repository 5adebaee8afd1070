"""The other side: where else a car may be while ranges to one kerb leave it open.

Ranges to cars parked in a row are the same on both sides of the row. One normal that covers both
sides forgets how likely each was, and counts the same ranges again and again for the side that it
leans to. A car for which both are open therefore keeps two (Sorenson and Alspach 1971, "Recursive
Bayesian estimation using Gaussian sums"): its likelier place, and the step from there to the other
with the probability of that. The other place has the mirrored covariance.
"""

from __future__ import annotations

import math

from covertool.model import Floats
from covertool.positioning.circle import Spread, expect, moments
from covertool.positioning.kernel import kernel

LEAST_SHARE = 1e-6
"""A side that is less probable than this is given up."""

_NEAR2 = 1.0
"""Square of standard deviations between two sides below which they are one place."""

Side = Floats
"""(3,) where else a car may be: the probability of that, x and y; the first is 0 with no such."""


@kernel
def _mirror(x: Floats, other: Side) -> tuple[float, float]:
    """Return c and s of the mirror ``H = [[c, s], [s, -c]]`` that turns one side to the other."""
    dx, dy = other[1] - x[0], other[2] - x[1]
    length2 = max(dx * dx + dy * dy, 1e-18)
    return (dy * dy - dx * dx) / length2, -2.0 * dx * dy / length2


@kernel
def _mirrored(x: Floats, p: Floats, other: Side) -> Spread:
    """Return the covariance on the other side, ``H P H``."""
    c, s = _mirror(x, other)
    return (
        c * c * p[0] + 2.0 * c * s * p[1] + s * s * p[2],
        c * s * (p[0] - p[2]) + (s * s - c * c) * p[1],
        s * s * p[0] - 2.0 * c * s * p[1] + c * c * p[2],
    )


@kernel
def _judge(x: Floats, p: Floats, a: Floats, other: Side, log_ratio: float) -> None:
    """Weigh the other side by its likelihood over that of this one, and change over if it wins.

    What correlations with other cars go by, ``a``, changes over by the mirror too, so that all of
    it stays a covariance.
    """
    odds = other[0] / (1.0 - other[0]) * math.exp(min(max(log_ratio, -50.0), 50.0))
    other[0] = odds / (1.0 + odds)
    if other[0] <= 0.5:
        return
    c, s = _mirror(x, other)
    p[0], p[1], p[2] = _mirrored(x, p, other)
    for k in range(2):
        a[0, k], a[1, k] = c * a[0, k] + s * a[1, k], s * a[0, k] - c * a[1, k]
    x[0], x[1], other[1], other[2] = other[1], other[2], x[0], x[1]
    other[0] = 1.0 - other[0]


@kernel
def weigh_gps(x: Floats, p: Floats, a: Floats, other: Side, gps: Floats, r: float) -> None:
    """Weigh both sides by a fix and correct the other one; this one waits for its own turn."""
    xx, xy, yy = _mirrored(x, p, other)
    dx, dy = gps[0] - x[0], gps[1] - x[1]
    ox, oy = gps[0] - other[1], gps[1] - other[2]
    determinant = (xx + r) * (yy + r) - xy * xy  # the same on both sides
    here = (p[2] + r) * dx * dx - 2.0 * p[1] * dx * dy + (p[0] + r) * dy * dy
    there = (yy + r) * ox * ox - 2.0 * xy * ox * oy + (xx + r) * oy * oy
    _judge(x, p, a, other, 0.5 * (here - there) / determinant)
    xx, xy, yy = _mirrored(x, p, other)
    ox, oy = gps[0] - other[1], gps[1] - other[2]
    wx = ((yy + r) * ox - xy * oy) / determinant
    wy = ((xx + r) * oy - xy * ox) / determinant
    other[1], other[2] = other[1] + xx * wx + xy * wy, other[2] + xy * wx + yy * wy


@kernel
def weigh_range(
    x: Floats, p: Floats, a: Floats, other: Side, place: Spread, measured_m: float, r: float
) -> None:
    """Weigh both sides by a range and correct the other one; this one waits for its own turn."""
    own_m2 = place[2]
    xx, xy, yy = _mirrored(x, p, other)
    _, _, here, here_m2 = expect(
        x[0] - place[0], x[1] - place[1], p[0] + own_m2, p[1], p[2] + own_m2
    )
    _, _, there, there_m2 = expect(
        other[1] - place[0], other[2] - place[1], xx + own_m2, xy, yy + own_m2
    )
    here_m2, there_m2 = here_m2 + r, there_m2 + r
    ratio = (measured_m - here) ** 2 / here_m2 - (measured_m - there) ** 2 / there_m2
    _judge(x, p, a, other, 0.5 * (ratio + math.log(here_m2 / there_m2)))
    xx, xy, yy = _mirrored(x, p, other)
    dx, dy = other[1] - place[0], other[2] - place[1]
    found = moments(dx, dy, xx + own_m2, xy, yy + own_m2, measured_m, r)
    other[1], other[2] = place[0] + found[0], place[1] + found[1]


@kernel
def settle(x: Floats, p: Floats, other: Side) -> None:
    """Give up the other side where it is improbable, and make one place of two near ones."""
    if other[0] == 0.0:
        return
    dx, dy = other[1] - x[0], other[2] - x[1]
    determinant = max(p[0] * p[2] - p[1] * p[1], 1e-18)
    apart2 = (p[2] * dx * dx - 2.0 * p[1] * dx * dy + p[0] * dy * dy) / determinant
    if other[0] < LEAST_SHARE:
        other[0] = 0.0
    elif apart2 < _NEAR2:
        join(x, p, other)
        other[0] = 0.0


@kernel
def join(x: Floats, p: Floats, other: Side) -> None:
    """Replace the likelier place by mean and covariance of both; ``other`` becomes the step."""
    share, dx, dy = other[0], other[1] - x[0], other[2] - x[1]
    between = share * (1.0 - share)
    x[0], x[1] = x[0] + share * dx, x[1] + share * dy
    p[0], p[1], p[2] = p[0] + between * dx * dx, p[1] + between * dx * dy, p[2] + between * dy * dy
    other[1], other[2] = dx, dy


@kernel
def part(x: Floats, p: Floats, other: Side) -> None:
    """Undo :func:`join`."""
    share, dx, dy = other[0], other[1], other[2]
    between = share * (1.0 - share)
    x[0], x[1] = x[0] - share * dx, x[1] - share * dy
    p[0], p[1], p[2] = p[0] - between * dx * dx, p[1] - between * dx * dy, p[2] - between * dy * dy
    other[1], other[2] = x[0] + dx, x[1] + dy


@kernel
def doubt_m2(other: Side, x: Floats, ux: float, uy: float) -> float:
    """Return the variance along a line of sight that the other side adds."""
    along: float = ux * (other[1] - x[0]) + uy * (other[2] - x[1])
    share: float = other[0]
    return share * (1.0 - share) * along * along

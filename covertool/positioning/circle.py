"""What a range tells of a difference of places, where its circle is straight and where it bends."""

from __future__ import annotations

import math

import numpy as np

from covertool.model import Floats
from covertool.positioning.kernel import kernel

Spread = tuple[float, float, float]
"""A covariance: xx, xy, yy."""

Moments = tuple[float, float, float, float, float, float]
"""A weight, a mean and a covariance: weight, x, y, xx, xy, yy."""

_CURVED = 0.25**2
"""Square of spread across over distance beyond which the circle is summed around."""
_BENDS = (2.0 * 0.1) ** 2
"""Square of twice the way that a circle may bend off its tangent, in standard deviations."""
_SHARP = 3.0**2
"""Square of range over its noise below which the circle is too blurred for that."""
_SURPRISE = 3.0**2
"""A range beyond three standard deviations says that a car has settled on the wrong side of a
neighbour: it then doubts itself until the range lies at three."""
_RAYS = 128
_RESOLVED = (2.0 * 2.0 * np.pi / _RAYS) ** 2
"""Square of spread across over distance below which it would fall between the rays."""
_SECTOR = (2.0 * np.pi / _RAYS) ** 2 / 12.0
_ANGLE = np.arange(_RAYS) * (2.0 * np.pi / _RAYS)
_RAY = np.stack([np.cos(_ANGLE), np.sin(_ANGLE)], axis=1)


@kernel
def expect(
    dx: float, dy: float, xx: float, xy: float, yy: float
) -> tuple[float, float, float, float]:
    """Return unit vector, mean and variance of a distance, expanded to the second order.

    With s the variance across the line of sight the mean is ``E = sqrt(d^2 + s)``, which is
    ``d + s / 2d`` to the second order and stays finite at d = 0; the curvature adds the variance
    ``(s / E)^2 / 2``.
    """
    d = max(math.sqrt(dx * dx + dy * dy), 1e-9)
    ux, uy = dx / d, dy / d
    across = max(uy * uy * xx - 2.0 * ux * uy * xy + ux * ux * yy, 0.0)
    expected = math.sqrt(d * d + across)
    along = ux * ux * xx + 2.0 * ux * uy * xy + uy * uy * yy
    return ux, uy, expected, along + 0.5 * (across / expected) ** 2


@kernel
def excess(dx: float, dy: float, before: Spread, measured_m: float, r: float) -> float:
    """Return the factor by which a covariance must grow so that a range is no surprise."""
    _, _, expected, variance = expect(dx, dy, before[0], before[1], before[2])
    needed = (measured_m - expected) ** 2 / _SURPRISE - r
    return max(needed / max(variance, 1e-8), 1.0)


@kernel
def _expanded(
    dx: float, dy: float, xx: float, xy: float, yy: float, measured_m: float, r: float
) -> tuple[float, float, float, float, float]:
    """Return mean and covariance of a difference after a range, by the expansion."""
    ux, uy, expected, variance = expect(dx, dy, xx, xy, yy)
    s = variance + r
    gx, gy = xx * ux + xy * uy, xy * ux + yy * uy
    miss = (measured_m - expected) / s
    return dx + gx * miss, dy + gy * miss, xx - gx * gx / s, xy - gx * gy / s, yy - gy * gy / s


@kernel
def _rays(
    dx: float, dy: float, xx: float, xy: float, yy: float, measured_m: float, r: float
) -> Floats:
    """Return (3, rays): weight, mean distance and mean square of it on each ray from a neighbour.

    On a ray the prior is a normal of the distance; times the range's normal it is one again, with
    a known weight.
    """
    determinant = xx * yy - xy * xy
    ixx, ixy, iyy = yy / determinant, -xy / determinant, xx / determinant
    hx, hy = ixx * dx + ixy * dy, ixy * dx + iyy * dy
    whole = hx * dx + hy * dy
    out = np.zeros((3, _RAYS))
    level, most = np.empty(_RAYS), -1e300
    for k in range(_RAYS):
        cosine, sine = _RAY[k, 0], _RAY[k, 1]
        q = ixx * cosine * cosine + 2.0 * ixy * cosine * sine + iyy * sine * sine
        prior = (hx * cosine + hy * sine) / q
        miss = measured_m - prior
        level[k] = 0.5 * (q * prior * prior - whole - miss * miss / (r + 1.0 / q))
        distance = (prior * q + measured_m / r) / (q + 1.0 / r)
        if distance > 0.0:
            out[0, k] = distance / math.sqrt(1.0 + q * r)
            out[1, k], out[2, k] = distance, distance * distance + 1.0 / (q + 1.0 / r)
            most = max(most, level[k])
    for k in range(_RAYS):
        if out[0, k] > 0.0:
            out[0, k] *= math.exp(level[k] - most)
    return out


@kernel
def _sum(rays: Floats, first: int, size: int) -> Moments:
    """Return weight, mean and covariance of what lies on ``size`` rays from the first one on."""
    total = mx = my = mxx = mxy = myy = 0.0
    for step in range(first, first + size):
        k = step % _RAYS
        cosine, sine = _RAY[k, 0], _RAY[k, 1]
        weight, distance, square = rays[0, k], rays[1, k], rays[2, k]
        total += weight
        mx += weight * distance * cosine
        my += weight * distance * sine
        across = _SECTOR * distance * distance  # variance within the sector of the ray
        mxx += weight * (square * cosine * cosine + across * sine * sine)
        mxy += weight * (square - across) * cosine * sine
        myy += weight * (square * sine * sine + across * cosine * cosine)
    if total == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    mx, my = mx / total, my / total
    return total, mx, my, mxx / total - mx * mx, mxy / total - mx * my, myy / total - my * my


@kernel
def _valley(weight: Floats, top: int, way: int) -> int:
    """Return how many rays from a top, one way or the other, the weights fall."""
    steps = 0
    while steps < _RAYS - 1:
        here, there = (top + way * steps) % _RAYS, (top + way * (steps + 1)) % _RAYS
        if weight[there] > weight[here]:
            break
        steps += 1
    return steps


@kernel
def two_sides(
    dx: float, dy: float, xx: float, xy: float, yy: float, measured_m: float, r: float
) -> tuple[Moments, Moments]:
    """Return the two places on a circle where a car may be, the likelier one first.

    Each is its share, mean and covariance. With no second place its share is 0: there is none
    where the weights around the circle have a single top.
    """
    nothing = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    if not _bent(dx, dy, xx, xy, yy, measured_m, r):
        return nothing, nothing
    rays = _rays(dx, dy, xx, xy, yy, measured_m, r)
    weight = rays[0]
    top = int(np.argmax(weight))
    left, right = _valley(weight, top, -1), _valley(weight, top, 1)
    size = left + right + 1
    one = _sum(rays, top - left + _RAYS, size)
    other = _sum(rays, top + right + 1, max(_RAYS - size, 0))
    second = 0.0
    for step in range(top + right + 1, top - left + _RAYS):
        second = max(second, weight[step % _RAYS])
    ground = max(weight[(top - left) % _RAYS], weight[(top + right) % _RAYS])
    if other[0] <= 0.0 or second <= ground:
        return nothing, nothing
    if other[0] > one[0]:
        one, other = other, one
    share = other[0] / (one[0] + other[0])
    return (1.0 - share, *one[1:]), (share, *other[1:])


@kernel
def _around(
    dx: float, dy: float, xx: float, xy: float, yy: float, measured_m: float, r: float
) -> tuple[float, float, float, float, float]:
    """Return mean and covariance of a difference after a range, summed around its circle.

    The sum over rays sees both sides of a neighbour, so that a car that may be on either does not
    settle on the wrong one.
    """
    found = _sum(_rays(dx, dy, xx, xy, yy, measured_m, r), 0, _RAYS)
    if found[0] == 0.0:
        return _expanded(dx, dy, xx, xy, yy, measured_m, r)
    return found[1], found[2], found[3], found[4], found[5]


@kernel
def _bent(
    dx: float, dy: float, xx: float, xy: float, yy: float, measured_m: float, r: float
) -> bool:
    """Return whether the circle is far from straight over the spread across the line of sight.

    That is by its angle, or by how far it bends away from its tangent, as long as that is not
    blurred by what the range and the spread along the line of sight leave open.
    """
    d2 = max(dx * dx + dy * dy, 1e-18)
    across = (dy * dy * xx - 2.0 * dx * dy * xy + dx * dx * yy) / d2
    along = xx + yy - across
    sharp = measured_m > 0.0 and measured_m * measured_m > _SHARP * r
    bends = across > _RESOLVED * d2 and across * across > _BENDS * d2 * (along + r)
    bends = bends or across > _CURVED * d2
    return sharp and bends and xx * yy - xy * xy > 1e-12


@kernel
def moments(
    dx: float, dy: float, xx: float, xy: float, yy: float, measured_m: float, r: float
) -> tuple[float, float, float, float, float]:
    """Return mean and covariance of a difference after a range of variance r.

    The expansion serves where the circle is nearly straight over the spread across the line of
    sight, or blurred by its own noise; else the sum around the circle.
    """
    if _bent(dx, dy, xx, xy, yy, measured_m, r):
        return _around(dx, dy, xx, xy, yy, measured_m, r)
    return _expanded(dx, dy, xx, xy, yy, measured_m, r)


@kernel
def shrink(before: Spread, after: Spread) -> tuple[Spread, Spread, float]:
    """Return ``W = S^-1 (S - S+) S^-1`` and ``S^-1``, both 2 by 2, for S before and S+ after.

    With ``S = L L'`` the shares that stay, the eigenvalues of ``L^-1 S+ L^-T``, are kept between
    0 and 1, so that the joint covariance stays one. The largest, before that, comes third.
    """
    l_xx = math.sqrt(max(before[0], 1e-18))
    l_yx = before[1] / l_xx
    l_yy = math.sqrt(max(before[2] - l_yx * l_yx, 1e-12 * before[2], 1e-18))
    i_xx, i_yy = 1.0 / l_xx, 1.0 / l_yy
    i_yx = -l_yx * i_xx * i_yy
    a = i_xx * i_xx * after[0]
    b = i_xx * (i_yx * after[0] + i_yy * after[1])
    c = i_yx * i_yx * after[0] + 2.0 * i_yx * i_yy * after[1] + i_yy * i_yy * after[2]
    middle, half = 0.5 * (a + c), math.sqrt(0.25 * (a - c) * (a - c) + b * b)
    if middle + half <= 1.0 and middle - half >= 0.0:
        a, b, c = 1.0 - a, -b, 1.0 - c
    else:
        angle = 0.5 * math.atan2(2.0 * b, a - c)
        cosine, sine = math.cos(angle), math.sin(angle)
        first = 1.0 - min(max(middle + half, 0.0), 1.0)
        second = 1.0 - min(max(middle - half, 0.0), 1.0)
        a = first * cosine * cosine + second * sine * sine
        b = (first - second) * cosine * sine
        c = first * sine * sine + second * cosine * cosine
    w_xx = i_xx * i_xx * a + 2.0 * i_xx * i_yx * b + i_yx * i_yx * c
    w_xy = i_yy * (i_xx * b + i_yx * c)
    inverse = (i_xx * i_xx + i_yx * i_yx, i_yx * i_yy, i_yy * i_yy)
    return (w_xx, w_xy, i_yy * i_yy * c), inverse, middle + half

"""A distributed second-order filter that uses all information and remembers who shared it.

Each car fuses GPS, odometry and every range. Cars that range to each other become correlated;
a filter that forgets this counts the same information again and again and grows overconfident.
Here each car keeps its correlation with the others, and a range updates the two cars at its ends
(Schmidt 1966: the others are considered, not updated). Ranges are expanded to the second order
(Athans, Wishner and Bertolini 1968), since a near neighbour's circle is far from straight.
"""

from __future__ import annotations

import math

import numpy as np

from covertool.errors import OptionError
from covertool.model import Floats
from covertool.positioning.estimators import Measurements, State, isotropic
from covertool.positioning.kernel import kernel
from covertool.positioning.linear import DIFFUSE_M2, carry_on
from covertool.positioning.noise import ANCHOR_BIT, Indices

MOST_CARS = 2000
"""Cars in a trace whose correlations fit into memory (128 MB a run)."""

_LEAST_VARIANCE_M2 = 1e-8
_CURVED = 0.25**2
"""Square of spread across over distance beyond which the circle is summed around."""
_SHARP = 3.0**2
_SURPRISE = 3.0**2
_RAYS = 128
_SECTOR = (2.0 * np.pi / _RAYS) ** 2 / 12.0
_ANGLE = np.arange(_RAYS) * (2.0 * np.pi / _RAYS)
_RAY = np.stack([np.cos(_ANGLE), np.sin(_ANGLE)], axis=1)

Spread = tuple[float, float, float]


@kernel
def _expect(
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
def _expanded(
    dx: float, dy: float, xx: float, xy: float, yy: float, measured_m: float, r: float
) -> tuple[float, float, float, float, float]:
    """Return mean and covariance of a difference after a range, by the expansion."""
    ux, uy, expected, variance = _expect(dx, dy, xx, xy, yy)
    s = variance + r
    gx, gy = xx * ux + xy * uy, xy * ux + yy * uy
    miss = (measured_m - expected) / s
    return dx + gx * miss, dy + gy * miss, xx - gx * gx / s, xy - gx * gy / s, yy - gy * gy / s


@kernel
def _doubt(i: int, j: int, p: Floats, cross: Floats, car: Indices, factor: float) -> None:
    """Let the covariance of car i, and of car j unless it is -1, grow by a factor."""
    root = math.sqrt(factor)
    for a in (i, j):
        if a >= 0:
            for c in range(3):
                p[a, c] *= factor
            for k in range(car.size):
                if k != a:
                    for row in range(2):
                        for column in range(2):
                            cross[car[a], car[k], row, column] *= root
                            cross[car[k], car[a], column, row] *= root


@kernel
def _around(
    dx: float, dy: float, xx: float, xy: float, yy: float, measured_m: float, r: float
) -> tuple[float, float, float, float, float]:
    """Return mean and covariance of a difference after a range, summed around its circle.

    On each ray from the neighbour the prior is a normal of the distance; times the range's normal
    it is one again, with a known weight. The sum over rays sees both sides of a neighbour, so that
    a car that may be on either does not settle on the wrong one.
    """
    determinant = xx * yy - xy * xy
    ixx, ixy, iyy = yy / determinant, -xy / determinant, xx / determinant
    hx, hy = ixx * dx + ixy * dy, ixy * dx + iyy * dy
    whole = hx * dx + hy * dy
    most, total = -1e300, 0.0
    mx = my = mxx = mxy = myy = 0.0
    for k in range(_RAYS):
        cosine, sine = _RAY[k, 0], _RAY[k, 1]
        q = ixx * cosine * cosine + 2.0 * ixy * cosine * sine + iyy * sine * sine
        prior = (hx * cosine + hy * sine) / q
        miss = measured_m - prior
        level = 0.5 * (q * prior * prior - whole - miss * miss / (r + 1.0 / q))
        distance = (prior * q + measured_m / r) / (q + 1.0 / r)
        if distance <= 0.0:
            continue
        if level > most:
            fade = math.exp(most - level)
            total, mx, my = total * fade, mx * fade, my * fade
            mxx, mxy, myy = mxx * fade, mxy * fade, myy * fade
            most = level
        weight = math.exp(level - most) * distance / math.sqrt(1.0 + q * r)
        square = distance * distance + 1.0 / (q + 1.0 / r)
        total += weight
        mx += weight * distance * cosine
        my += weight * distance * sine
        across = _SECTOR * distance * distance  # variance within the sector of the ray
        mxx += weight * (square * cosine * cosine + across * sine * sine)
        mxy += weight * (square - across) * cosine * sine
        myy += weight * (square * sine * sine + across * cosine * cosine)
    if total == 0.0:
        return _expanded(dx, dy, xx, xy, yy, measured_m, r)
    mx, my = mx / total, my / total
    return mx, my, mxx / total - mx * mx, mxy / total - mx * my, myy / total - my * my


@kernel
def _moments(
    dx: float, dy: float, xx: float, xy: float, yy: float, measured_m: float, r: float
) -> tuple[float, float, float, float, float]:
    """Return mean and covariance of a difference after a range of variance r.

    The expansion serves where the circle is nearly straight over the spread across the line of
    sight, or blurred by its own noise; else the sum around the circle.
    """
    d2 = dx * dx + dy * dy
    across = (dy * dy * xx - 2.0 * dx * dy * xy + dx * dx * yy) / max(d2, 1e-18)
    sharp = measured_m > 0.0 and measured_m * measured_m > _SHARP * r
    if sharp and across > _CURVED * max(d2, 1e-18) and xx * yy - xy * xy > 1e-12:
        return _around(dx, dy, xx, xy, yy, measured_m, r)
    return _expanded(dx, dy, xx, xy, yy, measured_m, r)


@kernel
def _fuse_gps(
    i: int, x: Floats, p: Floats, cross: Floats, car: Indices, gps: Floats, r: float
) -> None:
    """Correct car i by its fix; what the others know of it shrinks alike."""
    xx, xy, yy = p[i, 0], p[i, 1], p[i, 2]
    determinant = (xx + r) * (yy + r) - xy * xy
    a_xx, a_yy, a_xy = r * (yy + r) / determinant, r * (xx + r) / determinant, -r * xy / determinant
    dx, dy = gps[0] - x[i, 0], gps[1] - x[i, 1]
    x[i, 0] += (1.0 - a_xx) * dx - a_xy * dy
    x[i, 1] += (1.0 - a_yy) * dy - a_xy * dx
    # P+ = A P with A = r (P + r I)^-1
    p[i, 0] = a_xx * xx + a_xy * xy
    p[i, 1] = a_xx * xy + a_xy * yy
    p[i, 2] = a_xy * xy + a_yy * yy
    for k in range(car.size):
        if k != i:
            own, mirror = cross[car[i], car[k]], cross[car[k], car[i]]
            for c in range(2):
                first, second = own[0, c], own[1, c]
                own[0, c] = a_xx * first + a_xy * second
                own[1, c] = a_xy * first + a_yy * second
                mirror[c, 0], mirror[c, 1] = own[0, c], own[1, c]


@kernel
def _shrink(before: Spread, after: Spread) -> tuple[Spread, Spread, float]:
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
    angle = 0.5 * math.atan2(2.0 * b, a - c)
    cosine, sine = math.cos(angle), math.sin(angle)
    middle, half = 0.5 * (a + c), math.sqrt(0.25 * (a - c) * (a - c) + b * b)
    first = 1.0 - min(max(middle + half, 0.0), 1.0)
    second = 1.0 - min(max(middle - half, 0.0), 1.0)
    a = first * cosine * cosine + second * sine * sine
    b = (first - second) * cosine * sine
    c = first * sine * sine + second * cosine * cosine
    w_xx = i_xx * i_xx * a + 2.0 * i_xx * i_yx * b + i_yx * i_yx * c
    w_xy = i_yy * (i_xx * b + i_yx * c)
    inverse = (i_xx * i_xx + i_yx * i_yx, i_yx * i_yy, i_yy * i_yy)
    return (w_xx, w_xy, i_yy * i_yy * c), inverse, middle + half


@kernel
def _correct(
    i: int,
    j: int,
    x: Floats,
    p: Floats,
    cross: Floats,
    car: Indices,
    own: Floats,
    other: Floats,
    w: Spread,
    pull: tuple[float, float],
) -> None:
    """Correct car i, and car j unless it is -1, whose covariances with the difference are given.

    ``own`` and ``other`` are 2 by 2: cov(x_i, z) and cov(x_j, z) for the difference z. A
    covariance of anything with anything falls by ``cov(a, z) W cov(z, b)``, except between two
    cars that only look on: they are considered, not updated.
    """
    wxx, wxy, wyy = w
    for k in range(car.size):
        if k in (i, j):
            continue
        seen = np.empty((2, 2))  # cov(z, x_k)
        for a in range(2):
            for b in range(2):
                seen[a, b] = cross[car[i], car[k], a, b]
                if j >= 0:
                    seen[a, b] -= cross[car[j], car[k], a, b]
        for b in range(2):
            tx = wxx * seen[0, b] + wxy * seen[1, b]
            ty = wxy * seen[0, b] + wyy * seen[1, b]
            for a in range(2):
                cross[car[i], car[k], a, b] -= own[a, 0] * tx + own[a, 1] * ty
                cross[car[k], car[i], b, a] = cross[car[i], car[k], a, b]
                if j >= 0:
                    cross[car[j], car[k], a, b] -= other[a, 0] * tx + other[a, 1] * ty
                    cross[car[k], car[j], b, a] = cross[car[j], car[k], a, b]
    for a in range(2):
        x[i, a] += own[a, 0] * pull[0] + own[a, 1] * pull[1]
        if j >= 0:
            x[j, a] += other[a, 0] * pull[0] + other[a, 1] * pull[1]
            tx, ty = own[a, 0] * wxx + own[a, 1] * wxy, own[a, 0] * wxy + own[a, 1] * wyy
            for b in range(2):
                cross[car[i], car[j], a, b] -= tx * other[b, 0] + ty * other[b, 1]
                cross[car[j], car[i], b, a] = cross[car[i], car[j], a, b]
    _reduce(p[i], own, w)
    if j >= 0:
        _reduce(p[j], other, w)


@kernel
def _reduce(p: Floats, g: Floats, w: Spread) -> None:
    tx0, ty0 = g[0, 0] * w[0] + g[0, 1] * w[1], g[0, 0] * w[1] + g[0, 1] * w[2]
    tx1, ty1 = g[1, 0] * w[0] + g[1, 1] * w[1], g[1, 0] * w[1] + g[1, 1] * w[2]
    p[0] -= tx0 * g[0, 0] + ty0 * g[0, 1]
    p[1] -= tx0 * g[1, 0] + ty0 * g[1, 1]
    p[2] -= tx1 * g[1, 0] + ty1 * g[1, 1]


@kernel
def _difference(
    i: int,
    j: int,
    x: Floats,
    p: Floats,
    cross: Floats,
    car: Indices,
    place: tuple[float, float, float],
) -> tuple[float, float, Spread, Floats, Floats]:
    """Return mean and covariance of a difference, and its covariance with both cars."""
    own, other = np.zeros((2, 2)), np.zeros((2, 2))
    own[0, 0], own[0, 1], own[1, 0], own[1, 1] = p[i, 0], p[i, 1], p[i, 1], p[i, 2]
    if j >= 0:
        c = cross[car[i], car[j]]
        other[0, 0], other[0, 1] = c[0, 0] - p[j, 0], c[1, 0] - p[j, 1]
        other[1, 0], other[1, 1] = c[0, 1] - p[j, 1], c[1, 1] - p[j, 2]
        own -= c
        dx, dy = x[i, 0] - x[j, 0], x[i, 1] - x[j, 1]
        before = (own[0, 0] - other[0, 0], own[0, 1] - other[0, 1], own[1, 1] - other[1, 1])
    else:
        dx, dy = x[i, 0] - place[0], x[i, 1] - place[1]
        before = (own[0, 0] + place[2], own[0, 1], own[1, 1] + place[2])
    return dx, dy, before, own, other


@kernel
def _fuse_range(
    i: int,
    j: int,
    x: Floats,
    p: Floats,
    cross: Floats,
    car: Indices,
    place: tuple[float, float, float],
    measured_m: float,
    r: float,
) -> None:
    """Fuse a range from car i to car j, or to an anchor (j = -1) at a place with a variance.

    A range beyond three standard deviations says that a car has settled on the wrong side of a
    neighbour: both then doubt themselves until it lies at three.
    """
    dx, dy, before, own, other = _difference(i, j, x, p, cross, car, place)
    _, _, expected, variance = _expect(dx, dy, before[0], before[1], before[2])
    excess = (measured_m - expected) ** 2 / _SURPRISE - r
    if excess > variance:
        _doubt(i, j, p, cross, car, excess / max(variance, _LEAST_VARIANCE_M2))
        dx, dy, before, own, other = _difference(i, j, x, p, cross, car, place)
    mx, my, xx, xy, yy = _moments(dx, dy, before[0], before[1], before[2], measured_m, r)
    w, inverse, widest = _shrink(before, (xx, xy, yy))
    if widest > 1.0:  # on either side of the neighbour: less is known than before
        _doubt(i, j, p, cross, car, widest)
        _, _, before, own, other = _difference(i, j, x, p, cross, car, place)
        w, inverse, _ = _shrink(before, (xx, xy, yy))
    mx, my = mx - dx, my - dy
    pull = (inverse[0] * mx + inverse[1] * my, inverse[1] * mx + inverse[2] * my)
    _correct(i, j, x, p, cross, car, own, other, w, pull)


@kernel
def _update(
    x: Floats,
    p: Floats,
    cross: Floats,
    car: Indices,
    gps: Floats,
    gps_m2: float,
    count: Indices,
    neighbour: Indices,
    ranges: Floats,
    variance: Floats,
    place_x: Floats,
    place_y: Floats,
    shared: Floats,
) -> None:
    """Correct all cars of one run in place: GPS, then anchors, then pairs of cars."""
    n = car.size
    for i in range(n):
        _fuse_gps(i, x, p, cross, car, gps[i], max(gps_m2, _LEAST_VARIANCE_M2))
    for i in range(n):
        for m in range(count[i]):
            if neighbour[i, m] >= ANCHOR_BIT:
                r = max(variance[i, m], _LEAST_VARIANCE_M2)
                place = (place_x[i, m], place_y[i, m], shared[i, m, 0])
                _fuse_range(i, -1, x, p, cross, car, place, ranges[i, m], r)
    for i in range(n):
        for m in range(count[i]):
            j = neighbour[i, m]
            if 0 <= j < ANCHOR_BIT:
                r = max(variance[i, m], _LEAST_VARIANCE_M2)
                _fuse_range(i, j, x, p, cross, car, (0.0, 0.0, 0.0), ranges[i, m], r)


class SecondOrder:
    """The ``best`` preset: GPS, v(t) and all ranges, with the correlations between the cars.

    Parameters
    ----------
    cars : int
        Cars in the trace.
    sigma_velocity : float
        Noise of the measured velocity per axis in m/s.
    """

    name = "second_order"
    uses_gps = True
    gives_covariance = True

    def __init__(self, cars: int, sigma_velocity: float = 0.5) -> None:
        if cars > MOST_CARS:
            raise OptionError(
                f"the second-order filter keeps the correlations of {MOST_CARS} cars at most",
                f"a trace of {cars} cars",
                "cut the trace, or use the estimators ekf or gcpso",
            )
        self.sigma_velocity = sigma_velocity
        self._cars = cars
        self._cross = np.zeros((0, cars, cars, 2, 2))

    def start(self, gps: Floats, variance_m2: float) -> State:
        """Return a place of which nothing is known: the first update takes the fix."""
        return State(gps.copy(), isotropic(len(gps), DIFFUSE_M2))

    def predict(self, state: State, velocity: Floats, step_s: float) -> State:
        """Return the state carried on; correlations between cars stay as they are."""
        return carry_on(state, velocity, step_s, (self.sigma_velocity * step_s) ** 2)

    def update(self, predicted: State, heard: Measurements) -> State:
        """Return the state after all measurements of the step."""
        n = heard.car.size
        if len(self._cross) != heard.runs:
            self._cross = np.zeros((heard.runs, self._cars, self._cars, 2, 2))
        x, p = predicted.position.copy(), predicted.covariance.copy()
        unknown = p[:n, 0] >= DIFFUSE_M2
        for run in range(heard.runs):
            rows, cross = slice(run * n, (run + 1) * n), self._cross[run]
            cross[heard.car[unknown]] = 0.0
            cross[:, heard.car[unknown]] = 0.0
            _update(
                x[rows],
                p[rows],
                cross,
                heard.car,
                heard.gps[rows],
                heard.gps_variance_m2,
                heard.count[rows],
                heard.neighbour[rows],
                heard.range_m[rows],
                heard.range_variance_m2[rows],
                heard.x[rows],
                heard.y[rows],
                heard.shared[rows],
            )
        return State(x, p)

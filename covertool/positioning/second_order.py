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
from covertool.positioning.circle import Spread, expect, moments, shrink
from covertool.positioning.estimators import Measurements, State, isotropic
from covertool.positioning.kernel import kernel
from covertool.positioning.linear import DIFFUSE_M2, carry_on
from covertool.positioning.noise import ANCHOR_BIT, Indices

MOST_CARS = 2000
"""Cars in a trace whose correlations fit into memory (128 MB a run)."""

_LEAST_VARIANCE_M2 = 1e-8
_SURPRISE = 3.0**2
"""A range beyond three standard deviations says that a car has settled on the wrong side of a
neighbour: it then doubts itself until the range lies at three."""


@kernel
def _excess(dx: float, dy: float, before: Spread, measured_m: float, r: float) -> float:
    """Return the factor by which a covariance must grow so that a range is no surprise."""
    _, _, expected, variance = expect(dx, dy, before[0], before[1], before[2])
    needed = (measured_m - expected) ** 2 / _SURPRISE - r
    return max(needed / max(variance, _LEAST_VARIANCE_M2), 1.0)


@kernel
def _correct_alone(x: Floats, p: Floats, a: Floats, w: Spread, pull: tuple[float, float]) -> None:
    """Correct one car by ``P W P`` and ``P pull``; ``a`` gathers what its correlations go by."""
    x[0] += p[0] * pull[0] + p[1] * pull[1]
    x[1] += p[1] * pull[0] + p[2] * pull[1]
    k_xx, k_xy = p[0] * w[0] + p[1] * w[1], p[0] * w[1] + p[1] * w[2]
    k_yx, k_yy = p[1] * w[0] + p[2] * w[1], p[1] * w[1] + p[2] * w[2]
    for c in range(2):
        first, second = a[0, c], a[1, c]
        a[0, c] -= k_xx * first + k_xy * second
        a[1, c] -= k_yx * first + k_yy * second
    xx, xy, yy = p[0], p[1], p[2]
    p[0] -= k_xx * xx + k_xy * xy
    p[1] -= k_xx * xy + k_xy * yy
    p[2] -= k_yx * xy + k_yy * yy


@kernel
def _fuse_gps(x: Floats, p: Floats, a: Floats, gps: Floats, r: float) -> None:
    xx, xy, yy = p[0] + r, p[1], p[2] + r
    determinant = xx * yy - xy * xy
    w = (yy / determinant, -xy / determinant, xx / determinant)
    dx, dy = gps[0] - x[0], gps[1] - x[1]
    _correct_alone(x, p, a, w, (w[0] * dx + w[1] * dy, w[1] * dx + w[2] * dy))


@kernel
def _fuse_anchor(
    x: Floats, p: Floats, a: Floats, place: Spread, measured_m: float, r: float
) -> None:
    """Fuse a range to an anchor at ``place``: x, y, and variance along each axis."""
    dx, dy, own_m2 = x[0] - place[0], x[1] - place[1], place[2]
    _doubt_alone(p, a, _excess(dx, dy, (p[0] + own_m2, p[1], p[2] + own_m2), measured_m, r))
    before = (p[0] + own_m2, p[1], p[2] + own_m2)
    mx, my, xx, xy, yy = moments(dx, dy, before[0], before[1], before[2], measured_m, r)
    w, inverse, widest = shrink(before, (xx, xy, yy))
    if widest > 1.0:  # on either side of the anchor: less is known than before
        _doubt_alone(p, a, widest)
        w, inverse, _ = shrink((p[0] + own_m2, p[1], p[2] + own_m2), (xx, xy, yy))
    mx, my = mx - dx, my - dy
    pull = (inverse[0] * mx + inverse[1] * my, inverse[1] * mx + inverse[2] * my)
    _correct_alone(x, p, a, w, pull)


@kernel
def _doubt_alone(p: Floats, a: Floats, factor: float) -> None:
    p *= factor
    a *= math.sqrt(factor)


@kernel
def _linked(c: Floats) -> bool:
    """Return whether two cars are correlated at all; most never met."""
    return bool(c[0, 0] != 0.0 or c[0, 1] != 0.0 or c[1, 0] != 0.0 or c[1, 1] != 0.0)


@kernel
def _pass_on(i: int, a: Floats, cross: Floats, car: Indices) -> None:
    """Multiply the correlations of car i with the others by ``a``."""
    for k in range(car.size):
        own, mirror = cross[car[i], car[k]], cross[car[k], car[i]]
        if k != i and _linked(own):
            for c in range(2):
                first, second = own[0, c], own[1, c]
                own[0, c] = a[0, 0] * first + a[0, 1] * second
                own[1, c] = a[1, 0] * first + a[1, 1] * second
                mirror[c, 0], mirror[c, 1] = own[0, c], own[1, c]


@kernel
def _doubt(i: int, j: int, p: Floats, cross: Floats, car: Indices, factor: float) -> None:
    """Let the covariances of cars i and j grow by a factor, their correlations alike."""
    root = math.sqrt(factor)
    for a in (i, j):
        p[a] *= factor
        for k in range(car.size):
            if k != a:
                cross[car[a], car[k]] *= root
                cross[car[k], car[a]] *= root


@kernel
def _difference(
    i: int, j: int, p: Floats, cross: Floats, car: Indices
) -> tuple[Spread, Floats, Floats]:
    """Return covariance of ``x_i - x_j``, and its covariances with both cars."""
    c = cross[car[i], car[j]]
    own, other = np.empty((2, 2)), np.empty((2, 2))
    own[0, 0], own[0, 1] = p[i, 0] - c[0, 0], p[i, 1] - c[0, 1]
    own[1, 0], own[1, 1] = p[i, 1] - c[1, 0], p[i, 2] - c[1, 1]
    other[0, 0], other[0, 1] = c[0, 0] - p[j, 0], c[1, 0] - p[j, 1]
    other[1, 0], other[1, 1] = c[0, 1] - p[j, 1], c[1, 1] - p[j, 2]
    spread = (own[0, 0] - other[0, 0], own[0, 1] - other[0, 1], own[1, 1] - other[1, 1])
    return spread, own, other


@kernel
def _fuse_pair(
    i: int,
    j: int,
    x: Floats,
    p: Floats,
    cross: Floats,
    car: Indices,
    measured_m: float,
    r: float,
) -> None:
    """Fuse a range between two cars, which corrects both."""
    dx, dy = x[i, 0] - x[j, 0], x[i, 1] - x[j, 1]
    before, own, other = _difference(i, j, p, cross, car)
    factor = _excess(dx, dy, before, measured_m, r)
    if factor > 1.0:
        _doubt(i, j, p, cross, car, factor)
        before, own, other = _difference(i, j, p, cross, car)
    mx, my, xx, xy, yy = moments(dx, dy, before[0], before[1], before[2], measured_m, r)
    w, inverse, widest = shrink(before, (xx, xy, yy))
    if widest > 1.0:  # on either side of each other: less is known than before
        _doubt(i, j, p, cross, car, widest)
        before, own, other = _difference(i, j, p, cross, car)
        w, inverse, _ = shrink(before, (xx, xy, yy))
    mx, my = mx - dx, my - dy
    pull = (inverse[0] * mx + inverse[1] * my, inverse[1] * mx + inverse[2] * my)
    _consider(i, j, cross, car, own, other, w)
    _correct_both(i, j, x, p, cross, car, own, other, w, pull)


@kernel
def _consider(
    i: int, j: int, cross: Floats, car: Indices, own: Floats, other: Floats, w: Spread
) -> None:
    """Let the correlations of both cars with the others follow; these only look on."""
    for k in range(car.size):
        one, two = cross[car[i], car[k]], cross[car[j], car[k]]
        if k in (i, j) or not (_linked(one) or _linked(two)):
            continue
        for b in range(2):
            x, y = one[0, b] - two[0, b], one[1, b] - two[1, b]  # cov(x_i - x_j, x_k)
            tx, ty = w[0] * x + w[1] * y, w[1] * x + w[2] * y
            for a in range(2):
                one[a, b] -= own[a, 0] * tx + own[a, 1] * ty
                two[a, b] -= other[a, 0] * tx + other[a, 1] * ty
                cross[car[k], car[i], b, a] = one[a, b]
                cross[car[k], car[j], b, a] = two[a, b]


@kernel
def _correct_both(
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
    """Correct both cars: any covariance falls by ``cov(a, z) W cov(z, b)`` with z = x_i - x_j."""
    for a in range(2):
        x[i, a] += own[a, 0] * pull[0] + own[a, 1] * pull[1]
        x[j, a] += other[a, 0] * pull[0] + other[a, 1] * pull[1]
        tx, ty = own[a, 0] * w[0] + own[a, 1] * w[1], own[a, 0] * w[1] + own[a, 1] * w[2]
        for b in range(2):
            cross[car[i], car[j], a, b] -= tx * other[b, 0] + ty * other[b, 1]
            cross[car[j], car[i], b, a] = cross[car[i], car[j], a, b]
    _reduce(p[i], own, w)
    _reduce(p[j], other, w)


@kernel
def _reduce(p: Floats, g: Floats, w: Spread) -> None:
    tx0, ty0 = g[0, 0] * w[0] + g[0, 1] * w[1], g[0, 0] * w[1] + g[0, 1] * w[2]
    tx1, ty1 = g[1, 0] * w[0] + g[1, 1] * w[1], g[1, 0] * w[1] + g[1, 1] * w[2]
    p[0] -= tx0 * g[0, 0] + ty0 * g[0, 1]
    p[1] -= tx0 * g[1, 0] + ty0 * g[1, 1]
    p[2] -= tx1 * g[1, 0] + ty1 * g[1, 1]


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
    """Correct all cars of one run in place: each by GPS and anchors, then pairs of cars."""
    for i in range(car.size):
        a = np.eye(2)
        _fuse_gps(x[i], p[i], a, gps[i], max(gps_m2, _LEAST_VARIANCE_M2))
        for m in range(count[i]):
            if neighbour[i, m] >= ANCHOR_BIT:
                place = (place_x[i, m], place_y[i, m], shared[i, m, 0])
                r = max(variance[i, m], _LEAST_VARIANCE_M2)
                _fuse_anchor(x[i], p[i], a, place, ranges[i, m], r)
        _pass_on(i, a, cross, car)
    for i in range(car.size):
        for m in range(count[i]):
            j = neighbour[i, m]
            if 0 <= j < ANCHOR_BIT:
                r = max(variance[i, m], _LEAST_VARIANCE_M2)
                _fuse_pair(i, j, x, p, cross, car, ranges[i, m], r)


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

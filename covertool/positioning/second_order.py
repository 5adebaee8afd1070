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


@kernel
def _expand(dx: float, dy: float, xx: float, xy: float, yy: float) -> tuple[float, ...]:
    """Return unit vector, expected range and variance of a range from what is uncertain.

    With s the variance across the line of sight: ``E = sqrt(d^2 + s)``, which is
    ``d + s / 2d`` to the second order and stays finite at d = 0, and an added variance
    ``(s / E)^2 / 2`` for the curvature.
    """
    d = max(math.sqrt(dx * dx + dy * dy), 1e-9)
    ux, uy = dx / d, dy / d
    across = max(uy * uy * xx - 2.0 * ux * uy * xy + ux * ux * yy, 0.0)
    expected = math.sqrt(d * d + across)
    along = ux * ux * xx + 2.0 * ux * uy * xy + uy * uy * yy
    curved = across / expected
    return ux, uy, expected, along + 0.5 * curved * curved


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
def _fuse_anchor(
    i: int,
    x: Floats,
    p: Floats,
    cross: Floats,
    car: Indices,
    place_x: float,
    place_y: float,
    anchor_m2: float,
    measured_m: float,
    r: float,
) -> None:
    xx, xy, yy = p[i, 0], p[i, 1], p[i, 2]
    dx, dy = x[i, 0] - place_x, x[i, 1] - place_y
    ux, uy, expected, spread = _expand(dx, dy, xx + anchor_m2, xy, yy + anchor_m2)
    s = spread + r
    gx, gy = xx * ux + xy * uy, xy * ux + yy * uy
    miss = (measured_m - expected) / s
    x[i, 0] += gx * miss
    x[i, 1] += gy * miss
    p[i, 0] -= gx * gx / s
    p[i, 1] -= gx * gy / s
    p[i, 2] -= gy * gy / s
    for k in range(car.size):
        if k != i:
            own, mirror = cross[car[i], car[k]], cross[car[k], car[i]]
            for c in range(2):
                seen = (ux * own[0, c] + uy * own[1, c]) / s
                own[0, c] -= gx * seen
                own[1, c] -= gy * seen
                mirror[c, 0], mirror[c, 1] = own[0, c], own[1, c]


@kernel
def _fuse_pair(
    i: int, j: int, x: Floats, p: Floats, cross: Floats, car: Indices, measured_m: float, r: float
) -> None:
    """Correct both cars of a range together; the others' correlations follow exactly."""
    c = cross[car[i], car[j]]
    xx = p[i, 0] + p[j, 0] - 2.0 * c[0, 0]
    xy = p[i, 1] + p[j, 1] - c[0, 1] - c[1, 0]
    yy = p[i, 2] + p[j, 2] - 2.0 * c[1, 1]
    ux, uy, expected, spread = _expand(x[i, 0] - x[j, 0], x[i, 1] - x[j, 1], xx, xy, yy)
    s = spread + r
    ix = (p[i, 0] - c[0, 0]) * ux + (p[i, 1] - c[0, 1]) * uy
    iy = (p[i, 1] - c[1, 0]) * ux + (p[i, 2] - c[1, 1]) * uy
    jx = (c[0, 0] - p[j, 0]) * ux + (c[1, 0] - p[j, 1]) * uy
    jy = (c[0, 1] - p[j, 1]) * ux + (c[1, 1] - p[j, 2]) * uy
    miss = (measured_m - expected) / s
    for k in range(car.size):
        if k != i and k != j:
            one, other = cross[car[i], car[k]], cross[car[j], car[k]]
            for a in range(2):
                seen = (ux * (one[0, a] - other[0, a]) + uy * (one[1, a] - other[1, a])) / s
                one[0, a] -= ix * seen
                one[1, a] -= iy * seen
                other[0, a] -= jx * seen
                other[1, a] -= jy * seen
                cross[car[k], car[i], a, 0] = one[0, a]
                cross[car[k], car[i], a, 1] = one[1, a]
                cross[car[k], car[j], a, 0] = other[0, a]
                cross[car[k], car[j], a, 1] = other[1, a]
    c[0, 0] -= ix * jx / s
    c[0, 1] -= ix * jy / s
    c[1, 0] -= iy * jx / s
    c[1, 1] -= iy * jy / s
    mirror = cross[car[j], car[i]]
    mirror[0, 0], mirror[0, 1], mirror[1, 0], mirror[1, 1] = c[0, 0], c[1, 0], c[0, 1], c[1, 1]
    x[i, 0] += ix * miss
    x[i, 1] += iy * miss
    x[j, 0] += jx * miss
    x[j, 1] += jy * miss
    p[i, 0] -= ix * ix / s
    p[i, 1] -= ix * iy / s
    p[i, 2] -= iy * iy / s
    p[j, 0] -= jx * jx / s
    p[j, 1] -= jx * jy / s
    p[j, 2] -= jy * jy / s


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
                ax, ay, a_m2 = place_x[i, m], place_y[i, m], shared[i, m, 0]
                _fuse_anchor(i, x, p, cross, car, ax, ay, a_m2, ranges[i, m], r)
    for i in range(n):
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

"""A distributed second-order filter that uses all information and remembers who shared it.

Each car fuses GPS, odometry and every range. Cars that range to each other become correlated;
a filter that forgets this counts the same information again and again and grows overconfident.
Here each car keeps its correlation with the others, and a range updates the two cars at its ends
(Schmidt 1966: the others are considered, not updated). Ranges are expanded to the second order
(Athans, Wishner and Bertolini 1968), since a near neighbour's circle is far from straight. Where
ranges leave two sides open, a car keeps both (see ``mirror``).
"""

from __future__ import annotations

import math

import numpy as np

from covertool.errors import OptionError
from covertool.model import Floats
from covertool.positioning.circle import Spread, excess, moments, shrink, two_sides
from covertool.positioning.correlations import LANES, Correlations, Links, pass_on
from covertool.positioning.ekf import LEAST_VARIANCE_M2
from covertool.positioning.estimators import Measurements, State, isotropic
from covertool.positioning.inverse import Mask
from covertool.positioning.kernel import kernel
from covertool.positioning.linear import DIFFUSE_M2, carry_on
from covertool.positioning.mirror import (
    LEAST_SHARE,
    Side,
    join,
    part,
    settle,
    weigh_gps,
    weigh_range,
)
from covertool.positioning.noise import ANCHOR_BIT, Indices
from covertool.positioning.pairs import fuse_pairs, pairs_of

MOST_CARS = 2000
"""Cars on the road at once whose correlations fit into memory (64 MB a run)."""


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
    x: Floats, p: Floats, a: Floats, other: Side, place: Spread, measured_m: float, r: float
) -> None:
    """Fuse a range to an anchor at ``place``: x, y, and variance along each axis."""
    if other[0] > 0.0:
        weigh_range(x, p, a, other, place, measured_m, r)
    dx, dy, own_m2 = x[0] - place[0], x[1] - place[1], place[2]
    _doubt_alone(p, a, excess(dx, dy, (p[0] + own_m2, p[1], p[2] + own_m2), measured_m, r))
    before = (p[0] + own_m2, p[1], p[2] + own_m2)
    one = two = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    if other[0] == 0.0:
        one, two = two_sides(dx, dy, before[0], before[1], before[2], measured_m, r)
    if two[0] > LEAST_SHARE:
        _, mx, my, xx, xy, yy = one
        other[0], other[1], other[2] = two[0], place[0] + two[1], place[1] + two[2]
    else:
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
def _fuse_own(
    x: Floats,
    p: Floats,
    a: Floats,
    other: Side,
    gps: Floats,
    gps_m2: float,
    count: int,
    neighbour: Indices,
    ranges: Floats,
    variance: Floats,
    place_x: Floats,
    place_y: Floats,
    shared: Floats,
) -> None:
    """Fuse what one car in one run learns from GPS and from anchors."""
    a[0, 0] = a[1, 1] = 1.0
    a[0, 1] = a[1, 0] = 0.0
    gps_m2 = max(gps_m2, LEAST_VARIANCE_M2)
    if other[0] > 0.0:
        part(x, p, other)
        weigh_gps(x, p, a, other, gps, gps_m2)
    _fuse_gps(x, p, a, gps, gps_m2)
    for m in range(count):
        if neighbour[m] >= ANCHOR_BIT:
            place = (place_x[m], place_y[m], shared[m, 0])
            r = max(variance[m], LEAST_VARIANCE_M2)
            _fuse_anchor(x, p, a, other, place, ranges[m], r)
    settle(x, p, other)


@kernel
def _update(
    x: Floats,
    p: Floats,
    other: Floats,
    block: Floats,
    linked: Links,
    seat: Indices,
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
    """Correct all cars in the runs of one group in place: each by itself, then pairs of cars."""
    runs, n = len(x), seat.size
    a, least_m2, own = np.zeros((n, 4 * LANES)), np.zeros((n, LANES)), np.empty((2, 2))
    for run in range(runs):
        for i in range(n):
            _fuse_own(
                x[run, i],
                p[run, i],
                own,
                other[run, seat[i]],
                gps[run, i],
                gps_m2,
                count[i],
                neighbour[i],
                ranges[run, i],
                variance[run, i],
                place_x[run, i],
                place_y[run, i],
                shared[run, i],
            )
            for q in range(4):
                a[i, q * LANES + run] = own[q // 2, q % 2]
            xx, xy, yy = p[run, i, 0], p[run, i, 1], p[run, i, 2]
            least_m2[i, run] = (xx * yy - xy * xy) / (xx + yy)
    pass_on(block, linked, seat, a, least_m2)
    fuse_pairs(x, p, other, block, linked, seat, pairs_of(count, neighbour), ranges, variance)
    for run in range(runs):
        for i in range(n):
            if other[run, seat[i], 0] > 0.0:
                join(x[run, i], p[run, i], other[run, seat[i]])


class SecondOrder:
    """The ``best`` preset: GPS, v(t) and all ranges, with the correlations between the cars.

    Parameters
    ----------
    cars : int
        Cars on the road at once, at most.
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
                f"{cars} cars on the road at once",
                "cut the trace, or use the estimators ekf or gcpso",
            )
        self.sigma_velocity = sigma_velocity
        self._common = Correlations(0)
        self._other = np.zeros((0, 0, 3))

    def start(self, gps: Floats, variance_m2: float) -> State:
        """Return a place of which nothing is known: the first update takes the fix."""
        return State(gps.copy(), isotropic(len(gps), DIFFUSE_M2))

    def predict(self, state: State, velocity: Floats, step_s: float) -> State:
        """Return the state carried on; correlations between cars stay as they are."""
        return carry_on(state, velocity, step_s, (self.sigma_velocity * step_s) ** 2)

    def update(self, predicted: State, heard: Measurements) -> State:
        """Return the state after all measurements of the step."""
        n, runs = heard.car.size, heard.runs
        groups = -(-runs // LANES)
        if self._common.groups != groups:
            self._common = Correlations(groups)
        x, p = predicted.position.copy(), predicted.covariance.copy()
        fresh = p[:n, 0] >= DIFFUSE_M2
        seat = self._common.seat(heard.car, fresh)
        other = self._other_sides(runs, seat, fresh)
        by_run = [
            each.reshape(runs, n, *each.shape[1:])
            for each in (
                x,
                p,
                heard.gps,
                heard.range_m,
                heard.range_variance_m2,
                heard.x,
                heard.y,
                heard.shared,
            )
        ]
        for group in range(groups):
            some = slice(group * LANES, (group + 1) * LANES)
            own_x, own_p, gps, *heard_of = (each[some] for each in by_run)
            _update(
                own_x,
                own_p,
                other[some],
                self._common.block[group],
                self._common.linked[group],
                seat,
                gps,
                heard.gps_variance_m2,
                heard.count[:n],
                heard.neighbour[:n],
                *heard_of,
            )
        return State(x, p)

    def _other_sides(self, runs: int, seat: Indices, fresh: Mask) -> Floats:
        """Return (runs, seats, 3) the other side of each seat; fresh cars have none."""
        seats = int(seat.max(initial=-1)) + 1
        if len(self._other) != runs:
            self._other = np.zeros((runs, 0, 3))
        missing = max(seats - self._other.shape[1], 0)
        self._other = np.concatenate([self._other, np.zeros((runs, missing, 3))], axis=1)
        self._other[:, seat[fresh]] = 0.0
        return self._other

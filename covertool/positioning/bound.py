"""How well anyone could do: the posterior Cramér-Rao bound, and the bound of a single place."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from covertool.model import Floats
from covertool.positioning.hearing import Step
from covertool.positioning.inverse import inverse
from covertool.positioning.kernel import kernel
from covertool.positioning.noise import ANCHOR_BIT, Indices
from covertool.positioning.ranging import RangeModel

MOST_CARS = 1000
"""Cars on the road at once for which the joint bound is computed."""

_LEAST_VARIANCE_M2 = 1e-8


def place_information(
    x_m: float, y_m: float, anchor_x_m: Floats, anchor_y_m: Floats, sigma_range_m: float
) -> Floats:
    """Return the (2, 2) Fisher information of a place from ranges: ``sum u u' / sigma^2``.

    An anchor at the place itself gives no direction and is left out.
    """
    dx, dy = x_m - np.asarray(anchor_x_m), y_m - np.asarray(anchor_y_m)
    d = np.hypot(dx, dy)
    u = np.stack([dx[d > 0], dy[d > 0]]) / d[d > 0]
    information: Floats = u @ u.T / sigma_range_m**2
    return information


def crlb_m(
    x_m: float, y_m: float, anchor_x_m: Floats, anchor_y_m: Floats, sigma_range_m: float
) -> float:
    """Return the least RMSE in metres of a place known by ranges alone; inf when it is not fixed.

    The Cramér-Rao bound ``sqrt(trace(J^-1))`` with J from :func:`place_information`.

    >>> round(crlb_m(0, 0, np.array([10.0, 0.0]), np.array([0.0, 10.0]), 0.2), 6)
    0.282843
    """
    j = place_information(x_m, y_m, anchor_x_m, anchor_y_m, sigma_range_m)
    determinant = float(np.linalg.det(j))
    if determinant <= 1e-12 * float(np.trace(j)) ** 2:
        return math.inf
    return math.sqrt(float(np.trace(j)) / determinant)


def pdop(x_m: float, y_m: float, anchor_x_m: Floats, anchor_y_m: Floats) -> float:
    """Return the position dilution of precision of a place: its CRLB for ranges of 1 m noise.

    >>> round(pdop(0, 0, np.array([10.0, 0.0]), np.array([0.0, 10.0])), 6)
    1.414214
    """
    return crlb_m(x_m, y_m, anchor_x_m, anchor_y_m, 1.0)


@kernel
def _add_ranges(
    j: Floats,
    size: int,
    position: Floats,
    neighbour: Indices,
    filled: Indices,
    anchors: Floats,
    anchor_m2: Floats,
    sigma_m: float,
    growth: float,
) -> None:
    """Add the information of all ranges to J, whose cars have ``size`` rows each."""
    for i in range(filled.size):
        for m in range(filled[i]):
            other = neighbour[i, m]
            known = other >= ANCHOR_BIT
            k = other - ANCHOR_BIT if known else other
            px, py = (anchors[k, 0], anchors[k, 1]) if known else (position[k, 0], position[k, 1])
            dx, dy = position[i, 0] - px, position[i, 1] - py
            d2 = dx * dx + dy * dy
            if d2 == 0.0:
                continue
            r = sigma_m * sigma_m + growth * growth * d2 + (anchor_m2[k] if known else 0.0)
            w = 1.0 / (max(r, 1e-8) * d2)
            a, b = i * size, k * size
            xx, xy, yy = w * dx * dx, w * dx * dy, w * dy * dy
            j[a, a] += xx
            j[a, a + 1] += xy
            j[a + 1, a] += xy
            j[a + 1, a + 1] += yy
            if not known:
                j[b, b] += xx
                j[b, b + 1] += xy
                j[b + 1, b] += xy
                j[b + 1, b + 1] += yy
                j[a, b] -= xx
                j[a, b + 1] -= xy
                j[a + 1, b] -= xy
                j[a + 1, b + 1] -= yy
                j[b, a] -= xx
                j[b, a + 1] -= xy
                j[b + 1, a] -= xy
                j[b + 1, a + 1] -= yy


class JointBound:
    """Posterior Cramér-Rao bound of all cars together (Tichavsky, Muravchik and Nehorai 1998).

    ``J(t+1) = (F J(t)^-1 F' + Q)^-1 + H' R^-1 H`` with H at the true positions: GPS of every car
    at every step, odometry, and the ranges that are used, each as its own measurement. With GPS
    errors that are correlated in time the state also holds each car's GPS error; 1 cm of white
    noise is then added to the fixes, so that J stays invertible. What a growing range noise or
    a range without line of sight tells beyond its mean is left out.

    Parameters
    ----------
    cars : cars in the trace
    gps_m, gps_correlation : GPS noise per axis in metres, and correlation of two steps' errors
    odometry_m : standard deviation per axis that one step of odometry adds, in metres; None for
        no odometry at all
    anchors, anchor_m2 : (anchors, 2) true positions, (anchors,) variances along each axis
    model : noise of the ranges
    """

    def __init__(
        self,
        cars: int,
        gps_m: float,
        gps_correlation: float,
        odometry_m: float | None,
        anchors: Floats,
        anchor_m2: Floats,
        model: RangeModel,
    ) -> None:
        self._gps_m2, self._correlation = max(gps_m**2, _LEAST_VARIANCE_M2), gps_correlation
        self._odometry_m = odometry_m
        self._anchors, self._anchor_m2, self._model = anchors, anchor_m2, model
        self._size = 4 if gps_correlation > 0 else 2
        self._place = np.full(cars, -1, np.int64)
        self._p = np.zeros((0, 0))
        self.squared_m2 = np.zeros(cars)
        """Sum over steps of each car's bound, the trace of its covariance, in square metres."""
        self.count = np.zeros(cars, np.int64)

    def follow(self, steps: Iterable[Step]) -> bool:
        """Walk through the steps; False, and nothing useful, when a step has too many cars."""
        for step in steps:
            if step.car.size > MOST_CARS:
                return False
            p = self._predict(step)
            j = inverse(p)
            self._measure(j, step)
            self._p = inverse(j)
            self._place[:] = -1
            self._place[step.car] = np.arange(step.car.size)
            diagonal = np.diagonal(self._p)[: step.car.size * self._size].reshape(-1, self._size)
            self.squared_m2[step.car] += diagonal[:, 0] + diagonal[:, 1]
            self.count[step.car] += 1
        return True

    def _predict(self, step: Step) -> Floats:
        """Return the covariance before the measurements; a new car's place is diffuse."""
        n, size = step.car.size, self._size
        old = np.where(step.new, -1, self._place[step.car])
        kept = np.flatnonzero(old >= 0)
        rows = (kept[:, None] * size + np.arange(size)).ravel()
        past = (old[kept][:, None] * size + np.arange(size)).ravel()
        p = np.zeros((n * size, n * size))
        p[np.ix_(rows, rows)] = self._p[np.ix_(past, past)]
        fresh = old < 0
        place = np.full(n, 1e6 if self._odometry_m is None else self._odometry_m**2)
        place[step.halted > 0] = 0.0
        place[fresh] = 1e6
        added = np.zeros((n, size))
        added[:, :2] = place[:, None]
        if size == 4:
            a = self._correlation
            decay = np.tile([1.0, 1.0, a, a], n)
            p *= decay[:, None] * decay
            added[:, 2:] = np.where(fresh, 1.0, 1 - a * a)[:, None] * self._gps_m2
        p[np.diag_indices(n * size)] += added.ravel()
        return p

    def _measure(self, j: Floats, step: Step) -> None:
        n, size = step.car.size, self._size
        w = 1 / self._gps_m2 if size == 2 else 1e4
        for axis in range(2):
            at = np.arange(n) * size + axis
            for a in range(axis, size, 2):
                for b in range(axis, size, 2):
                    j[at - axis + a, at - axis + b] += w
        if step.selection is not None:
            _add_ranges(
                j,
                size,
                np.ascontiguousarray(step.position),
                step.selection.neighbour,
                step.selection.filled,
                self._anchors,
                self._anchor_m2,
                self._model.sigma_m,
                self._model.growth,
            )

"""Ranges to the chosen neighbours, and what these say about their own place."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from covertool.model import Floats
from covertool.positioning.kernel import kernel
from covertool.positioning.noise import (
    ANCHOR_BIT,
    NLOS,
    RANGE,
    Indices,
    fill_normal_pairs,
    fill_unit_pairs,
    log,
)


class RangeModel(NamedTuple):
    """Noise of a range: ``sigma^2 = sigma_m^2 + (growth d)^2``, and a bias without line of sight.

    A share ``nlos_share`` of the ranges is longer by an exponential extra of mean ``nlos_mean_m``.
    """

    sigma_m: float
    growth: float = 0.0
    nlos_share: float = 0.0
    nlos_mean_m: float = 0.0


class Shared(NamedTuple):
    """Where the neighbours truly are, and what they say: cars in each run, and anchors.

    Cars: ``x, y`` (cars,) truth, ``said`` (runs * cars, 2), ``covariance`` (runs * cars, 3).
    Anchors: ``anchor_x, anchor_y`` (anchors,) truth, ``anchor_said`` (1 or runs, anchors, 2), and
    ``anchor_m2`` (anchors,) variance along each axis.
    """

    x: Floats
    y: Floats
    said: Floats
    covariance: Floats
    anchor_x: Floats
    anchor_y: Floats
    anchor_said: Floats
    anchor_m2: Floats


class Heard(NamedTuple):
    """Ranges and shared positions of all rows; see ``Measurements`` for the shapes."""

    range_m: Floats
    variance_m2: Floats
    x: Floats
    y: Floats
    covariance: Floats


@kernel
def _place_addresses(
    own: Indices, neighbour: Indices, count: Indices, car: Indices, shared: Shared
) -> tuple[Indices, Indices, Floats]:
    """Return the addresses and true lengths of all ranges, row after row."""
    size = count.sum()
    from_car, to = np.empty(size, np.int64), np.empty(size, np.int64)
    true_m = np.empty(size)
    k = 0
    for i in range(own.size):
        x, y = shared.x[own[i]], shared.y[own[i]]
        for m in range(count[i]):
            j = neighbour[i, m]
            from_car[k] = car[own[i]]
            if j >= ANCHOR_BIT:
                to[k] = j
                a = j - ANCHOR_BIT
                dx, dy = shared.anchor_x[a] - x, shared.anchor_y[a] - y
            else:
                to[k] = car[j]
                dx, dy = shared.x[j] - x, shared.y[j] - y
            true_m[k] = math.sqrt(dx * dx + dy * dy)
            k += 1
    return from_car, to, true_m


@kernel
def _fill_extra(
    key: tuple[int, int],
    run: int,
    time: int,
    car: Indices,
    to: Indices,
    model: RangeModel,
    extra_m: Floats,
) -> None:
    chance, length = np.empty(car.size), np.empty(car.size)
    fill_unit_pairs(key, NLOS, run, time, car, to, chance, length)
    for k in range(car.size):
        blocked = chance[k] < model.nlos_share
        extra_m[k] = -model.nlos_mean_m * log(length[k]) if blocked else 0.0


@kernel
def hear(
    key: tuple[int, int],
    first_run: int,
    runs: int,
    time: int,
    car: Indices,
    own: Indices,
    neighbour: Indices,
    count: Indices,
    shared: Shared,
    model: RangeModel,
) -> Heard:
    """Return what the cars ``own`` hear from their neighbours in every run.

    Parameters
    ----------
    key, first_run, runs, time : address
    car : (cars,) number of every car present
    own : (own,) the places among them of the cars that listen
    neighbour, count : (own, most) and (own,), the same in every run
    shared, model : who is where, and how ranges err
    """
    n, cars, most = own.size, car.size, neighbour.shape[1]
    rows = runs * n
    ranges, variance = np.zeros((rows, most)), np.ones((rows, most))
    xs, ys, covariance = np.zeros((rows, most)), np.zeros((rows, most)), np.zeros((rows, most, 3))
    from_car, to, true_m = _place_addresses(own, neighbour, count, car, shared)
    noise, spare = np.empty(true_m.size), np.empty(true_m.size)
    extra_m = np.zeros(true_m.size)
    anchor_runs = shared.anchor_said.shape[0]
    for r in range(runs):
        fill_normal_pairs(key, RANGE, first_run + r, time, from_car, to, noise, spare)
        if model.nlos_share > 0.0:
            _fill_extra(key, first_run + r, time, from_car, to, model, extra_m)
        said = min(r, anchor_runs - 1)
        k = 0
        for i in range(n):
            row = r * n + i
            for m in range(count[i]):
                growth = model.growth * true_m[k]
                variance[row, m] = model.sigma_m * model.sigma_m + growth * growth
                ranges[row, m] = true_m[k] + math.sqrt(variance[row, m]) * noise[k] + extra_m[k]
                j = neighbour[i, m]
                if j >= ANCHOR_BIT:
                    a = j - ANCHOR_BIT
                    xs[row, m] = shared.anchor_said[said, a, 0]
                    ys[row, m] = shared.anchor_said[said, a, 1]
                    covariance[row, m, 0] = shared.anchor_m2[a]
                    covariance[row, m, 2] = shared.anchor_m2[a]
                else:
                    other = r * cars + j
                    xs[row, m], ys[row, m] = shared.said[other, 0], shared.said[other, 1]
                    for c in range(3):
                        covariance[row, m, c] = shared.covariance[other, c]
                k += 1
    return Heard(ranges, variance, xs, ys, covariance)

"""Looks back over a finished run: Rauch, Tung and Striebel (1965), each car by itself."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from covertool.model import Floats
from covertool.positioning.estimators import State
from covertool.positioning.hearing import Step


class Passed(NamedTuple):
    """One step of a filter: what it predicted, and what it knew after the measurements.

    ``gps`` is (rows, 2), the fixes of the step.
    """

    step: Step
    predicted: State
    known: State
    gps: Floats


def smoothed(run: Sequence[Passed], runs: int, cars: int) -> Iterator[Passed]:
    """Yield the steps backwards with what is known of them when the whole trace is.

    ``x_s = x + G (x_s' - x'-)`` and ``P_s = P + G (P_s' - P'-) G'`` with ``G = P P'-^-1``, where a
    dash means one step later. What a car says of another is taken as it was said at the time.

    Parameters
    ----------
    run : the steps in the order of time
    runs, cars : noise runs, and cars in the whole trace
    """
    later_x, later_p = np.zeros((runs, cars, 2)), np.zeros((runs, cars, 3))
    next_step: Passed | None = None
    for passed in reversed(run):
        car = passed.step.car
        x, p = passed.known.position.copy(), passed.known.covariance.copy()
        if next_step is not None and next_step.step.time == passed.step.time + 1:
            n_later = next_step.step.car.size
            _, here, there = np.intersect1d(car, next_step.step.car, return_indices=True)
            goes_on = ~next_step.step.new[there]
            here, there = here[goes_on], there[goes_on]
            lead = np.arange(runs)[:, None]
            rows = (lead * car.size + here).ravel()
            ahead = (lead * n_later + there).ravel()
            later = State(
                later_x[:, car[here]].reshape(-1, 2), later_p[:, car[here]].reshape(-1, 3)
            )
            predicted = State(
                next_step.predicted.position[ahead], next_step.predicted.covariance[ahead]
            )
            x[rows], p[rows] = _look_back(x[rows], p[rows], predicted, later)
        later_x[:, car], later_p[:, car] = x.reshape(runs, -1, 2), p.reshape(runs, -1, 3)
        next_step = passed
        yield passed._replace(known=State(x, p))


def _matrices(covariance: Floats) -> Floats:
    """Return (rows, 2, 2) of (rows, 3)."""
    return covariance[:, [0, 1, 1, 2]].reshape(-1, 2, 2)


def _look_back(x: Floats, p: Floats, predicted: State, later: State) -> tuple[Floats, Floats]:
    gain = _matrices(p) @ np.linalg.inv(_matrices(predicted.covariance))
    moved = x + np.einsum("nij,nj->ni", gain, later.position - predicted.position)
    change = _matrices(later.covariance - predicted.covariance)
    spread = _matrices(p) + gain @ change @ gain.transpose(0, 2, 1)
    return moved, np.stack([spread[:, 0, 0], spread[:, 0, 1], spread[:, 1, 1]], axis=1)

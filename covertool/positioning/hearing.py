"""Who is on the road at each step, who stands still, and whom each car chooses to hear.

By default this does not depend on the noise, so that it is the same in every run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from covertool.errors import GeometryError
from covertool.model import Floats, Trace
from covertool.positioning.grid import ANCHOR, BLIND, PSEUDO_ANCHOR, Grid, build_grid
from covertool.positioning.neighbours import (
    Candidates,
    Selection,
    anchor_codes,
    list_candidates,
    select_all,
    select_gdop,
    select_nearest,
    select_ranked,
)
from covertool.positioning.noise import Indices
from covertool.positioning.options import PositioningOptions

Mask = npt.NDArray[np.bool_]


class Steps(NamedTuple):
    """A trace in the order of time and car: rows ``start[t]`` to ``start[t + 1]`` are step t.

    Step 0 is at ``first_s`` seconds; two steps are ``step_s`` apart.
    """

    vehicle: list[str]
    start: Indices
    car: Indices
    position: Floats
    velocity: Floats
    step_s: float
    first_s: float


def steps_of(trace: Trace) -> Steps:
    """Return a trace sorted by time and then by car, its cars numbered in the order of their ids.

    Raises
    ------
    GeometryError
        When the trace is empty, holds a number that is not finite, or a car twice at one time.
    """
    if len(trace) == 0:
        raise GeometryError("the trace is empty", "trace", "give a car for at least one step")
    values = np.stack([trace.x_m, trace.y_m, trace.vx, trace.vy], axis=1).astype(float)
    if not (np.isfinite(values).all() and np.isfinite(trace.time_s).all()):
        raise GeometryError(
            "a position, velocity or time is not a number", "trace", "leave these rows out"
        )
    ids = trace.vehicle.astype(str)
    vehicle, car = np.unique(ids, return_inverse=True)
    time = np.rint((trace.time_s - trace.time_s.min()) / trace.step_s).astype(np.int64)
    order = np.lexsort((car, time))
    car, time = car[order].astype(np.int64), time[order]
    twice = (np.diff(car) == 0) & (np.diff(time) == 0)
    if twice.any():
        name = vehicle[car[int(np.argmax(twice))]]
        raise GeometryError("a car is twice at one time", f"car {name}", "keep one row a step")
    start = np.searchsorted(time, np.arange(time[-1] + 2)).astype(np.int64)
    values = values[order]
    return Steps(
        [str(name) for name in vehicle],
        start,
        car,
        np.ascontiguousarray(values[:, :2]),
        np.ascontiguousarray(values[:, 2:]),
        float(trace.step_s),
        float(trace.time_s.min()),
    )


@dataclass
class Step:
    """One step: the cars on the road, and whom each of them hears.

    Attributes
    ----------
    time : number of the step
    car : (cars,) numbers of the cars, ascending
    position, velocity : (cars, 2) the truth
    new : (cars,) True where a car was not there one step ago
    halted : (cars,) steps for which it has been a blind stationary car, 0 for a moving one
    fixed : (cars,) True for halted cars that count as anchors
    selection : whom it hears; None when nobody ranges
    """

    time: int
    car: Indices
    position: Floats
    velocity: Floats
    new: Mask
    halted: Indices
    fixed: Mask
    selection: Selection | None


Rank = Callable[[Candidates, Step], Floats]


class Hearing:
    """Walks through a trace and keeps what decides the choice of neighbours.

    Parameters
    ----------
    steps : from :func:`steps_of`
    anchors : (anchors, 2) true positions of the anchors; empty in the traditional arm
    radius_m : communication zone; None when nobody ranges
    options : the reading of the paper
    rank : metric of candidates that differs from run to run (measured ranges), if any
    """

    def __init__(
        self,
        steps: Steps,
        anchors: Floats,
        radius_m: float | None,
        options: PositioningOptions,
        rank: Rank | None = None,
    ) -> None:
        self._steps, self._radius_m, self._options, self._rank = steps, radius_m, options, rank
        cars = len(steps.vehicle)
        self._anchors: Grid | None = None
        if radius_m is not None:
            codes, known = anchor_codes(len(anchors)), np.full(len(anchors), ANCHOR)
            x, y = np.ascontiguousarray(anchors[:, 0]), np.ascontiguousarray(anchors[:, 1])
            self._anchors = build_grid(x, y, codes, known, radius_m)
        self._last_seen = np.full(cars, -2, np.int64)
        self._still = np.zeros(cars, np.int64)
        self._fixed = np.zeros(cars, bool)
        self.pseudo = np.zeros(cars, bool)
        """Cars that are pseudo-anchors at the next step; an estimator's covariance may decide."""

    def __iter__(self) -> Iterator[Step]:
        """Yield the steps in the order of time."""
        steps = self._steps
        for time in range(len(steps.start) - 1):
            rows = slice(int(steps.start[time]), int(steps.start[time + 1]))
            if rows.stop > rows.start:
                yield self._step(time, rows)

    def _step(self, time: int, rows: slice) -> Step:
        car, velocity = self._steps.car[rows], self._steps.velocity[rows]
        new = self._last_seen[car] != time - 1
        self._last_seen[car] = time
        halted = self._halt(car, velocity, new)
        self.pseudo[car[new]] = False
        fixed = self._fixed[car]
        step = Step(time, car, self._steps.position[rows], velocity, new, halted, fixed, None)
        if self._anchors is not None and self._radius_m is not None:
            step.selection = self._select(step)
            self._promote(step, step.selection)
        return step

    def _halt(self, car: Indices, velocity: Floats, new: Mask) -> Indices:
        """Return for how many steps each car has been a blind stationary one."""
        if not self._options.halted:
            return np.zeros(car.size, np.int64)
        slow = np.hypot(velocity[:, 0], velocity[:, 1]) < self._options.halted_below
        self._still[car] = np.where(slow, np.where(new, 1, self._still[car] + 1), 0)
        dwell = int(np.ceil(self._options.halted_after_s / self._steps.step_s))
        halted: Indices = np.maximum(self._still[car] - dwell, 0)
        self._fixed[car] &= halted > 0
        return halted

    def _select(self, step: Step) -> Selection:
        radius_m, anchors = self._radius_m, self._anchors
        assert radius_m is not None
        assert anchors is not None
        x = np.ascontiguousarray(step.position[:, 0])
        y = np.ascontiguousarray(step.position[:, 1])
        priority = np.where(self.pseudo[step.car], PSEUDO_ANCHOR, BLIND)
        priority = np.where(step.fixed, ANCHOR, priority)
        cars = build_grid(x, y, np.arange(x.size), priority, radius_m)
        if self._options.choice == "nearest":
            return select_nearest(cars, anchors, radius_m)
        listed = list_candidates(x, y, cars, anchors, radius_m)
        if self._options.choice == "all":
            return select_all(listed)
        if self._options.choice == "gdop":
            return select_gdop(listed)
        metric = listed.dx**2 + listed.dy**2 if self._rank is None else self._rank(listed, step)
        return select_ranked(listed, metric)

    def _promote(self, step: Step, chosen: Selection) -> None:
        """Note who is an anchor or a pseudo-anchor at the next step."""
        stationary = step.halted > 0
        self._fixed[step.car] |= stationary & (chosen.anchors >= 3)
        needed = self._options.pseudo_anchor
        if needed != "covariance":
            self.pseudo[step.car] = ~stationary & (chosen.anchors >= needed)

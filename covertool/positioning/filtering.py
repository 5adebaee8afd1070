"""Runs one estimator over one trace for a block of noise runs, and adds up its errors."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from covertool.model import Floats
from covertool.positioning.estimators import Estimator, Measurements, State, isotropic
from covertool.positioning.gps import Sensors, noise_of_runs
from covertool.positioning.hearing import Hearing, Mask, Step, Steps
from covertool.positioning.linear import DIFFUSE_M2, fuse_position
from covertool.positioning.neighbours import Candidates, Selection
from covertool.positioning.noise import ANCHOR, Indices
from covertool.positioning.options import PositioningOptions
from covertool.positioning.ranging import RangeModel, Shared, hear
from covertool.positioning.rows import keep_rows, rows_of
from covertool.positioning.smoothing import Passed, smoothed
from covertool.positioning.statistics import Sums


@dataclass(frozen=True)
class Site:
    """The anchors of one arm: (anchors, 2) true positions, (anchors,) variances on each axis."""

    position: Floats
    variance_m2: Floats

    def said(self, key: tuple[int, int], first_run: int, runs: int) -> Floats:
        """Return (1 or runs, anchors, 2): where the anchors say that they are."""
        if not self.variance_m2.any():
            return self.position[None]
        number = np.arange(len(self.position))
        error = noise_of_runs(key, ANCHOR, first_run, runs, 0, number).reshape(runs, -1, 2)
        placed: Floats = self.position + np.sqrt(self.variance_m2)[:, None] * error
        return placed


class Filtering:
    """One estimator on one trace, for the runs from ``first_run``.

    Parameters
    ----------
    steps, site : the trace and the anchors
    estimator : what turns measurements into places
    options : the reading of the paper
    radius_m, model : communication zone and range noise; None when nobody ranges
    key, first_run, runs : address of the chance
    """

    def __init__(
        self,
        steps: Steps,
        site: Site,
        estimator: Estimator,
        options: PositioningOptions,
        radius_m: float | None,
        model: RangeModel,
        key: tuple[int, int],
        first_run: int,
        runs: int,
    ) -> None:
        cars, step_s = len(steps.vehicle), steps.step_s
        self._steps, self._site, self._estimator, self._options = steps, site, estimator, options
        self._radius_m, self._model = radius_m, model
        self._key, self._first_run, self._runs = key, first_run, runs
        correlation = options.gps_correlation(step_s)
        self._sensors = Sensors(
            key, first_run, runs, cars, options.gps_axis_m, correlation, options.sigma_velocity
        )
        self._fusion_m2 = options.gps_fusion_variance_m2(step_s)
        self._anchor_said = site.said(key, first_run, runs)
        self._position = np.zeros((runs, cars, 2))
        self._covariance = np.zeros((runs, cars, 3))
        self._velocity = np.zeros((runs, cars, 2))
        self._since_fix = np.zeros(cars, np.int64)
        rank = self._measured_ranges if options.choice == "measured" else None
        self._hearing = Hearing(steps, site.position, radius_m, options, rank)

    def run(self) -> Sums:
        """Return the sums of the errors over the whole trace."""
        sums = Sums.zero(self._runs, len(self._steps.vehicle))
        for passed in self.estimates():
            step, state = passed.step, passed.known
            covariance = state.covariance
            if not self._estimator.gives_covariance:
                covariance = np.zeros_like(covariance)
            limit_m = self._options.divergence_m
            truth = np.ascontiguousarray(step.position)
            sums.add(step.car, truth, state.position, covariance, limit_m)
        return sums

    def estimates(self) -> Iterator[Passed]:
        """Yield each step with its final estimate: from the end where a filter looks back."""
        if self._options.smoothing and self._estimator.name == "second_order":
            return smoothed(list(self.passed()), self._runs, len(self._steps.vehicle))
        return self.passed()

    def states(self) -> Iterator[tuple[Step, State]]:
        """Yield each step with the state after it; rows are cars within runs."""
        return ((passed.step, passed.known) for passed in self.passed())

    def passed(self) -> Iterator[Passed]:
        """Yield each step with the states before and after its measurements."""
        for step in self._hearing:
            gps = self._sensors.gps(step.time, step.car, step.position, step.new)
            velocity = self._sensed_velocity(step)
            predicted = self._predict(step, gps, velocity)
            state = self._update(step, predicted, gps, velocity)
            state = self._settle(step, predicted, state, gps)
            self._keep(step, state)
            yield Passed(step, predicted, state, gps)

    def _sensed_velocity(self, step: Step) -> Floats:
        """Return the velocity that carries the estimate to this step."""
        now = self._sensors.velocity(step.time, step.car, step.velocity)
        if self._options.velocity == "current":
            return now
        past = rows_of(self._velocity, step.car)
        keep_rows(self._velocity, step.car, now)
        return past

    def _rows(self, of_cars: Mask) -> Mask:
        """Return a mask of cars as one of rows."""
        return np.tile(of_cars, self._runs)

    def _predict(self, step: Step, gps: Floats, velocity: Floats) -> State:
        """Return what is known before the measurements: new cars start, halted cars stay."""
        past = State(rows_of(self._position, step.car), rows_of(self._covariance, step.car))
        predicted = self._estimator.predict(past, velocity, self._steps.step_s)
        if step.halted.any():
            predicted = _where(self._rows(step.halted > 0), past, predicted)
        if step.new.any():
            begun = self._estimator.start(gps, self._options.gps_axis_m**2)
            predicted = _where(self._rows(step.new), begun, predicted)
        return predicted

    def _update(self, step: Step, predicted: State, gps: Floats, velocity: Floats) -> State:
        if step.selection is None:
            nobody = np.full((step.car.size, 1), -1, np.int64)
            none = np.zeros(step.car.size, np.int64)
            selection = Selection(nobody, none, none)
        else:
            selection = step.selection
        filled = self._listened(step, selection)
        said = self._said(step, predicted, gps)
        everyone = np.arange(step.car.size)
        if not self._options.sequential or self._estimator.name == "second_order":
            heard = self._hear(step, selection, filled, everyone, said, gps, velocity)
            return self._estimator.update(predicted, heard)
        position, covariance = predicted.position.copy(), predicted.covariance.copy()
        for i in everyone:
            rows = np.arange(self._runs) * step.car.size + i
            heard = self._hear(step, selection, filled, everyone[i : i + 1], said, gps, velocity)
            new = self._estimator.update(State(position[rows], covariance[rows]), heard)
            position[rows], covariance[rows] = new.position, new.covariance
            if self._options.sharing == "prediction":
                said.position[rows], said.covariance[rows] = new.position, new.covariance
        return State(position, covariance)

    def _listened(self, step: Step, selection: Selection) -> Indices:
        """Return how many of the chosen each car uses: a halted car two anchors or more, or none.

        With fewer than two anchors it relies on GPS (section IV-B).
        """
        if self._estimator.uses_gps:
            return selection.filled
        enough = np.where(selection.anchors >= 2, selection.anchors, 0)
        return np.where(step.halted > 0, enough, selection.filled)

    def _said(self, step: Step, predicted: State, gps: Floats) -> State:
        """Return what every moving car shares; a halted one that counts as anchor, its estimate."""
        sharing = self._options.sharing
        if sharing == "prediction":
            return State(predicted.position.copy(), predicted.covariance.copy())
        if sharing == "truth":
            position = np.tile(step.position, (self._runs, 1))
            return State(position, np.zeros_like(predicted.covariance))
        fixes = State(gps, isotropic(len(gps), self._options.gps_axis_m**2))
        return _where(self._rows(step.fixed), predicted, fixes) if step.fixed.any() else fixes

    def _hear(
        self,
        step: Step,
        selection: Selection,
        filled: Indices,
        own: Indices,
        said: State,
        gps: Floats,
        velocity: Floats,
    ) -> Measurements:
        everyone = own.size == step.car.size
        rows = np.arange(self._runs)[:, None] * step.car.size + own
        some = slice(None) if everyone else rows.ravel()
        shared = self._shared(step, said)
        address = (self._key, self._first_run, self._runs, step.time)
        neighbour, count = selection.neighbour[own], filled[own]
        heard = hear(*address, step.car, own, neighbour, count, shared, self._model)
        return Measurements(
            self._steps.step_s,
            *address,
            step.car[own],
            velocity[some],
            gps[some],
            self._fusion_m2,
            np.tile(count, self._runs),
            np.tile(neighbour, (self._runs, 1)),
            *heard,
        )

    def _shared(self, step: Step, said: State) -> Shared:
        return Shared(
            np.ascontiguousarray(step.position[:, 0]),
            np.ascontiguousarray(step.position[:, 1]),
            said.position,
            said.covariance,
            np.ascontiguousarray(self._site.position[:, 0]),
            np.ascontiguousarray(self._site.position[:, 1]),
            self._anchor_said,
            self._site.variance_m2,
        )

    def _settle(self, step: Step, predicted: State, state: State, gps: Floats) -> State:
        """Return the state of a step: isolated cars reset by GPS, halted cars average."""
        if self._estimator.uses_gps or step.selection is None:
            return state
        used = self._listened(step, step.selection) > 0
        halted = step.halted > 0
        if used.all() and not halted.any():
            self._since_fix[step.car] = 0
            return state
        position, covariance = state.position.copy(), state.covariance.copy()
        due = self._rows(~used & ~halted & ~step.new) & self._reset_due(step, used, covariance)
        position[due] = gps[due]
        covariance[due] = self._options.gps_axis_m**2 * np.array([1.0, 0.0, 1.0])
        waiting = self._rows(halted & ~used)
        if waiting.any():
            first = self._rows(step.halted == 1)[:, None]  # from now on by GPS alone
            unknown = DIFFUSE_M2 * np.array([1.0, 0.0, 1.0])
            before_m2 = np.where(first, unknown, predicted.covariance)
            before = State(predicted.position[waiting], before_m2[waiting])
            averaged = fuse_position(before, gps[waiting], self._fusion_m2)
            position[waiting], covariance[waiting] = averaged.position, averaged.covariance
        if not self._estimator.gives_covariance:
            share = np.tile(1.0 / (1.0 + step.halted), self._runs)[:, None]
            averaged_position = predicted.position + share * (state.position - predicted.position)
            position = np.where(self._rows(halted & used)[:, None], averaged_position, position)
        return State(position, covariance)

    def _reset_due(self, step: Step, used: Mask, covariance: Floats) -> Mask:
        after_s = self._options.gps_reset_s
        if after_s is None:
            over: Mask = covariance[:, 0] + covariance[:, 2] > 2 * self._options.gps_axis_m**2
            return over
        since = np.where(used | step.new, 0, self._since_fix[step.car] + 1)
        due = since * self._steps.step_s >= after_s
        self._since_fix[step.car] = np.where(due, 0, since)
        return self._rows(due)

    def _keep(self, step: Step, state: State) -> None:
        keep_rows(self._position, step.car, state.position)
        keep_rows(self._covariance, step.car, state.covariance)
        if self._options.pseudo_anchor == "covariance":
            spread = state.covariance[:, 0] + state.covariance[:, 2]
            moving = step.halted == 0
            self._hearing.pseudo[step.car] = moving & (spread < self._options.gps_axis_m**2)

    def _measured_ranges(self, listed: Candidates, step: Step) -> Floats:
        """Return the range that each car measures to each candidate, in the one run of a block."""
        cars = step.car.size
        state = State(np.zeros((cars, 2)), np.zeros((cars, 3)))
        own = np.repeat(np.arange(cars), np.diff(listed.start))
        address = (self._key, self._first_run, 1, step.time)
        once = np.ones(own.size, np.int64)
        shared, codes = self._shared(step, state), np.ascontiguousarray(listed.code[:, None])
        return hear(*address, step.car, own, codes, once, shared, self._model).range_m[:, 0]


def _where(chosen: Mask, one: State, other: State) -> State:
    """Return the chosen rows of one state, and else those of the other."""
    return State(
        np.where(chosen[:, None], one.position, other.position),
        np.where(chosen[:, None], one.covariance, other.covariance),
    )

"""The cases of an experiment, and the pieces of work into which they fall."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from covertool.errors import OptionError
from covertool.model import Anchors, Trace
from covertool.positioning.bound import JointBound
from covertool.positioning.correlations import LANES
from covertool.positioning.ekf import Ekf
from covertool.positioning.estimators import Estimator, load_estimator
from covertool.positioning.filtering import Filtering, Site
from covertool.positioning.gcpso import Gcpso
from covertool.positioning.hearing import Hearing, Steps, steps_of
from covertool.positioning.linear import GpsOdometry, GpsOnly
from covertool.positioning.options import PositioningOptions
from covertool.positioning.ranging import RangeModel
from covertool.positioning.second_order import SecondOrder
from covertool.positioning.statistics import Sums

ARMS = ("traditional", "proposed", "gps", "gps_odometry")
ESTIMATORS = ("gcpso", "ekf", "second_order")

RANGING_ARMS = ("traditional", "proposed")
RUNS_A_BLOCK, ROWS_A_BLOCK = 20, 200_000
"""Size of a block of runs; fixed, so that sums do not depend on the number of workers."""


@dataclass(frozen=True)
class Scenario:
    """One trace of moving cars with one layout of parked cars.

    ``layout`` and ``traffic_seed`` say which scenarios belong together in the bootstrap.
    """

    trace: Trace
    anchors: Anchors
    layout: int = 0
    traffic_seed: int = 0


class Case(NamedTuple):
    """One row of the report: what is compared with what."""

    arm: str
    estimator: str | None
    sigma_range_m: float | None
    radius_m: float | None


class Piece(NamedTuple):
    """One piece of work: a block of runs of a case; with no runs, its bound."""

    scenario: int
    case: Case
    first_run: int
    runs: int


class Work:
    """Everything that the pieces share; sent to the workers."""

    def __init__(
        self, scenarios: Sequence[Scenario], options: PositioningOptions, seed: int
    ) -> None:
        self.steps = [steps_of(scenario.trace) for scenario in scenarios]
        self.sites = [_site(scenario.anchors) for scenario in scenarios]
        self.options, self.seed = options, seed

    def __call__(self, piece: Piece) -> Sums | JointBound | None:
        """Return the sums of a block of runs, or a bound; None when it is too large."""
        return self.filtering(piece).run() if piece.runs else self._bound(piece)

    def filtering(self, piece: Piece) -> Filtering:
        """Return what walks through the trace for a block of runs."""
        steps, case = self.steps[piece.scenario], piece.case
        options = options_of(self.options, case)
        return Filtering(
            steps,
            self._site_of(piece),
            _estimator(case, options, self.most_cars(piece.scenario)),
            options,
            case.radius_m,
            _range_model(options, case),
            (self.seed, piece.scenario),
            piece.first_run,
            piece.runs,
        )

    def most_cars(self, scenario: int) -> int:
        """Return how many cars are on the road at once, at most."""
        return int(np.diff(self.steps[scenario].start).max())

    def _site_of(self, piece: Piece) -> Site:
        return self.sites[piece.scenario] if piece.case.arm == "proposed" else _site(None)

    def _bound(self, piece: Piece) -> JointBound | None:
        steps, case = self.steps[piece.scenario], piece.case
        options = options_of(self.options, case)
        if _smooths(options, case):
            return None  # the bound is that of a filter, which cannot see what comes
        model = _range_model(options, case)
        return _bound(steps, self._site_of(piece), options, case, model)

    def blocks(self, scenario: int, case: Case, runs: int) -> list[Piece]:
        """Return the pieces of a case: blocks of runs, in their order."""
        cars = len(self.steps[scenario].vehicle)
        size = min(max(ROWS_A_BLOCK // cars, 1), RUNS_A_BLOCK)
        if case.estimator == "second_order":
            size = LANES
        if options_of(self.options, case).follows_each_run:
            size = 1
        return [
            Piece(scenario, case, first, min(size, runs - first)) for first in range(0, runs, size)
        ]


def check_cases(
    scenarios: Sequence[Scenario],
    arms: Sequence[str],
    estimators: Sequence[str],
    lengths_m: Sequence[float],
) -> None:
    """Raise OptionError unless all of it exists and the lengths are finite and not negative."""
    if not scenarios:
        raise OptionError("there is no scenario", "scenarios", "give at least one trace")
    for arm in arms:
        if arm not in ARMS:
            raise OptionError(f"there is no arm {arm!r}", "arms", f"use {', '.join(ARMS)}")
    for name in estimators:
        if name not in ESTIMATORS:
            if ":" not in name:
                known = ", ".join(ESTIMATORS)
                raise OptionError(
                    f"there is no estimator {name!r}", "estimators", f"use {known} or module:Name"
                )
            load_estimator(name)
    if not all(math.isfinite(length) and length >= 0 for length in lengths_m):
        raise OptionError(
            "a range noise or a zone is negative or not a number",
            f"{', '.join(str(length) for length in lengths_m)}",
            "use metres from 0",
        )


def check_vehicles(vehicles: Sequence[str], work: Work) -> None:
    """Raise OptionError unless each of these cars is in a trace."""
    known = {name for steps in work.steps for name in steps.vehicle}
    for name in vehicles:
        if name not in known:
            raise OptionError(
                f"there is no car {name!r} in the trace", "vehicles", "name a car of the trace"
            )


def options_of(options: PositioningOptions, case: Case) -> PositioningOptions:
    """Return the options of a case: the best preset takes all information that there is."""
    if case.estimator == "second_order":
        return dataclasses.replace(
            options, velocity="current", sharing="prediction", choice="all", pseudo_anchor=3
        )
    if case.arm not in RANGING_ARMS:
        return dataclasses.replace(options, velocity="current")
    return options


def _smooths(options: PositioningOptions, case: Case) -> bool:
    return options.smoothing and case.estimator == "second_order"


def preset_of(estimator: str | None) -> str | None:
    """Return the name of the preset under which an estimator runs."""
    if estimator is None:
        return None
    return "best" if estimator == "second_order" else "paper"


def _site(anchors: Anchors | None) -> Site:
    if anchors is None:
        return Site(np.zeros((0, 2)), np.zeros(0))
    sigma_m = np.nan_to_num(anchors.sigma_m, nan=0.0)
    return Site(np.stack([anchors.x_m, anchors.y_m], axis=1), sigma_m**2)


def _range_model(options: PositioningOptions, case: Case) -> RangeModel:
    growth, share = options.range_growth, options.nlos_share
    return RangeModel(case.sigma_range_m or 0.0, growth, share, options.nlos_mean_m)


def _estimator(case: Case, options: PositioningOptions, cars: int) -> Estimator:
    if case.arm == "gps":
        return GpsOnly()
    if case.arm == "gps_odometry":
        return GpsOdometry(options.sigma_velocity)
    if case.estimator == "ekf":
        return Ekf(literal=options.literal_r)
    if case.estimator == "gcpso":
        return Gcpso(sigma_velocity=options.sigma_velocity, literal=options.literal_cost)
    if case.estimator == "second_order":
        return SecondOrder(cars, options.sigma_velocity)
    return load_estimator(str(case.estimator))


def _bound(
    steps: Steps, site: Site, options: PositioningOptions, case: Case, model: RangeModel
) -> JointBound | None:
    odometry_m = None if case.arm == "gps" else options.sigma_velocity * steps.step_s
    bound = JointBound(
        len(steps.vehicle),
        options.gps_axis_m,
        options.gps_correlation(steps.step_s),
        odometry_m,
        site.position,
        site.variance_m2,
        model,
    )
    plain = dataclasses.replace(
        options, pseudo_anchor=3 if options.follows_each_run else options.pseudo_anchor
    )
    hearing = Hearing(steps, site.position, case.radius_m, plain)
    return bound if bound.follow(hearing) else None

"""The cases of an experiment, and the pieces of work into which they fall."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from covertool.model import Anchors, Trace
from covertool.positioning.bound import JointBound
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
        steps, case = self.steps[piece.scenario], piece.case
        site = self.sites[piece.scenario] if case.arm == "proposed" else _site(None)
        options = options_of(self.options, case)
        model = _range_model(options, case)
        if piece.runs == 0:
            if _smooths(options, case):
                return None  # the bound is that of a filter, which cannot see what comes
            return _bound(steps, site, options, case, model)
        estimator = _estimator(case, options, len(steps.vehicle))
        key = (self.seed, piece.scenario)
        runs = (piece.first_run, piece.runs)
        filtering = Filtering(steps, site, estimator, options, case.radius_m, model, key, *runs)
        return filtering.run()

    def blocks(self, scenario: int, case: Case, runs: int) -> list[Piece]:
        """Return the pieces of a case: blocks of runs, in their order."""
        cars = len(self.steps[scenario].vehicle)
        size = min(max(ROWS_A_BLOCK // cars, 1), RUNS_A_BLOCK)
        if options_of(self.options, case).follows_each_run or _smooths(self.options, case):
            size = 1
        return [
            Piece(scenario, case, first, min(size, runs - first)) for first in range(0, runs, size)
        ]


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

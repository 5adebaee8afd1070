"""The experiment: what parked cars take off the position errors of moving ones."""

from __future__ import annotations

import dataclasses
import logging
import math
import time
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from covertool.dsrc import MEAN_STAY_H, battery_hours
from covertool.model import (
    CarErrors,
    LayoutImprovement,
    PositioningImprovement,
    PositioningReport,
    PositioningResult,
)
from covertool.positioning.bound import MOST_CARS, JointBound
from covertool.positioning.cases import (
    ARMS,
    RANGING_ARMS,
    Case,
    Piece,
    Scenario,
    Work,
    check_cases,
    check_vehicles,
    preset_of,
)
from covertool.positioning.noise import check_address
from covertool.positioning.options import PositioningOptions
from covertool.positioning.statistics import Sums, improvement, statistics_of
from covertool.spread import Ledger, spread

ALL = "all"

logger = logging.getLogger(__name__)


def position_errors(
    scenarios: Sequence[Scenario],
    *,
    arms: Sequence[str] = ARMS,
    estimators: Sequence[str] = ("gcpso", "ekf"),
    sigmas_m: Sequence[float] = (0.2, 4.0),
    radii_m: Sequence[float] = (15.0,),
    runs: int = 40,
    seed: int = 1,
    options: PositioningOptions | None = None,
    vehicles: Sequence[str] = (),
    bound: bool = True,
    workers: int = 1,
    scheduler: str | None = None,
    ledger: Ledger | None = None,
    on_start: Callable[[int], object] | None = None,
    on_done: Callable[[int], object] | None = None,
) -> PositioningReport:
    """Return the position errors of every arm, estimator, range noise and zone.

    Parameters
    ----------
    scenarios : traces with parked cars; layouts and traffic seeds are separate scenarios
    arms : some of ``ARMS``
    estimators : some of ``ESTIMATORS``, or ``module:Name`` of your own
    sigmas_m, radii_m : standard deviations of the ranges, and communication zones, in metres
    runs : noise runs of each scenario
    seed : of the noise, 0 to 4294967295
    options : how the paper is read; the defaults when None
    vehicles : ids of the cars that are also reported one by one
    bound : compute the posterior Cramér-Rao bound; with more than ``bound.MOST_CARS`` cars on the
        road at once it is left out, with a warning
    workers, scheduler, ledger, on_done : see :func:`covertool.spread.spread`; they do not change
        a bit of the result
    on_start : called once with the number of pieces of which ``on_done`` tells

    Raises
    ------
    OptionError
        When an option is out of range or names nothing.
    GeometryError
        When a trace is empty or broken.

    Examples
    --------
    A car drives a minute along a street with parked cars on both sides:

    >>> from pyproj import CRS
    >>> from covertool.model import Anchors, Trace
    >>> time_s, zeros = np.arange(60.0), np.zeros(60)
    >>> trace = Trace(time_s, np.full(60, "car1"), 9 * time_s, zeros, zeros + 9, zeros)
    >>> x_m, side = np.arange(0.0, 540.0, 6.0), np.tile([3.5, -3.5], 45)
    >>> street = Scenario(trace, Anchors.from_points(x_m, side, CRS(2157)))
    >>> report = position_errors([street], arms=("gps", "proposed"), estimators=("ekf",), runs=5)
    >>> error_m = report.to_frame().set_index("arm")["mean_error_m"]
    >>> bool((error_m["proposed"] < error_m["gps"] / 2).all())
    True
    """
    check_cases(scenarios, arms, estimators, (*sigmas_m, *radii_m))
    check_address(seed, runs)
    options = options or PositioningOptions()
    work = Work(scenarios, options, seed)
    check_vehicles(vehicles, work)
    cases = _cases(arms, estimators, sigmas_m, radii_m)
    pieces = [
        piece
        for case in cases
        for number in range(len(scenarios))
        for piece in work.blocks(number, case, runs)
    ]
    bounds = dict.fromkeys(_bound_case(case) for case in cases) if bound else {}
    below = [Piece(n, case, 0, 0) for case in bounds for n in range(len(scenarios))]
    if on_start is not None:
        on_start(len(pieces) + len(below))
    found: dict[Piece, Sums | JointBound | None] = {}
    seconds = []
    for part in (pieces, below):
        begun = time.perf_counter()
        done = spread(
            work, part, workers=workers, scheduler=scheduler, ledger=ledger, on_done=on_done
        )
        found.update(zip(part, done, strict=True))
        seconds.append(time.perf_counter() - begun)
    _warn_of_missing_bounds(work, below, found)
    report = _Table(scenarios, work, found, runs).report(cases, vehicles)
    return dataclasses.replace(
        report, estimate_seconds=seconds[0], bound_seconds=seconds[1] if bound else None
    )


def _warn_of_missing_bounds(
    work: Work, below: Sequence[Piece], found: Mapping[Piece, Sums | JointBound | None]
) -> None:
    """Say why a bound is missing; a filter that looks back has none, and needs no word."""
    for piece in below:
        most = work.most_cars(piece.scenario)
        if found[piece] is None and most > MOST_CARS:
            logger.warning(
                "the bound is left out: %d cars are on the road at once, and it is computed for "
                "%d at most",
                most,
                MOST_CARS,
            )
            return


def _cases(
    arms: Sequence[str],
    estimators: Sequence[str],
    sigmas_m: Sequence[float],
    radii_m: Sequence[float],
) -> list[Case]:
    ranging = [
        Case(arm, estimator, float(sigma_m), float(radius_m))
        for radius_m in radii_m
        for estimator in estimators
        for sigma_m in sigmas_m
        for arm in arms
        if arm in RANGING_ARMS
    ]
    return ranging + [Case(arm, None, None, None) for arm in arms if arm not in RANGING_ARMS]


def _bound_case(case: Case) -> Case:
    """Return the case whose bound serves: estimators that measure the same have the same bound."""
    same = case.estimator if case.estimator == "second_order" else None
    return case._replace(estimator=same)


class _Table:
    """Turns the results of the pieces into the rows of the report."""

    def __init__(
        self,
        scenarios: Sequence[Scenario],
        work: Work,
        found: dict[Piece, Sums | JointBound | None],
        runs: int,
    ) -> None:
        self._scenarios, self._work, self._found, self._runs = scenarios, work, found, runs

    def report(self, cases: Sequence[Case], vehicles: Sequence[str]) -> PositioningReport:
        first, work = self._scenarios[0], self._work
        named = (ALL, *vehicles)
        results = tuple(self._result(case, name) for case in cases for name in named)
        pairs = [c for c in cases if c.arm == "proposed" and c._replace(arm="traditional") in cases]
        improvements = tuple(self._improvement(case, name) for case in pairs for name in named)
        layouts = tuple(
            layout
            for case in pairs
            for name in named
            for number in range(len(self._scenarios))
            if (layout := self._layout(case, number, name)) is not None
        )
        return PositioningReport(
            vehicles=len(work.steps[0].vehicle),
            anchors=len(first.anchors),
            steps=len(work.steps[0].start) - 1,
            scenarios=len(self._scenarios),
            runs=self._runs,
            seed=work.seed,
            results=results,
            improvements=improvements,
            layouts=layouts,
            cars=tuple(self._cars(case) for case in cases),
            options=dataclasses.asdict(work.options),
            battery_hours=battery_hours(),
            mean_stay_h=MEAN_STAY_H,
        )

    def _sums(self, case: Case, scenario: int, vehicle: str) -> Sums | None:
        """Return the sums of one scenario, of all cars or one; None when it is not there."""
        blocks = [self._found[p] for p in self._work.blocks(scenario, case, self._runs)]
        sums = Sums.of_blocks([block for block in blocks if isinstance(block, Sums)])
        if vehicle == ALL:
            return sums
        names = self._work.steps[scenario].vehicle
        return sums.only(names.index(vehicle)) if vehicle in names else None

    def _result(self, case: Case, vehicle: str) -> PositioningResult:
        each = [self._sums(case, n, vehicle) for n in range(len(self._scenarios))]
        statistics = statistics_of([sums for sums in each if sums is not None])
        return PositioningResult(
            case.arm,
            case.estimator,
            preset_of(case.estimator),
            case.sigma_range_m,
            case.radius_m,
            vehicle,
            bound_rmse_m=self._bound(case, vehicle),
            **dataclasses.asdict(statistics),
        )

    def _bound(self, case: Case, vehicle: str) -> float | None:
        squared_m2, count = 0.0, 0
        for n, steps in enumerate(self._work.steps):
            bound = self._found.get(Piece(n, _bound_case(case), 0, 0))
            if not isinstance(bound, JointBound):
                return None
            if vehicle == ALL or vehicle in steps.vehicle:
                some = slice(None) if vehicle == ALL else steps.vehicle.index(vehicle)
                squared_m2 += float(np.sum(bound.squared_m2[some]))
                count += int(np.sum(bound.count[some]))
        return math.sqrt(squared_m2 / count) if count else None

    def _improvement(self, case: Case, vehicle: str) -> PositioningImprovement:
        arms = []
        for arm in RANGING_ARMS:
            layouts: dict[int, list[Sums]] = {}
            for n, scenario in enumerate(self._scenarios):
                sums = self._sums(case._replace(arm=arm), n, vehicle)
                if sums is not None:
                    layouts.setdefault(scenario.layout, []).append(sums)
            arms.append(list(layouts.values()))
        found = improvement(arms[0], arms[1], self._work.seed)
        percent, ci95 = found if found is not None else (None, None)
        return PositioningImprovement(
            str(case.estimator),
            str(preset_of(case.estimator)),
            float(case.sigma_range_m or 0.0),
            float(case.radius_m or 0.0),
            vehicle,
            percent,
            ci95,
        )

    def _layout(self, case: Case, number: int, vehicle: str) -> LayoutImprovement | None:
        """Return what one scenario alone gives; None when the car is not in it or diverged."""
        means_m = []
        for arm in RANGING_ARMS:
            sums = self._sums(case._replace(arm=arm), number, vehicle)
            mean_m = statistics_of([sums]).mean_error_m if sums is not None else None
            if mean_m is None:
                return None
            means_m.append(mean_m)
        scenario = self._scenarios[number]
        return LayoutImprovement(
            scenario.layout,
            scenario.traffic_seed,
            str(case.estimator),
            str(preset_of(case.estimator)),
            float(case.sigma_range_m or 0.0),
            float(case.radius_m or 0.0),
            vehicle,
            traditional_m=means_m[0],
            proposed_m=means_m[1],
        )

    def _cars(self, case: Case) -> CarErrors:
        """Return the mean error of each car of the first scenario."""
        sums = self._sums(case, 0, ALL)
        assert sums is not None
        lost = sums.diverged.any(axis=0)
        count = np.where(lost, 0, sums.count.sum(axis=0))
        with np.errstate(invalid="ignore", divide="ignore"):
            mean_m = np.where(count > 0, sums.error_m.sum(axis=0) / count, np.nan)
        names = np.array(self._work.steps[0].vehicle, dtype=object)
        preset = preset_of(case.estimator)
        return CarErrors(
            case.arm, case.estimator, preset, case.sigma_range_m, case.radius_m, names, mean_m
        )

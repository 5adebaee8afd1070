"""Estimates behind the statistics, for files and figures: one set of tracks for each case."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from covertool.model import PositionTracks
from covertool.positioning import PositioningOptions, Scenario, position_tracks
from covertool.positioning.cases import RANGING_ARMS
from covertool.spread import spread


class TrackCase(NamedTuple):
    """One arm and, where it ranges, its estimator, range noise and zone.

    Attributes
    ----------
    arm, estimator : as in :func:`covertool.positioning.position_errors`
    sigma_m, radius_m : range noise and communication zone in metres
    """

    arm: str
    estimator: str
    sigma_m: float
    radius_m: float


def track_cases(
    arms: Sequence[str],
    estimators: Sequence[str],
    sigmas_m: Sequence[float],
    radii_m: Sequence[float],
) -> list[TrackCase]:
    """Return the cases in the order of the report; an arm that does not range is one case.

    >>> [case.arm for case in track_cases(("traditional", "gps"), ("ekf",), (0.2, 4.0), (15.0,))]
    ['traditional', 'traditional', 'gps']
    """
    ranging = [
        TrackCase(arm, estimator, sigma_m, radius_m)
        for radius_m in radii_m
        for estimator in estimators
        for sigma_m in sigmas_m
        for arm in arms
        if arm in RANGING_ARMS
    ]
    first = (estimators[0], sigmas_m[0], radii_m[0])
    return ranging + [TrackCase(arm, *first) for arm in arms if arm not in RANGING_ARMS]


@dataclass(frozen=True)
class _Follow:
    """Follows one case over the trace; sent to the workers."""

    scenario: Scenario
    runs: int
    seed: int
    options: PositioningOptions
    vehicles: tuple[str, ...]

    def __call__(self, case: TrackCase) -> PositionTracks:
        return position_tracks(
            self.scenario,
            arm=case.arm,
            estimator=case.estimator,
            sigma_m=case.sigma_m,
            radius_m=case.radius_m,
            runs=self.runs,
            seed=self.seed,
            options=self.options,
            vehicles=self.vehicles,
        )


def follow(
    scenario: Scenario,
    cases: Sequence[TrackCase],
    *,
    runs: int,
    seed: int,
    options: PositioningOptions,
    vehicles: Sequence[str] = (),
    workers: int = 1,
    scheduler: str | None = None,
) -> list[PositionTracks]:
    """Return the tracks of each case, with the noise of the report of this first scenario.

    Parameters
    ----------
    scenario : traffic and parked cars
    cases : what to follow
    runs, seed, options : as in :func:`covertool.positioning.position_errors`
    vehicles : the cars to follow; all when empty
    workers, scheduler : as in :func:`covertool.spread.spread`
    """
    work = _Follow(scenario, runs, seed, options, tuple(vehicles))
    return spread(work, cases, workers=workers, scheduler=scheduler)

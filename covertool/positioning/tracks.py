"""Where each car is, and where GPS and an estimator say: the estimates behind the statistics."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from covertool.model import Floats, PositionTracks
from covertool.positioning.cases import (
    RANGING_ARMS,
    Case,
    Piece,
    Scenario,
    Work,
    check_cases,
    check_vehicles,
)
from covertool.positioning.hearing import Mask
from covertool.positioning.noise import Indices, check_address
from covertool.positioning.options import PositioningOptions
from covertool.positioning.smoothing import Passed


def position_tracks(
    scenario: Scenario,
    *,
    arm: str = "proposed",
    estimator: str = "ekf",
    sigma_m: float = 0.2,
    radius_m: float = 15.0,
    runs: int = 1,
    seed: int = 1,
    options: PositioningOptions | None = None,
    vehicles: Sequence[str] = (),
) -> PositionTracks:
    """Return truth, GPS fixes and estimates of one arm and estimator, step by step.

    The same filter meets the same noise as in :func:`~covertool.positioning.position_errors` of
    this one scenario, so that the statistics of these errors are the ones of its report.

    Parameters
    ----------
    scenario : a trace with its parked cars
    arm, estimator : one of ``ARMS``, and one of ``ESTIMATORS`` or ``module:Name``; an arm that
        does not range has no estimator
    sigma_m, radius_m : standard deviation of the ranges, and communication zone, in metres
    runs, seed : noise runs, each with rows of its own, and seed of the noise
    options : how the paper is read; the defaults when None
    vehicles : ids of the cars to return; all when empty. Every car takes part in any case

    Raises
    ------
    OptionError
        When an option is out of range or names nothing.
    GeometryError
        When the trace is empty or broken.

    Examples
    --------
    >>> from pyproj import CRS
    >>> from covertool.model import Anchors, Trace
    >>> name, still = np.array(["a", "a"], dtype=object), np.zeros(2)
    >>> trace = Trace(np.array([0.0, 1.0]), name, np.array([0.0, 5.0]), still, still + 5, still)
    >>> parked = Anchors.from_points([3.0], [4.0], CRS("EPSG:2157"))
    >>> position_tracks(Scenario(trace, parked), runs=2).to_frame()["run"].tolist()
    [0, 0, 1, 1]
    """
    check_cases([scenario], (arm,), (estimator,), (sigma_m, radius_m))
    check_address(seed, runs)
    options = options or PositioningOptions()
    work = Work([scenario], options, seed)
    check_vehicles(vehicles, work)
    ranges = arm in RANGING_ARMS
    case = Case(arm, estimator, sigma_m, radius_m) if ranges else Case(arm, None, None, None)
    names = np.array(work.steps[0].vehicle, dtype=object)
    wanted = np.isin(names, vehicles) if vehicles else np.ones(names.size, bool)
    blocks = [_block(work, piece, wanted) for piece in work.blocks(0, case, runs)]
    places = np.concatenate([block.places for block in blocks], axis=1).reshape(6, -1)
    return PositionTracks(
        run=np.repeat(np.arange(runs), blocks[0].time_s.size),
        time_s=np.tile(blocks[0].time_s, runs),
        vehicle=np.tile(names[wanted][blocks[0].car], runs),
        true_x_m=places[0],
        true_y_m=places[1],
        gps_x_m=places[2],
        gps_y_m=places[3],
        estimated_x_m=places[4],
        estimated_y_m=places[5],
        arm=case.arm,
        estimator=case.estimator,
        sigma_range_m=case.sigma_range_m,
        radius_m=case.radius_m,
        seed=seed,
    )


class _Block(NamedTuple):
    """Rows of one run, ``time_s`` and ``car`` (of the wanted), and places (6, runs, rows)."""

    time_s: Floats
    car: Indices
    places: Floats


def _block(work: Work, piece: Piece, wanted: Mask) -> _Block:
    """Return the tracks of a block of runs: true, GPS and estimated x and y."""
    steps, runs = work.steps[piece.scenario], piece.runs
    lost = np.zeros((runs, wanted.size), bool)
    times, cars, places = [], [], []
    for passed in work.filtering(piece).estimates():
        estimate = _unless_lost(passed, runs, lost, work.options.divergence_m)
        some = np.flatnonzero(wanted[passed.step.car])
        truth = np.broadcast_to(passed.step.position, (runs, passed.step.car.size, 2))
        fixes = passed.gps.reshape(runs, -1, 2)
        xy = np.concatenate([each[:, some] for each in (truth, fixes, estimate)], axis=2)
        places.append(np.moveaxis(xy, 2, 0))
        times.append(np.full(some.size, passed.step.time))
        cars.append(passed.step.car[some])
    time, car = np.concatenate(times), np.concatenate(cars)
    order = np.lexsort((car, time))  # a filter that looks back ends with the first step
    number = np.cumsum(wanted) - 1
    time_s = steps.first_s + steps.step_s * time[order]
    return _Block(time_s, number[car[order]], np.concatenate(places, axis=2)[:, :, order])


def _unless_lost(passed: Passed, runs: int, lost: Mask, limit_m: float) -> Floats:
    """Return (runs, cars, 2) estimates, NaN from where a car has diverged; marks it in ``lost``."""
    step = passed.step
    estimate = passed.known.position.reshape(runs, -1, 2)
    error = np.hypot(*np.moveaxis(estimate - step.position, 2, 0))
    lost[:, step.car] |= ~(error < limit_m)
    kept: Floats = np.where(lost[:, step.car, None], np.nan, estimate)
    return kept

"""The positioning report as tables: text as in the paper's Tables V to VIII, and a study's own."""

from __future__ import annotations

import statistics
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING

from covertool.model import (
    CarDensity,
    PositioningImprovement,
    PositioningReport,
    PositioningResult,
    PositionTracks,
)

if TYPE_CHECKING:
    import pandas as pd

ESTIMATOR_NAMES = {"gcpso": "GCPSO", "ekf": "EKF", "second_order": "second order"}
ARM_NAMES = {
    "traditional": "traditional",
    "proposed": "proposed",
    "gps": "GPS",
    "gps_odometry": "GPS + odometry",
}
ERROR_COLUMNS = (
    "arm", "estimator", "zone m", "noise m", "mean m", "SD m", "RMSE m", "median m", "p95 m",
    "bound m", "better by %", "95 % interval",
)  # fmt: skip
CAR_COLUMNS = (
    "car", "estimator", "zone m", "noise m", "trad. mean m", "SD m", "prop. mean m", "SD m",
    "better by %",
)  # fmt: skip
DENSITY_COLUMNS = ("car", "parked cars met", "way km", "met per km", "better by %", "SD of layouts")

Row = list[str]
Key = tuple[str, float, float, str]


def error_rows(report: PositioningReport) -> list[Row]:
    """Return one row for each arm, estimator, zone and range noise, over all cars; then bounds."""
    results = [result for result in report.results if result.vehicle == "all"]
    better = {_key(each): each for each in report.improvements}
    rows = [_error_row(result, better) for result in results]
    return rows + _bound_rows(results)


def car_rows(report: PositioningReport, cars: Sequence[str]) -> list[Row]:
    """Return one row for each reported car, estimator, zone and range noise (Tables VI, VII)."""
    by = {(r.arm, *_result_key(r)): r for r in report.results if r.estimator is not None}
    rows = []
    for each in report.improvements:
        if each.vehicle not in cars:
            continue
        arms = [by["traditional", *_key(each)], by["proposed", *_key(each)]]
        errors = [number(value) for arm in arms for value in (arm.mean_error_m, arm.sd_error_m)]
        rows.append([each.vehicle, *_case(each), *errors, number(each.percent)])
    return rows


def density_rows(densities: Sequence[CarDensity]) -> list[Row]:
    """Return the rows of Table VIII, means over the layouts."""
    return [
        [
            each.vehicle,
            number(_mean(each.met), 0),
            number(_mean(each.path_km)),
            number(_mean(each.met_per_km)),
            number(_mean(each.percent)),
            number(statistics.stdev(each.percent) if len(each.percent) > 1 else None),
        ]
        for each in densities
    ]


def tables(report: PositioningReport, densities: Sequence[CarDensity]) -> dict[str, pd.DataFrame]:
    """Return the tables of a study, of those that hold something: nothing in them is rounded.

    ``positioning`` has one row for each result, ``improvements`` one for each improvement, and
    ``parked_met`` one for each reported car and scenario.
    """
    import pandas as pd

    better = [
        {**asdict(each), "ci95_low": low, "ci95_high": high}
        for each in report.improvements
        for low, high in [each.ci95 or (None, None)]
    ]
    met = [
        {"vehicle": each.vehicle, "scenario": number, "met": cars, "path_km": way_km,
         "met_per_km": density, "percent": percent}
        for each in densities
        for number, (cars, way_km, density, percent) in enumerate(
            zip(each.met, each.path_km, each.met_per_km, each.percent, strict=True)
        )
    ]  # fmt: skip
    found = {"positioning": report.to_frame()}
    if better:
        found["improvements"] = pd.DataFrame(better).drop(columns="ci95")
    if met:
        found["parked_met"] = pd.DataFrame(met)
    return found


def track_frame(tracks: PositionTracks) -> pd.DataFrame:
    """Return the estimates of one case with what the case is and their errors in metres."""
    frame = tracks.to_frame()
    frame["error_m"] = tracks.error_m
    for place, name in enumerate(("arm", "estimator", "sigma_range_m", "radius_m")):
        value = getattr(tracks, name)
        missing = "" if name == "estimator" else float("nan")
        frame.insert(place, name, missing if value is None else value)
    return frame


def _mean(values: Sequence[float]) -> float | None:
    return statistics.fmean(values) if values else None


def number(value: float | None, digits: int = 2) -> str:
    """Return a number as text, a dash for none.

    >>> number(1.236), number(None)
    ('1.24', '-')
    """
    return "-" if value is None or value != value else f"{value:.{digits}f}"


def _error_row(result: PositioningResult, better: Mapping[Key, PositioningImprovement]) -> Row:
    """Return one row of the table of errors."""
    found = better.get(_result_key(result)) if result.arm == "proposed" else None
    errors = (
        result.mean_error_m, result.sd_error_m, result.rmse_m, result.median_error_m,
        result.p95_error_m, result.bound_rmse_m,
    )  # fmt: skip
    interval = "-"
    if found is not None and found.ci95 is not None:
        interval = f"{found.ci95[0]:.2f} to {found.ci95[1]:.2f}"
    return [
        ARM_NAMES[result.arm],
        *_case(result),
        *map(number, errors),
        number(found.percent if found is not None else None),
        interval,
    ]


def _bound_rows(results: Sequence[PositioningResult]) -> list[Row]:
    """Return the bounds by themselves: estimators that measure the same share one."""
    found: dict[tuple[str, bool, float | None, float | None, float], list[str]] = {}
    for result in results:
        if result.bound_rmse_m is not None:
            best = result.preset == "best"
            key = (result.arm, best, result.radius_m, result.sigma_range_m, result.bound_rmse_m)
            found.setdefault(key, []).append(_estimator(result))
    rows = []
    for (arm, _, radius_m, sigma_m, bound_m), names in found.items():
        case = [", ".join(names), _length(radius_m), _length(sigma_m)]
        rows.append([f"bound, {ARM_NAMES[arm]}", *case, "-", "-", number(bound_m), *["-"] * 5])
    return rows


def _key(each: PositioningImprovement) -> Key:
    return each.estimator, each.sigma_range_m, each.radius_m, each.vehicle


def _result_key(result: PositioningResult) -> Key:
    sigma_m, radius_m = result.sigma_range_m or 0.0, result.radius_m or 0.0
    return str(result.estimator), sigma_m, radius_m, result.vehicle


def _case(each: PositioningResult | PositioningImprovement) -> Row:
    return [_estimator(each), _length(each.radius_m), _length(each.sigma_range_m)]


def _estimator(each: PositioningResult | PositioningImprovement) -> str:
    name = each.estimator
    return "-" if name is None else ESTIMATOR_NAMES.get(name, name)


def _length(value_m: float | None) -> str:
    return "-" if value_m is None else f"{value_m:g}"

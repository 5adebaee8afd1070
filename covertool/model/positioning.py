"""The trace of moving cars and what their positioning comes to."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from covertool.model.tables import Floats, Integers, Objects, Table

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Trace(Table):
    """True positions and velocities of moving cars at equal time steps, one row a car and step.

    Rows come in any order; a car is in the trace from its first to its last row.

    Attributes
    ----------
    time_s : (N,) seconds; whole multiples of ``step_s`` apart
    vehicle : (N,) object array of str
    x_m, y_m : (N,) centre of the car in metres
    vx, vy : (N,) velocity in metres per second at that time
    step_s : seconds between two steps

    Examples
    --------
    >>> zeros = np.zeros(2)
    >>> car = np.array(["car1", "car1"], dtype=object)
    >>> trace = Trace(np.array([0.0, 1.0]), car, np.array([0.0, 9.0]), zeros, zeros + 9, zeros)
    >>> len(trace), trace.to_frame()["x_m"].tolist()
    (2, [0.0, 9.0])
    """

    time_s: Floats
    vehicle: Objects
    x_m: Floats
    y_m: Floats
    vx: Floats
    vy: Floats
    step_s: float = 1.0

    _not_columns = ("step_s",)

    def to_frame(self) -> pd.DataFrame:
        """Return the trace as a table, one row a car and step."""
        import pandas as pd

        return pd.DataFrame(self.columns())


@dataclass(frozen=True)
class PositionTracks(Table):
    """Where cars are, where GPS says and where an estimator says, one row a run, car and step.

    Rows are in the order of run, time and car.

    Attributes
    ----------
    run : (N,) number of the noise run, from 0
    time_s : (N,) seconds, as in the trace
    vehicle : (N,) object array of str
    true_x_m, true_y_m : (N,) centre of the car in metres
    gps_x_m, gps_y_m : (N,) its GPS fix
    estimated_x_m, estimated_y_m : (N,) the estimate; NaN for a car from where it diverged
    arm, estimator, sigma_range_m, radius_m : as in :class:`PositioningResult`
    seed : of the noise
    """

    run: Integers
    time_s: Floats
    vehicle: Objects
    true_x_m: Floats
    true_y_m: Floats
    gps_x_m: Floats
    gps_y_m: Floats
    estimated_x_m: Floats
    estimated_y_m: Floats
    arm: str
    estimator: str | None
    sigma_range_m: float | None
    radius_m: float | None
    seed: int

    _not_columns = ("arm", "estimator", "sigma_range_m", "radius_m", "seed")

    @property
    def error_m(self) -> Floats:
        """Absolute error of each estimate in metres."""
        error: Floats = np.hypot(
            self.estimated_x_m - self.true_x_m, self.estimated_y_m - self.true_y_m
        )
        return error

    def to_frame(self) -> pd.DataFrame:
        """Return the tracks as a table, one row a run, car and step."""
        import pandas as pd

        return pd.DataFrame(self.columns())


@dataclass(frozen=True)
class PositioningResult:
    """The position errors of one arm, estimator, range noise and zone, of one car or of all.

    Attributes
    ----------
    arm : traditional, proposed, gps or gps_odometry
    estimator, preset, sigma_range_m, radius_m : None for the arms that do not range
    vehicle : a car's id, or ``all``
    samples : car-steps over all runs, layouts and traffic seeds
    diverged : cars that diverged, counted once a run; when there are any, the errors are None
    mean_error_m, sd_error_m : of the pooled absolute error (what the paper prints)
    rmse_m, median_error_m, p95_error_m : of the same pooled absolute error
    bound_rmse_m : root of the mean posterior Cramér-Rao bound; None when it was not computed
    nees : mean normalised squared error, 2 for an honest filter; None without a covariance
    """

    arm: str
    estimator: str | None
    preset: str | None
    sigma_range_m: float | None
    radius_m: float | None
    vehicle: str
    samples: int
    diverged: int
    mean_error_m: float | None
    sd_error_m: float | None
    rmse_m: float | None
    median_error_m: float | None
    p95_error_m: float | None
    bound_rmse_m: float | None = None
    nees: float | None = None

    @property
    def rmse_over_bound(self) -> float | None:
        """RMSE over its lower bound; None when either is unknown."""
        if self.rmse_m is None or not self.bound_rmse_m:
            return None
        return self.rmse_m / self.bound_rmse_m


@dataclass(frozen=True)
class PositioningImprovement:
    """What parked cars take off the mean error: 100 (1 - proposed / traditional), in percent.

    Attributes
    ----------
    estimator, preset, sigma_range_m, radius_m, vehicle : as in :class:`PositioningResult`
    percent : None when a car of either arm diverged
    ci95 : 95 % bootstrap interval of ``percent``, nested over layouts, traffic seeds and runs; None
        when there is but one run, or a car diverged
    """

    estimator: str
    preset: str
    sigma_range_m: float
    radius_m: float
    vehicle: str
    percent: float | None
    ci95: tuple[float, float] | None


@dataclass(frozen=True)
class LayoutImprovement:
    """What parked cars save in one scenario: one layout of parked cars with one traffic.

    Attributes
    ----------
    layout, traffic_seed : which scenario
    estimator, preset, sigma_range_m, radius_m, vehicle : as in :class:`PositioningResult`
    traditional_m, proposed_m : mean error without and with parked cars in metres

    Examples
    --------
    >>> LayoutImprovement(0, 1, "ekf", "paper", 0.2, 15.0, "all", 8.0, 4.0).percent
    50.0
    """

    layout: int
    traffic_seed: int
    estimator: str
    preset: str
    sigma_range_m: float
    radius_m: float
    vehicle: str
    traditional_m: float
    proposed_m: float

    @property
    def percent(self) -> float | None:
        """Improvement of the mean error in percent; None when there was no error to improve."""
        if self.traditional_m <= 0:
            return None
        return 100 * (1 - self.proposed_m / self.traditional_m)


@dataclass(frozen=True)
class CarErrors:
    """The mean position error of every car of the first scenario, over its steps and all runs.

    Attributes
    ----------
    arm, estimator, preset, sigma_range_m, radius_m : as in :class:`PositioningResult`
    vehicle : (N,) object array of str
    mean_error_m : (N,) in metres; NaN for a car that diverged
    """

    arm: str
    estimator: str | None
    preset: str | None
    sigma_range_m: float | None
    radius_m: float | None
    vehicle: Objects
    mean_error_m: Floats


@dataclass(frozen=True)
class CarDensity:
    """The parked cars that a car met on its way, and what they saved it (the paper's Table VIII).

    Attributes
    ----------
    vehicle : the car's id
    met, path_km : (N,) parked cars met and way in kilometres, in each scenario that has the car
    percent : (N,) its mean improvement there over estimators, range noises and zones

    Examples
    --------
    >>> CarDensity("car1", met=(12,), path_km=(1.5,), percent=(8.0,)).met_per_km
    (8.0,)
    """

    vehicle: str
    met: tuple[int, ...]
    path_km: tuple[float, ...]
    percent: tuple[float, ...]

    @property
    def met_per_km(self) -> tuple[float, ...]:
        """Parked cars met per kilometre; NaN for a car that never moved."""
        return tuple(
            met / way_km if way_km > 0 else float("nan")
            for met, way_km in zip(self.met, self.path_km, strict=True)
        )


@dataclass(frozen=True)
class PositioningReport:
    """Position errors of every arm, estimator, range noise and zone, and what parked cars save.

    Attributes
    ----------
    vehicles, anchors, steps : cars, anchors and time steps of the first scenario
    scenarios, runs : pairs of traffic and parked layout, and noise runs of each
    seed : of the noise
    results, improvements : the tables
    layouts : the improvements of each scenario alone
    cars : the mean error of every car of the first scenario
    options : the options as plain values
    battery_hours, mean_stay_h : how long a parked car can serve, and how long it stays on average
    estimate_seconds, bound_seconds : time that both took; no part of a comparison
    """

    vehicles: int
    anchors: int
    steps: int
    scenarios: int
    runs: int
    seed: int
    results: tuple[PositioningResult, ...]
    improvements: tuple[PositioningImprovement, ...]
    options: dict[str, Any]
    battery_hours: float
    mean_stay_h: float
    layouts: tuple[LayoutImprovement, ...] = ()
    cars: tuple[CarErrors, ...] = field(default=(), repr=False, compare=False)
    estimate_seconds: float = field(default=0.0, compare=False)
    bound_seconds: float | None = field(default=None, compare=False)

    def to_frame(self) -> pd.DataFrame:
        """Return one row for each result."""
        import pandas as pd

        return pd.DataFrame(
            [vars(result) | {"rmse_over_bound": result.rmse_over_bound} for result in self.results]
        )

"""The paper's Tables II and IV to VIII, as they are printed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class PaperErrors:
    """One row of Tables V to VII: errors of one estimator with and without parked cars.

    Attributes
    ----------
    estimator : gcpso or ekf
    sigma_range_m, radius_m : range noise and communication zone in metres
    car : 1 to 5 in Tables VI and VII, 0 for the target car of Table V
    traditional_m, proposed_m : mean and standard deviation of the error in metres
    percent : the printed average improvement
    """

    estimator: str
    sigma_range_m: float
    radius_m: float
    car: int
    traditional_m: tuple[float, float]
    proposed_m: tuple[float, float]
    percent: float


@dataclass(frozen=True)
class PaperDensity:
    """One row of Table VIII: parked cars that a car met, its way, and what they saved it."""

    car: int
    parked_met: int
    path_km: float
    met_per_km: float
    percent: float


@dataclass(frozen=True)
class BatteryClaim:
    """Section II-1: a share of a car battery feeds an on-board unit for so many hours."""

    capacity_wh: float
    share: float
    load_w: float
    hours: float


TABLE_2: Mapping[str, tuple[float, float]] = {
    "A": (0.0, 15.0),
    "B": (10.0, 100.0),
    "C": (20.0, 400.0),
    "D": (28.8, 1000.0),
}
"""Table II: greatest output power in dBm and communication zone in metres of a device class."""

BATTERY = BatteryClaim(capacity_wh=480.0, share=0.10, load_w=1.0, hours=48.0)
"""Section II-1: at most 10 % of a 480 Wh battery power a 1 W unit for up to two days."""

TABLE_4_PERCENT: Mapping[float, tuple[float, float, float, float]] = {
    15.0: (45.43, 14.81, 11.98, 27.78),
    100.0: (2.45, 0.31, 0.22, 97.02),
}
"""Table IV: percent of the transit area at Levels 0, 1, 2, 3 by radius in metres."""

TABLE_5: tuple[PaperErrors, ...] = (
    PaperErrors("gcpso", 0.2, 15.0, 0, (6.92, 4.05), (6.31, 3.75), 8.74),
    PaperErrors("gcpso", 4.0, 15.0, 0, (8.00, 4.37), (7.62, 4.33), 4.82),
    PaperErrors("ekf", 0.2, 15.0, 0, (7.63, 4.47), (6.88, 4.50), 9.92),
    PaperErrors("ekf", 4.0, 15.0, 0, (7.78, 4.17), (7.18, 4.12), 7.65),
    PaperErrors("gcpso", 0.2, 100.0, 0, (6.84, 4.12), (3.49, 2.57), 49.04),
    PaperErrors("gcpso", 4.0, 100.0, 0, (13.69, 8.19), (8.22, 5.46), 39.92),
    PaperErrors("ekf", 0.2, 100.0, 0, (5.98, 3.27), (3.26, 2.26), 45.45),
    PaperErrors("ekf", 4.0, 100.0, 0, (7.65, 4.34), (5.15, 3.32), 32.71),
)
"""Table V: the small scenario, errors of the target car."""

TABLE_6: tuple[PaperErrors, ...] = (
    PaperErrors("gcpso", 0.2, 15.0, 1, (8.30, 7.14), (6.92, 7.11), 16.59),
    PaperErrors("gcpso", 0.2, 15.0, 2, (8.63, 5.23), (6.71, 5.71), 22.20),
    PaperErrors("gcpso", 0.2, 15.0, 3, (9.44, 7.26), (5.79, 6.87), 38.71),
    PaperErrors("gcpso", 0.2, 15.0, 4, (9.80, 7.16), (5.48, 5.57), 44.05),
    PaperErrors("gcpso", 0.2, 15.0, 5, (10.67, 7.20), (3.96, 5.22), 62.86),
    PaperErrors("gcpso", 4.0, 15.0, 1, (9.30, 7.03), (8.35, 6.53), 10.22),
    PaperErrors("gcpso", 4.0, 15.0, 2, (8.92, 5.23), (7.91, 5.82), 11.30),
    PaperErrors("gcpso", 4.0, 15.0, 3, (9.70, 7.30), (7.47, 6.93), 23.06),
    PaperErrors("gcpso", 4.0, 15.0, 4, (9.83, 7.10), (6.92, 5.02), 29.57),
    PaperErrors("gcpso", 4.0, 15.0, 5, (11.4, 7.09), (5.78, 4.56), 49.49),
)
"""Table VI: the large scenario with GCPSO, the five cars with the longest routes."""

TABLE_7: tuple[PaperErrors, ...] = (
    PaperErrors("ekf", 0.2, 15.0, 1, (7.77, 6.67), (7.22, 7.25), 7.06),
    PaperErrors("ekf", 0.2, 15.0, 2, (7.44, 4.20), (6.69, 5.62), 10.19),
    PaperErrors("ekf", 0.2, 15.0, 3, (9.12, 7.75), (5.99, 7.11), 34.32),
    PaperErrors("ekf", 0.2, 15.0, 4, (9.17, 6.88), (5.74, 6.17), 37.37),
    PaperErrors("ekf", 0.2, 15.0, 5, (10.84, 6.76), (3.65, 5.12), 66.35),
    PaperErrors("ekf", 4.0, 15.0, 1, (8.18, 7.69), (7.87, 6.13), 3.81),
    PaperErrors("ekf", 4.0, 15.0, 2, (8.76, 6.43), (8.13, 7.34), 7.12),
    PaperErrors("ekf", 4.0, 15.0, 3, (9.80, 7.59), (7.03, 7.06), 28.21),
    PaperErrors("ekf", 4.0, 15.0, 4, (9.76, 6.93), (7.10, 5.42), 27.23),
    PaperErrors("ekf", 4.0, 15.0, 5, (10.19, 7.01), (5.37, 5.13), 47.23),
)
"""Table VII: the large scenario with EKF, the five cars with the longest routes."""

TABLE_8: tuple[PaperDensity, ...] = (
    PaperDensity(1, 6, 2.34, 2.57, 9.42),
    PaperDensity(2, 18, 2.62, 6.86, 12.70),
    PaperDensity(3, 51, 4.21, 12.11, 31.08),
    PaperDensity(4, 58, 5.10, 11.37, 34.56),
    PaperDensity(5, 97, 3.23, 30.05, 56.48),
)
"""Table VIII: parked cars met by the five cars, and the mean of their four improvements."""

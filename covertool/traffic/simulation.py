"""The whole experiment: traffic, parked cars, and what they take off the cars' position errors."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from statistics import fmean
from typing import TYPE_CHECKING

import numpy as np

from covertool import crs as crs_door
from covertool.errors import CrsError, GeometryError, OptionError
from covertool.model import Anchors, CarDensity, PositioningReport
from covertool.positioning import ARMS, ESTIMATORS, PositioningOptions, Scenario, position_errors
from covertool.traffic.encounters import Encounters, encounters
from covertool.traffic.layouts import parked_layouts
from covertool.traffic.mobility import Mobility
from covertool.traffic.vicinity import box_text

if TYPE_CHECKING:
    import pandas as pd

SIGMAS_M = (0.2, 4.0)
"""Range noises of the paper: UWB and radio ranging."""

RADII_M = {"campus": (15.0, 100.0), "town": (15.0,)}
"""The paper's communication zones, by scenario."""

GPS_RESET_S = {"campus": 1.0, "town": 10.0}
"""An isolated car takes its GPS fix every so many seconds ("occasionally", says the paper)."""

LONGEST = 5
"""The paper reports the five cars with the longest routes."""


@dataclass(frozen=True)
class Simulation:
    """What parked cars take off the position errors of moving cars in one traffic or several.

    Attributes
    ----------
    mobilities : the traffic, one for each traffic seed
    scenarios : each traffic with each layout of parked cars
    report : the tables
    vehicles : the cars that are reported one by one
    met : the ways of the cars and the parked cars that they met, one for each scenario
    seconds : time of ``sumo``, ``positioning`` and, when it was computed, ``bound``
    """

    mobilities: tuple[Mobility, ...]
    scenarios: tuple[Scenario, ...] = field(repr=False)
    report: PositioningReport = field(repr=False)
    vehicles: tuple[str, ...]
    met: tuple[Encounters, ...] = field(repr=False)
    seconds: dict[str, float] = field(compare=False)

    @property
    def anchors(self) -> Anchors:
        """The parked cars of the first scenario."""
        return self.scenarios[0].anchors

    def densities(self) -> tuple[CarDensity, ...]:
        """Return for each reported car what it met and what that saved it, in each scenario."""
        return tuple(self._density(vehicle) for vehicle in self.vehicles)

    def _density(self, vehicle: str) -> CarDensity:
        """Return what a car met and what that saved it, in each scenario that has it."""
        rows = []
        for scenario, met in zip(self.scenarios, self.met, strict=True):
            percents = [
                each.percent
                for each in self.report.layouts
                if each.vehicle == vehicle
                and (each.layout, each.traffic_seed) == (scenario.layout, scenario.traffic_seed)
                and each.percent is not None
            ]
            if percents:
                row = met.row(vehicle)
                rows.append((int(met.met[row]), float(met.path_km[row]), fmean(percents)))
        met_cars, path_km, percent = zip(*rows, strict=True) if rows else ((), (), ())
        return CarDensity(vehicle, met_cars, path_km, percent)

    def to_frame(self) -> pd.DataFrame:
        """Return one row for each arm, estimator, range noise, zone and reported car."""
        return self.report.to_frame()


def simulate(
    mobility: Mobility | Sequence[Mobility],
    anchors: Anchors,
    *,
    arms: Sequence[str] = ARMS,
    estimators: Sequence[str] = ESTIMATORS,
    sigmas_m: Sequence[float] = SIGMAS_M,
    radii_m: Sequence[float] = RADII_M["town"],
    runs: int = 40,
    seed: int = 1,
    options: PositioningOptions | None = None,
    layouts: int = 1,
    penetration: float = 1.0,
    vehicles: Sequence[str] = (),
    bound: bool = True,
    workers: int = 1,
    scheduler: str | None = None,
    on_start: Callable[[int], object] | None = None,
    on_done: Callable[[int], object] | None = None,
) -> Simulation:
    """Return the position errors of cars in traffic, with and without parked cars.

    Every arm is evaluated on the same trace: parked cars that stand in SUMO would change the
    traffic itself. ``gcpso`` and ``ekf`` run as the paper does, ``second_order`` with all that
    can be known.

    Parameters
    ----------
    mobility : traffic from :func:`~covertool.traffic.mobility.drive` or ``recorded``; several
        stand for several traffic seeds
    anchors : the parked cars, in the CRS of the traffic
    arms, estimators, sigmas_m, radii_m, runs, seed, options, bound : as in
        :func:`covertool.positioning.position_errors`
    layouts, penetration : see :func:`~covertool.traffic.layouts.parked_layouts`
    vehicles : cars to report one by one; the five with the longest ways when empty
    workers, scheduler, on_start, on_done : they do not change a bit of the result

    Raises
    ------
    CrsError
        When parked cars and traffic are not in one CRS.
    OptionError, GeometryError
        When an option is out of range, or the trace is empty or broken.

    Examples
    --------
    >>> from covertool.gis.read import read_anchors
    >>> from covertool.gis.sample import SAMPLE_STUDY, SAMPLE_TRACE, sample_folder
    >>> from covertool.traffic.mobility import recorded
    >>> traffic = recorded(sample_folder() / SAMPLE_TRACE, crs="EPSG:2157", horizon_s=10.0)
    >>> parked = read_anchors(sample_folder() / SAMPLE_STUDY, dst_crs=traffic.crs)
    >>> found = simulate(
    ...     traffic, parked, estimators=["ekf"], sigmas_m=[0.2], runs=2, bound=False
    ... )
    >>> sorted({result.arm for result in found.report.results})
    ['gps', 'gps_odometry', 'proposed', 'traditional']
    """
    mobilities = (mobility,) if isinstance(mobility, Mobility) else tuple(mobility)
    _require_one_crs(mobilities, anchors)
    if not radii_m:
        raise OptionError("there is no communication zone", "radii_m", "give one in metres")
    scenarios = _scenarios(mobilities, anchors, layouts, penetration, seed)
    met = tuple(encounters(each.trace, each.anchors, float(radii_m[0])) for each in scenarios)
    named = tuple(vehicles) or met[0].longest(LONGEST)
    begun = time.perf_counter()
    report = position_errors(
        scenarios, arms=arms, estimators=estimators, sigmas_m=sigmas_m, radii_m=radii_m, runs=runs,
        seed=seed, options=options, vehicles=named, bound=bound, workers=workers,
        scheduler=scheduler, on_start=on_start, on_done=on_done,
    )  # fmt: skip
    seconds = _seconds(mobilities, report, time.perf_counter() - begun)
    return Simulation(mobilities, scenarios, report, named, met, seconds)


def _scenarios(
    mobilities: Sequence[Mobility], anchors: Anchors, layouts: int, penetration: float, seed: int
) -> tuple[Scenario, ...]:
    """Return each traffic with each layout of the parked cars."""
    network = mobilities[0].network
    parked = parked_layouts(anchors, layouts, share=penetration, seed=seed, network=network)
    return tuple(
        Scenario(each.trace, layout, layout=number, traffic_seed=int(each.facts.get("seed") or 0))
        for number, layout in enumerate(parked)
        for each in mobilities
    )


def _seconds(
    mobilities: Sequence[Mobility], report: PositioningReport, took_s: float
) -> dict[str, float]:
    """Return what took how long; the bound apart where it was computed."""
    seconds = {
        "sumo": sum(float(each.facts.get("seconds") or 0.0) for each in mobilities),
        "positioning": took_s - (report.bound_seconds or 0.0),
    }
    return seconds if report.bound_seconds is None else seconds | {"bound": report.bound_seconds}


def require_reach(mobilities: Sequence[Mobility], anchors: Anchors, radius_m: float) -> None:
    """Refuse parked cars that no car of the traffic could ever hear.

    Raises
    ------
    GeometryError
        When no anchor is within ``radius_m`` of any car at any step; both boxes are told.
    """
    from scipy.spatial import cKDTree

    if len(anchors):
        tree = cKDTree(np.stack([anchors.x_m, anchors.y_m], axis=1))
        for each in mobilities:
            xy = np.stack([each.trace.x_m, each.trace.y_m], axis=1)
            if np.isfinite(tree.query(xy, distance_upper_bound=radius_m)[0]).any():
                return
    trace = mobilities[0].trace
    raise GeometryError(
        f"no anchor is within {radius_m:g} m of any car's way",
        f"{len(anchors)} anchors in {box_text(anchors.x_m, anchors.y_m)}, "
        f"cars in {box_text(trace.x_m, trace.y_m)} ({crs_door.name(mobilities[0].crs)})",
        "check the CRS of both, use a larger --radius, or add --allow-unheard to go on without",
    )


def _require_one_crs(mobilities: Sequence[Mobility], anchors: Anchors) -> None:
    if not mobilities:
        raise OptionError("there is no traffic", "mobility", "give at least one")
    for each in mobilities:
        if each.crs != anchors.crs:
            raise CrsError(
                f"the traffic is in {crs_door.name(each.crs)}, the anchors are in "
                f"{crs_door.name(anchors.crs)}",
                "simulate",
                "read the anchors with dst_crs=mobility.crs",
            )

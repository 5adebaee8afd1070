"""The paper's two scenarios on the sample town, once for each layout."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from covertool.model import Anchors
from covertool.positioning import PositioningOptions
from covertool.spread import Ledger, spread

if TYPE_CHECKING:
    import geopandas as gpd

    from covertool.traffic.edges import Network
    from covertool.traffic.simulation import Simulation


class Errors(NamedTuple):
    """Mean and standard deviation of the error in both arms; None where a car diverged."""

    traditional_m: tuple[float | None, float | None]
    proposed_m: tuple[float | None, float | None]
    percent: float | None


class Met(NamedTuple):
    """What one of the five cars met on its way."""

    parked: int
    path_km: float


@dataclass(frozen=True)
class LayoutResult:
    """What one layout gives.

    Attributes
    ----------
    errors : by (estimator, range noise, zone, car); car 0 is all cars, 1 to 5 are the five with
        the longest ways in the order of the parked cars that they met, the fewest first
    met : by car, 1 to 5
    gps_m, gps_odometry_m : mean error of all cars without any range
    anchors, vehicles : how many
    """

    errors: dict[tuple[str, float, float, int], Errors]
    met: dict[int, Met]
    gps_m: float | None
    gps_odometry_m: float | None
    anchors: int
    vehicles: int


class _Piece(NamedTuple):
    scenario: str
    seed: int


@dataclass(frozen=True)
class _Run:
    """Drives and positions one layout; sent to the workers."""

    network: Network
    anchors: Anchors
    estimators: tuple[str, ...]
    runs: int

    def __call__(self, piece: _Piece) -> LayoutResult:
        from covertool.traffic.demand import campus_demand, town_demand
        from covertool.traffic.layouts import parked_layouts
        from covertool.traffic.mobility import drive
        from covertool.traffic.simulation import GPS_RESET_S, RADII_M, SIGMAS_M, simulate
        from covertool.traffic.vicinity import anchors_along

        make = campus_demand if piece.scenario == "campus" else town_demand
        mobility = drive(self.network, make(self.network, seed=piece.seed), seed=piece.seed)
        beside = anchors_along(self.anchors, self.network, mobility.circuit)
        # Two are drawn, of which one is taken: one alone would be the study as it is.
        layout = parked_layouts(beside, 2, seed=piece.seed, network=self.network)[0]
        found = simulate(
            mobility,
            layout,
            estimators=self.estimators,
            sigmas_m=SIGMAS_M,
            radii_m=RADII_M[piece.scenario],
            runs=self.runs,
            seed=piece.seed,
            options=PositioningOptions(gps_reset_s=GPS_RESET_S[piece.scenario]),
            bound=False,
        )
        return _result(found)


def run_layouts(
    scenarios: Sequence[str],
    streets: gpd.GeoDataFrame,
    anchors: Anchors,
    *,
    layouts: int,
    estimators: Sequence[str],
    runs: int,
    workers: int = 1,
    scheduler: str | None = None,
    ledger: Ledger | None = None,
    on_done: Callable[[int], object] | None = None,
) -> dict[str, list[LayoutResult]]:
    """Return what each layout gives in each scenario: seeds 1 to ``layouts``, none picked.

    A seed draws the traffic, the way by which the parked cars are moved along their streets, and
    the noise.

    Parameters
    ----------
    scenarios : of campus and town
    streets : centre lines of the sample study
    anchors : its parked cars, in the CRS of the streets
    estimators, runs : as in :func:`covertool.positioning.position_errors`
    workers, scheduler, ledger, on_done : see :func:`covertool.spread.spread`
    """
    from covertool.traffic.network import network_from_streets

    with tempfile.TemporaryDirectory(prefix="covertool-") as folder:
        network = network_from_streets(streets, Path(folder))
        work = _Run(network, anchors, tuple(estimators), runs)
        pieces = [_Piece(name, seed + 1) for name in scenarios for seed in range(layouts)]
        found = spread(
            work, pieces, workers=workers, scheduler=scheduler, ledger=ledger, on_done=on_done
        )
    results: dict[str, list[LayoutResult]] = {name: [] for name in scenarios}
    for piece, result in zip(pieces, found, strict=True):
        results[piece.scenario].append(result)
    return results


def _result(found: Simulation) -> LayoutResult:
    """Return what the tables need of a simulation, its cars numbered as the paper's are."""
    report, met = found.report, found.met[0]
    ways = {name: Met(int(met.met[met.row(name)]), float(met.path_km[met.row(name)]))
            for name in found.vehicles}  # fmt: skip
    order = sorted(ways, key=lambda name: (ways[name].parked, name))
    number = {"all": 0} | {name: place for place, name in enumerate(order, 1)}
    means = {
        (r.arm, r.estimator, r.sigma_range_m, r.radius_m, r.vehicle): (r.mean_error_m, r.sd_error_m)
        for r in report.results
    }
    errors = {}
    for each in report.improvements:
        key = (each.estimator, each.sigma_range_m, each.radius_m)
        arms = [means[arm, *key, each.vehicle] for arm in ("traditional", "proposed")]
        errors[(*key, number[each.vehicle])] = Errors(arms[0], arms[1], each.percent)
    return LayoutResult(
        errors,
        {number[name]: way for name, way in ways.items()},
        means["gps", None, None, None, "all"][0],
        means["gps_odometry", None, None, None, "all"][0],
        report.anchors,
        report.vehicles,
    )

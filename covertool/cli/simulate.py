"""`covertool simulate`: real traffic, parked cars, and what they take off the position errors."""

from __future__ import annotations

import time
from contextlib import ExitStack
from typing import TYPE_CHECKING

from covertool.cli import options
from covertool.cli import simulate_options as own
from covertool.cli.app import app
from covertool.cli.console import print_json, progress
from covertool.cli.coverage import Classes
from covertool.cli.simulate_asked import Asked, check
from covertool.cli.simulate_case import Case, read_case
from covertool.cli.simulate_experiment import Experiment, choose_experiment
from covertool.cli.simulate_files import Files
from covertool.cli.simulate_output import json_content, print_simulation
from covertool.cli.target import Target

if TYPE_CHECKING:
    from covertool.traffic.simulation import Simulation


@app.command(epilog=own.READINGS)
def simulate(
    study: options.Study = None,
    net: own.Net = None,
    osm: own.Osm = None,
    fcd: own.Fcd = None,
    anchors: options.AnchorFiles = None,
    scenario: own.Scenario = None,
    routes: own.Routes = None,
    horizon: own.Horizon = None,
    traffic_seed: own.TrafficSeed = None,
    net_crs: own.NetCrs = None,
    driving_side: own.DrivingSide = None,
    timeout: own.Timeout = 600.0,
    anchors_as: own.AnchorsAs = "points",
    along: own.Along = None,
    allow_unheard: own.Unheard = False,
    queue_anchors: own.QueueAnchors = False,
    penetration: own.Penetration = 1.0,
    layouts: own.Layouts = 1,
    radius: own.Radii = None,
    device_class: Classes = None,
    arm: own.Arms = None,
    estimator: own.Estimators = None,
    preset: own.Preset = None,
    sigma_range: own.SigmaRange = None,
    sigma_gps: own.SigmaGps = 6.0,
    gps_tau: own.GpsTau = 0.0,
    reading: own.Reading = None,
    runs: own.Runs = 40,
    seed: own.NoiseSeed = 1,
    vehicle: own.Vehicles = None,
    no_bound: own.NoBound = False,
    workers: options.Workers = 1,
    scheduler: options.Scheduler = None,
    output: options.Output = None,
    into: options.Into = None,
    overwrite: options.Overwrite = False,
    result_table: own.ResultTable = None,
    traces: own.Traces = None,
    trace_runs: own.TraceRuns = 1,
    additional: own.Additional = None,
    fcd_out: own.FcdOut = None,
    edge_data: own.EdgeData = None,
    plot: own.Plot = None,
    plot_density: own.PlotDensity = None,
    as_json: options.Json = False,
    crs: options.Crs = None,
) -> None:
    """Position errors of cars in SUMO traffic, with and without the help of parked cars.

    \b
    Examples:
      covertool simulate
      covertool simulate town.gpkg --osm town.osm.pbf --radius 15 --radius 100 --into town.gpkg
      covertool simulate --net city.net.xml.gz --anchors cars.csv --crs EPSG:25832 --workers 2
      covertool simulate --fcd run.csv --net city.net.xml --anchors study.gpkg --no-bound --json
      covertool simulate --scenario campus --layouts 30 --plot-density density.png

    \b
    SUMO drives once, and every arm is evaluated on that one trace: "traditional" hears only moving
    cars, "proposed" also the parked ones, "gps" and "gps_odometry" hear nobody. gcpso and ekf run
    as the paper does; second_order takes all that can be known, and the bound (PCRB) is what no
    filter can beat. Without the extra 'simulate' only the shipped trace and --fcd work.
    -o FILE.gpkg holds the parked cars, the streets (segments), layer trajectories and the tables
    positioning, improvements and parked_met; --into adds the last four. --traces, --fcd-out
    and --plot estimate again, with the same noise. The same seeds give the same bytes.
    """
    begun = time.perf_counter()
    asked = Asked(
        study, tuple(anchors or ()), crs, net, osm, fcd, net_crs, driving_side, scenario,
        tuple(routes or ()), horizon, tuple(dict.fromkeys(traffic_seed or (1,))), anchors_as,
        timeout, along, allow_unheard, queue_anchors,
    )  # fmt: skip
    files = Files(
        Target(output, into, overwrite), result_table, traces, trace_runs, additional, fcd_out,
        edge_data, plot, plot_density,
    )  # fmt: skip
    check(asked)
    files.check(recorded=fcd is not None)
    experiment = choose_experiment(
        asked.kind, radius=radius, device_class=device_class, arms=arm, estimators=estimator,
        preset=preset, sigmas_m=sigma_range, sigma_gps_m=sigma_gps, gps_tau_s=gps_tau,
        readings=reading, runs=runs, seed=seed, layouts=layouts, penetration=penetration,
        vehicles=vehicle, bound=not no_bound,
    )  # fmt: skip
    case = read_case(asked)
    if not allow_unheard:
        _require_reach(case, experiment)
    found = _simulate(case, experiment, workers, scheduler)
    computed = time.perf_counter()
    files.write(case, experiment, found, workers=workers)
    now = time.perf_counter()
    seconds = {**found.seconds, "writing": now - computed, "total": now - begun}
    if as_json:
        print_json("simulate", {**json_content(case, found), "seconds": seconds})
    else:
        print_simulation(case, found, seconds)


def _require_reach(case: Case, experiment: Experiment) -> None:
    """Refuse parked cars that nobody can hear, where an arm is about hearing them."""
    from covertool.traffic.simulation import require_reach

    if "proposed" in experiment.arms:
        require_reach(case.mobilities, case.anchors, max(experiment.radii_m))


def _simulate(
    case: Case, experiment: Experiment, workers: int, scheduler: str | None
) -> Simulation:
    """Position the cars, behind a bar that begins once the number of pieces is known."""
    from covertool.traffic.simulation import simulate

    with ExitStack() as bars:
        advance = []
        return simulate(
            case.mobilities,
            case.anchors,
            **vars(experiment),
            workers=workers,
            scheduler=scheduler,
            on_start=lambda pieces: advance.append(
                bars.enter_context(progress("positioning", pieces))
            ),
            on_done=lambda pieces: advance[0](pieces),
        )

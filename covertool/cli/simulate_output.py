"""What `covertool simulate` prints: the paper's tables, or JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import typer

from covertool.cli.console import print_table, say
from covertool.cli.whence import whence

if TYPE_CHECKING:
    from covertool.cli.simulate_case import Case
    from covertool.model import PositioningResult
    from covertool.traffic.simulation import Simulation

_COUNTS = ("loaded", "inserted", "arrived", "teleports", "collisions")


def print_simulation(case: Case, found: Simulation, seconds: Mapping[str, float]) -> None:
    """Print errors, the reported cars, the parked cars that they met, and what took how long."""
    from covertool.report import positioning_tables as tables

    report = found.report
    synthetic = " (synthetic)" if case.synthetic else ""
    typer.echo(
        f"{case.kind} on {case.source}{synthetic}: {report.vehicles} cars, {report.steps} steps, "
        f"{report.anchors} anchors, {report.runs} noise runs"
        + (f", {report.scenarios} scenarios" if report.scenarios > 1 else "")
    )
    typer.echo(_traffic_text(found))
    print_table(tables.ERROR_COLUMNS, tables.error_rows(report), "\nPosition errors of all cars")
    if report.improvements:
        print_table(
            tables.CAR_COLUMNS,
            tables.car_rows(report, found.vehicles),
            "\nThe reported cars (by default those with the longest routes)",
        )
        print_table(
            tables.DENSITY_COLUMNS,
            tables.density_rows(found.densities()),
            "\nParked cars met, and the mean improvement over estimators and noises",
        )
    typer.echo(
        f"\nA parked car can serve {report.battery_hours:g} h by its battery and stays "
        f"{report.mean_stay_h:g} h on average."
    )
    say("seconds: " + ", ".join(f"{name} {value:.1f}" for name, value in seconds.items()))


def _traffic_text(found: Simulation) -> str:
    texts = []
    for each in found.mobilities:
        facts = each.facts
        counts = [f"{facts[name]} {name}" for name in _COUNTS if facts.get(name) is not None]
        if facts.get("left_out"):
            counts.append(f"{len(facts['left_out'])} left out")
        if facts.get("sumo"):
            texts.append(f"SUMO {facts['sumo']}, seed {facts.get('seed')}: {', '.join(counts)}")
    return "\n".join(texts) or "recorded traffic: SUMO did not run"


def json_content(case: Case, found: Simulation) -> dict[str, Any]:
    """Return the content of ``simulate --json`` but for the seconds."""
    report = found.report
    return {
        "vehicles": report.vehicles,
        "anchors": report.anchors,
        "steps": report.steps,
        "runs": report.runs,
        "scenarios": report.scenarios,
        "scenario": case.kind,
        "source": case.source,
        "synthetic": case.synthetic,
        "seed": report.seed,
        "results": [_result(each) for each in report.results],
        "improvements": [asdict(each) for each in report.improvements],
        "layouts": [{**asdict(each), "percent": each.percent} for each in report.layouts],
        "parked_met": [
            {**asdict(each), "met_per_km": each.met_per_km} for each in found.densities()
        ],
        "traffic": [_facts(each.facts) for each in found.mobilities],
        "options": report.options,
        "battery_hours": report.battery_hours,
        "mean_stay_h": report.mean_stay_h,
        "provenance": whence(case.files).to_json(),
    }


def _result(each: PositioningResult) -> dict[str, Any]:
    return {**asdict(each), "rmse_over_bound": each.rmse_over_bound}


def _facts(facts: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a run of SUMO reports, without what varies between identical runs."""
    return {name: value for name, value in facts.items() if name != "seconds"}

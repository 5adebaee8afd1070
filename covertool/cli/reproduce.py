"""`covertool reproduce`: every table of the paper, its value beside ours."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from covertool.cli import options
from covertool.cli import simulate_options as own
from covertool.cli.app import app
from covertool.cli.console import print_json, print_table, progress, say
from covertool.cli.whence import whence

if TYPE_CHECKING:
    from covertool.model import OccupancyTable
    from covertool.paper.comparison import Comparison
    from covertool.paper.scenarios import LayoutResult

Tables = Annotated[
    list[int] | None,
    typer.Option("--table", metavar="N", help="1, 2, 4, 5, 6, 7 or 8 (repeatable; default all)."),
]
LayoutCount = Annotated[
    int, typer.Option("--layouts", metavar="N", min=1, help="Layouts and traffics: seeds 1 to N.")
]
PresetName = Annotated[
    str | None,
    typer.Option("--preset", metavar="paper|best", help="Only this one (default: both)."),
]
Resume = Annotated[
    Path | None,
    typer.Option("--resume", metavar="FOLDER", help="Keep finished layouts here; take them up."),
]

COLUMNS = (
    "", "quantity", "paper", "ours", "difference", "95 % of layouts", "paper's sign", "inside",
    "best",
)  # fmt: skip


@app.command()
def reproduce(
    table: Tables = None,
    layouts: LayoutCount = 1,
    preset: PresetName = None,
    runs: own.Runs = 40,
    workers: own.Workers = 1,
    scheduler: own.Scheduler = None,
    resume: Resume = None,
    output: options.Output = None,
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
) -> None:
    """Every table of the paper: its value, ours, the difference, and what differs in the set-up.

    \b
    Examples:
      covertool reproduce --table 5
      covertool reproduce --preset paper --workers 2 -o tables.md
      covertool reproduce --layouts 30 --runs 10 --workers 2 --resume layouts/ -o tables.csv

    \b
    Tables I, II and IV take seconds. Tables V (campus) and VI to VIII (town) drive SUMO; with one
    layout and both presets they take a few minutes on two cores, most of it second_order ("best");
    --preset paper is about three times as fast. Time grows with --layouts and --runs.
    Layouts are the seeds 1 to N, fixed beforehand; "95 % of layouts" is where 95 % of them lie,
    "paper's sign" the share of layouts in which the improvement has the paper's sign, and "inside"
    whether the paper's value lies within. Table IV is calibrated, and so no evidence.
    -o FILE.md or FILE.csv writes the same tables.
    """
    from covertool.gis.records import RECORD_FORMATS
    from covertool.paper.reproduce import SCENARIO_OF, TABLES

    begun = time.perf_counter()
    numbers = tuple(sorted(set(table or TABLES)))
    unknown = [str(number) for number in numbers if number not in TABLES]
    if unknown:
        known = ", ".join(map(str, TABLES))
        raise typer.BadParameter(f"{', '.join(unknown)}: use {known}", param_hint="--table")
    if preset not in (None, "paper", "best"):
        raise typer.BadParameter("use paper or best", param_hint="--preset")
    if output is not None:
        from covertool.gis.guard import output_file
        from covertool.gis.textfile import MARKDOWN

        output_file(output, (MARKDOWN, RECORD_FORMATS[0]), overwrite=overwrite)
    scenarios = list(dict.fromkeys(SCENARIO_OF[n] for n in numbers if n in SCENARIO_OF))
    found = _run(scenarios, layouts, preset, runs, workers, scheduler, resume)
    comparisons = _compare(numbers, found, preset)
    if output is not None:
        _write(output, comparisons, numbers, layouts, overwrite)
    if as_json:
        content = _content(comparisons, numbers, found, layouts, runs)
        print_json("reproduce", {**content, "seconds": time.perf_counter() - begun})
    else:
        _print(comparisons, numbers, found)


def _run(
    scenarios: Sequence[str],
    layouts: int,
    preset: str | None,
    runs: int,
    workers: int,
    scheduler: str | None,
    resume: Path | None,
) -> dict[str, list[LayoutResult]]:
    if not scenarios:
        return {}
    from covertool.gis.provenance import sha256, versions
    from covertool.gis.read import read_anchors
    from covertool.gis.sample import SAMPLE_STUDY, sample_folder
    from covertool.gis.study import read_layers
    from covertool.paper.scenarios import run_layouts
    from covertool.spread import Ledger
    from covertool.traffic.sumo import find_sumo

    sumo = find_sumo()
    estimators = {"paper": ("gcpso", "ekf"), "best": ("second_order",)}
    chosen = estimators[preset] if preset else (*estimators["paper"], *estimators["best"])
    study = sample_folder() / SAMPLE_STUDY
    job = f"reproduce {chosen} {runs} {sumo.version} {sha256(study)} {versions()['covertool']}"
    with progress("layouts", len(scenarios) * layouts) as advance:
        return run_layouts(
            scenarios,
            read_layers(study, ["streets"])["streets"],
            read_anchors(f"{study}:anchors"),
            layouts=layouts,
            estimators=chosen,
            runs=runs,
            workers=workers,
            scheduler=scheduler,
            ledger=Ledger(resume, job) if resume is not None else None,
            on_done=advance,
        )


def _compare(
    numbers: Sequence[int], found: dict[str, list[LayoutResult]], preset: str | None
) -> list[Comparison]:
    from covertool.paper import reproduce as paper

    presets = {"paper": preset != "best", "best": preset != "paper"}
    rows: list[Comparison] = []
    for number in numbers:
        if number == 1:
            rows += paper.compare_table_1(_sample_congestion())
        elif number == 2:
            rows += paper.compare_table_2()
        elif number == 4:
            rows += paper.compare_table_4(_sample_coverage())
        elif number == 8:
            rows += paper.compare_table_8(found["town"], **presets)
        else:
            results = found[paper.SCENARIO_OF[number]]
            rows += paper.compare_errors(number, results, **presets)
    return rows


def _sample_congestion() -> OccupancyTable:
    from covertool.cli import congestion_case
    from covertool.congestion.occupancy import days_of, table_of_days
    from covertool.congestion.streets import streets

    read = congestion_case.read_case(
        None, None, aoi=None, at=None, tz=None, fold=None,
        tolerance=congestion_case.TOLERANCE, occupied=congestion_case.OCCUPIED,
    )  # fmt: skip
    days = days_of(read.observations, streets(read.segments), read.options)
    return table_of_days(days, read.options)


def _sample_coverage() -> Any:
    from covertool.coverage import coverage_levels
    from covertool.errors import FileError
    from covertool.gis.read import read_study
    from covertool.gis.sample import SAMPLE_STUDY, sample_folder
    from covertool.paper import TABLE_4_PERCENT

    path = sample_folder() / SAMPLE_STUDY
    study = read_study(path)
    if study.anchors is None or study.transit is None:
        raise FileError("the sample study is not whole", str(path), "install covertool again")
    return coverage_levels(study.anchors, study.transit, list(TABLE_4_PERCENT))


def _print(
    comparisons: Sequence[Comparison],
    numbers: Sequence[int],
    found: dict[str, list[LayoutResult]],
) -> None:
    from covertool.paper.comparison import summary
    from covertool.paper.reproduce import DIFFERENCES, OPEN_POINTS, ROMAN

    for number in numbers:
        rows = [row for each in comparisons if each.table == number for row in [_row(each)]]
        print_table(COLUMNS, rows, f"\nTable {ROMAN[number]}")
        for line in DIFFERENCES[number]:
            typer.echo(f"  {line}")
    for name, results in found.items():
        typer.echo(f"\n{_beside(name, results)}")
    typer.echo()
    for line in (*summary(comparisons), *(OPEN_POINTS if found else ())):
        typer.echo(line)


def _row(each: Comparison) -> list[str]:
    from covertool.report.positioning_tables import number

    interval = f"{each.interval[0]:.2f} to {each.interval[1]:.2f}" if each.interval else "-"
    sign = "-" if each.same_sign is None else f"{100 * each.same_sign:.0f} %"
    inside = "-" if each.inside is None else "yes" if each.inside else "no"
    note = f" ({each.note})" if each.note else ""
    return [
        each.row, each.quantity + note, number(each.paper), number(each.ours),
        "-" if each.difference is None else f"{each.difference:+.2f}", interval, sign, inside,
        number(each.best),
    ]  # fmt: skip


def _beside(name: str, results: Sequence[LayoutResult]) -> str:
    """Return what the paper lacks: cars without any range, on the same traffic."""
    from statistics import fmean

    from covertool.report.positioning_tables import number

    def mean(values: list[float | None]) -> str:
        known = [value for value in values if value is not None]
        return number(fmean(known) if known else None)

    return (
        f"{name}: {len(results)} layouts, {results[0].vehicles} cars, "
        f"{mean([float(each.anchors) for each in results])} anchors on average; without any range "
        f"GPS alone has {mean([each.gps_m for each in results])} m of mean error, GPS and odometry "
        f"{mean([each.gps_odometry_m for each in results])} m (rows that the paper lacks)."
    )


def _content(
    comparisons: Sequence[Comparison],
    numbers: Sequence[int],
    found: dict[str, list[LayoutResult]],
    layouts: int,
    runs: int,
) -> dict[str, Any]:
    from covertool.gis.sample import SAMPLE_STUDY, sample_folder
    from covertool.paper.comparison import summary
    from covertool.paper.reproduce import DIFFERENCES, OPEN_POINTS

    return {
        "tables": list(numbers),
        "layouts": layouts,
        "runs": runs,
        "comparisons": [{**each.to_row(), "each": each.each} for each in comparisons],
        "without_ranges": {
            name: [
                {"gps_m": each.gps_m, "gps_odometry_m": each.gps_odometry_m,
                 "anchors": each.anchors, "vehicles": each.vehicles}
                for each in results
            ]
            for name, results in found.items()
        },
        "differences": {str(number): DIFFERENCES[number] for number in numbers},
        "open_points": OPEN_POINTS,
        "summary": summary(comparisons),
        "provenance": whence([sample_folder() / SAMPLE_STUDY]).to_json(),
    }  # fmt: skip


def _write(
    path: Path,
    comparisons: Sequence[Comparison],
    numbers: Sequence[int],
    layouts: int,
    overwrite: bool,
) -> None:
    if path.suffix.lower() == ".csv":
        import pandas as pd

        from covertool.gis.records import write_records

        frame = pd.DataFrame([each.to_row() for each in comparisons])
        write_records(path, [frame], overwrite=overwrite)
    else:
        from covertool.gis.textfile import MARKDOWN, write_text

        text = _markdown(comparisons, numbers, layouts)
        write_text(path, text, MARKDOWN, overwrite=overwrite)
    say(f"wrote {len(comparisons)} figures to {path}")


def _markdown(comparisons: Sequence[Comparison], numbers: Sequence[int], layouts: int) -> str:
    from covertool.paper.comparison import summary
    from covertool.paper.reproduce import DIFFERENCES, OPEN_POINTS, ROMAN

    lines = ["# The paper's tables beside ours", "", f"Layouts: seeds 1 to {layouts}.", ""]
    lines += [f"- {line}" for line in (*summary(comparisons), *OPEN_POINTS)]
    for number in numbers:
        lines += ["", f"## Table {ROMAN[number]}", "", *DIFFERENCES[number], ""]
        lines += ["| " + " | ".join(COLUMNS) + " |", "| --- | --- |" + " ---: |" * 7]
        lines += [
            "| " + " | ".join(_row(each)) + " |" for each in comparisons if each.table == number
        ]
    return "\n".join(lines) + "\n"

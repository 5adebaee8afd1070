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
from covertool.cli.console import print_json, progress
from covertool.cli.reproduce_output import json_content, print_comparisons, write_comparisons

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
        write_comparisons(output, comparisons, numbers, layouts, overwrite)
    if as_json:
        content = json_content(comparisons, numbers, found, layouts, runs)
        print_json("reproduce", {**content, "seconds": time.perf_counter() - begun})
    else:
        print_comparisons(comparisons, numbers, found)


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

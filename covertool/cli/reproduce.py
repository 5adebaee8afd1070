"""`covertool reproduce`: every table of the paper, its value beside ours."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from covertool.cli import options
from covertool.cli import simulate_options as own
from covertool.cli.app import app
from covertool.cli.console import print_json, progress
from covertool.cli.reproduce_output import json_content, print_comparisons, write_comparisons
from covertool.cli.simulate_experiment import estimators_of

if TYPE_CHECKING:
    from covertool.model import CoverageReport, OccupancyTable
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


@app.command()
def reproduce(
    table: Tables = None,
    layouts: LayoutCount = 1,
    preset: PresetName = None,
    runs: own.Runs = 40,
    workers: options.Workers = 1,
    scheduler: options.Scheduler = None,
    resume: options.Resume = None,
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
    from covertool.paper.reproduce import SCENARIO_OF, TABLES, compare

    begun = time.perf_counter()
    numbers = tuple(sorted(set(table or TABLES)))
    unknown = [str(number) for number in numbers if number not in TABLES]
    if unknown:
        known = ", ".join(map(str, TABLES))
        raise typer.BadParameter(f"{', '.join(unknown)}: use {known}", param_hint="--table")
    estimators = estimators_of(preset)
    if output is not None:
        from covertool.gis.guard import output_file
        from covertool.gis.textfile import MARKDOWN

        output_file(output, (MARKDOWN, RECORD_FORMATS[0]), overwrite=overwrite)
    scenarios = list(dict.fromkeys(SCENARIO_OF[n] for n in numbers if n in SCENARIO_OF))
    found = _run(scenarios, layouts, estimators, runs, workers, scheduler, resume)
    comparisons = compare(
        numbers, found, _sample_congestion, _sample_coverage,
        paper=preset != "best", best=preset != "paper",
    )  # fmt: skip
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
    estimators: Sequence[str],
    runs: int,
    workers: int,
    scheduler: str | None,
    resume: Path | None,
) -> dict[str, list[LayoutResult]]:
    """Drive and position the layouts of each scenario, behind a bar."""
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
    study = sample_folder() / SAMPLE_STUDY
    job = f"reproduce {estimators} {runs} {sumo.version} {sha256(study)} {versions()['covertool']}"
    with progress("layouts", len(scenarios) * layouts) as advance:
        return run_layouts(
            scenarios,
            read_layers(study, ["streets"])["streets"],
            read_anchors(f"{study}:anchors"),
            layouts=layouts,
            estimators=estimators,
            runs=runs,
            workers=workers,
            scheduler=scheduler,
            ledger=Ledger(resume, job) if resume is not None else None,
            on_done=advance,
        )


def _sample_congestion() -> OccupancyTable:
    from covertool.cli.congestion_case import Asked, read_case

    case = read_case(Asked())
    return case.table(case.network())


def _sample_coverage() -> CoverageReport:
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

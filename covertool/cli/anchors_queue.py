"""`covertool anchors queue`: queued cars as powered-on anchors."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from covertool.cli import congestion_case as case
from covertool.cli import options
from covertool.cli.anchors import anchors_app, beside_others
from covertool.cli.congestion_map import Day, Window
from covertool.cli.console import print_json, print_table, say
from covertool.cli.whence import whence

if TYPE_CHECKING:
    from covertool.congestion.queues import QueueOptions
    from covertool.model import Anchors, CoverageReport

Drive = Annotated[
    str, typer.Option("--drive", metavar="left|right", help="The side on which traffic runs.")
]
LaneWidth = Annotated[
    float, typer.Option("--lane-width", metavar="METRES", help="Width of a lane.")
]
StopLine = Annotated[
    float,
    typer.Option("--stop-line", metavar="METRES", help="Stop line before the segment's end."),
]
Shares = Annotated[
    list[str] | None,
    typer.Option("--share", metavar="STATUS=SHARE", help="Length that queues fill (repeatable)."),
]
Coverage = Annotated[
    list[float] | None,
    typer.Option(
        "--coverage", metavar="METRES", help="Report coverage with parked, queued and both."
    ),
]
StudyFile = Annotated[
    Path | None,
    typer.Option("--study", metavar="STUDY.gpkg", help="Parked anchors and transit of --coverage."),
]


@anchors_app.command("queue")
def queue(
    observations: case.ObservationFile = None,
    segments: case.Segments = None,
    day: Day = None,
    window: Window = None,
    aoi: case.Aoi = None,
    at: case.At = None,
    tz: case.Tz = None,
    fold: case.FoldChoice = None,
    tolerance: case.Tolerance = case.TOLERANCE,
    absent_is_free: case.AbsentIsFree = False,
    profile: case.ProfileName = None,
    share: Shares = None,
    drive: Drive = "left",
    lane_width: LaneWidth = 3.25,
    stop_line: StopLine = 0.0,
    seed: options.Seed = 1,
    coverage: Coverage = None,
    study: StudyFile = None,
    output: options.Output = None,
    into: options.Into = None,
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
) -> None:
    """Put queued cars (synthetic) on the congested segments, as anchors of origin "queue".

    \b
    Examples:
      covertool anchors queue --coverage 15
      covertool anchors queue obs.parquet --segments net.gpkg --tz Europe/Dublin
          --day 2014-06-17 --window evening --into town.gpkg
      covertool coverage town.gpkg --radius 15

    \b
    With --into the parked anchors of the study stay, and only its queued ones are replaced.
    With --coverage the transit area is covered by parked cars, by queued cars, and by both.
    """
    from covertool.congestion.moment import states_at
    from covertool.congestion.queues import queue_anchors
    from covertool.congestion.streets import streets

    chosen = _options(share, drive, lane_width, stop_line, seed)
    read = case.read_case(
        observations,
        segments,
        aoi=aoi,
        at=at,
        tz=tz,
        fold=fold,
        tolerance=tolerance,
        occupied=case.OCCUPIED,
        absent_is_free=absent_is_free,
        profile=profile,
    )
    network = streets(read.segments, aoi=read.aoi)
    status, queue_m, on, name = states_at(
        read.observations, network, read.options, day=case.day_of(day), window=window
    )
    cars, where = queue_anchors(network, status, queue_m, chosen)
    made_from = whence(read.files)
    _write(cars, where.tolist(), output, into, overwrite, made_from.to_metadata())
    report = _coverage(cars, study, coverage) if coverage else None
    if as_json:
        content = {"anchors": len(cars), "day": str(on), "window": name, "seed": seed}
        print_json(
            "anchors queue",
            {**content, "coverage": _results(report), "provenance": made_from.to_json()},
        )
        return
    say(f"{len(cars)} queued cars on {on}, {name} (synthetic, seed {seed})")
    if report is not None:
        _print(report)


def _options(
    share: list[str] | None, drive: str, lane_width: float, stop_line: float, seed: int
) -> QueueOptions:
    from covertool.congestion.fill import QUEUE_SHARE
    from covertool.congestion.queues import QueueOptions

    shares = dict(QUEUE_SHARE)
    for text in share or []:
        status, _, value = text.partition("=")
        try:
            number = float(value)
        except ValueError:
            number = -1.0
        if status not in shares or not 0 <= number <= 1:
            raise typer.BadParameter(f"{text!r} is not STATUS=0..1", param_hint="--share")
        shares[status] = number
    return QueueOptions(
        shares=shares,
        drive=drive,  # type: ignore[arg-type]
        lane_width_m=lane_width,
        stop_line_m=stop_line,
        seed=seed,
    )


def _write(
    cars: Anchors,
    where: list[str],
    output: Path | None,
    into: Path | None,
    overwrite: bool,
    metadata: dict[str, str],
) -> None:
    from covertool.gis.write import write_layers

    frame = cars.to_frame().assign(segment_id=where, synthetic=True)
    if output is not None:
        write_layers(output, {"anchors": frame}, overwrite=overwrite, metadata=metadata)
        say(f"wrote layer anchors to {output}")
    if into is not None:
        layers = {"anchors": beside_others(frame, into, "queue")}
        write_layers(into, layers, into=True, metadata=metadata)
        say(f"wrote the queued cars into layer anchors of {into}")


def _coverage(cars: Anchors, study: Path | None, radii: list[float]) -> CoverageReport:
    """Return the coverage of the study's transit area by its parked cars and the queued ones."""
    from covertool.cli.inputs import choose_inputs, read_inputs
    from covertool.coverage import coverage_levels
    from covertool.model import Anchors

    parked, transit = read_inputs(choose_inputs(study, None, None), None, str(cars.crs))
    others = parked.take(parked.origin != "queue")
    return coverage_levels(Anchors.concatenate([others, cars]), transit, radii)


def _results(report: CoverageReport | None) -> list[dict[str, object]]:
    return [
        {
            "origin": result.origin,
            "radius_m": result.radius_m,
            "anchors": result.anchors,
            "fractions": list(result.fractions),
        }
        for result in (report.results if report else ())
    ]


def _print(report: CoverageReport) -> None:
    print_table(
        ["anchors", "radius m", "number", "Level 1 %", "Level 2 %", "Level 3 %", "covered %"],
        [
            [
                result.origin or "all together",
                f"{result.radius_m:g}",
                str(result.anchors),
                *(f"{100 * part:.2f}" for part in result.fractions[1:]),
                f"{100 * (1 - result.fractions[0]):.2f}",
            ]
            for result in report.results
        ],
    )

"""`covertool anchors queue`: queued cars as powered-on anchors."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from covertool.cli import congestion_options as own
from covertool.cli import options
from covertool.cli.anchors import anchors_app, write_anchors
from covertool.cli.congestion_case import Asked, read_case
from covertool.cli.console import print_json, print_table, say
from covertool.cli.target import Target
from covertool.cli.whence import whence

if TYPE_CHECKING:
    from covertool.congestion.moment import QueuedCars
    from covertool.congestion.queues import QueueOptions
    from covertool.gis.provenance import Provenance
    from covertool.model import Anchors, CoverageReport

DrivingSide = Annotated[
    str,
    typer.Option(
        "--driving-side", "--drive", metavar="left|right", help="The side on which traffic runs."
    ),
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
    observations: own.ObservationFile = None,
    segments: own.Segments = None,
    day: own.Day = None,
    window: own.Window = None,
    aoi: own.Aoi = None,
    at: own.At = None,
    tz: own.Tz = None,
    fold: own.FoldChoice = None,
    tolerance: own.Tolerance = own.TOLERANCE,
    absent_is_free: own.AbsentIsFree = False,
    profile: own.ProfileName = None,
    share: Shares = None,
    driving_side: DrivingSide = "left",
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
    asked = Asked(
        observations, segments, aoi, at, tz, fold, tolerance, absent_is_free, profile
    )  # fmt: skip
    queues = _options(share, driving_side, lane_width, stop_line, seed)
    case = read_case(asked)
    cars = case.queued_cars(queues, own.day_of(day), window)
    made_from = whence(case.files)
    layer = cars.anchors.to_frame().assign(segment_id=cars.segment_id)
    write_anchors(Target(output, into, overwrite), layer, "queue", made_from)
    report = _coverage(cars.anchors, study, coverage) if coverage else None
    if as_json:
        print_json("anchors queue", _content(cars, seed, report, made_from))
        return
    number = len(cars.anchors)
    say(f"{number} queued cars on {cars.day}, {cars.window} (synthetic, seed {seed})")
    if report is not None:
        _print(report)


def _options(
    share: list[str] | None, driving_side: str, lane_width: float, stop_line: float, seed: int
) -> QueueOptions:
    """Return how the queues are laid out."""
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
        drive=driving_side,  # type: ignore[arg-type]
        lane_width_m=lane_width,
        stop_line_m=stop_line,
        seed=seed,
    )


def _coverage(cars: Anchors, study: Path | None, radii: list[float]) -> CoverageReport:
    """Return the coverage of the study's transit area by its parked cars and the queued ones."""
    from covertool.cli.inputs import choose_inputs, read_inputs
    from covertool.coverage import coverage_levels
    from covertool.model import Anchors

    parked, transit = read_inputs(choose_inputs(study, None, None), None, str(cars.crs))
    others = parked.take(parked.origin != "queue")
    return coverage_levels(Anchors.concatenate([others, cars]), transit, radii)


def _content(
    cars: QueuedCars, seed: int, report: CoverageReport | None, made_from: Provenance
) -> dict[str, Any]:
    """Return the content of ``anchors queue --json``."""
    coverage = [
        {
            "origin": result.origin,
            "radius_m": result.radius_m,
            "anchors": result.anchors,
            "fractions": list(result.fractions),
        }
        for result in (report.results if report else ())
    ]
    return {
        "anchors": len(cars.anchors),
        "day": str(cars.day),
        "window": cars.window,
        "seed": seed,
        "coverage": coverage,
        "provenance": made_from.to_json(),
    }


def _print(report: CoverageReport) -> None:
    """Print the coverage by each origin and by all together."""
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

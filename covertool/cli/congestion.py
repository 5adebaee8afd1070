"""`covertool congestion`: import feeds, and the share of street length that stands or crawls."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from covertool.cli import congestion_options as own
from covertool.cli import options
from covertool.cli.app import Verbs, app
from covertool.cli.congestion_case import Asked, read_case
from covertool.cli.console import print_json, print_table, say
from covertool.cli.target import Target
from covertool.cli.whence import whence

if TYPE_CHECKING:
    from covertool.congestion.junctions import JunctionShare
    from covertool.gis.provenance import Provenance
    from covertool.model import OccupancyTable

congestion_app = Verbs(
    name="congestion",
    help="""How much street length stands or crawls at rush hour.

    \b
    Examples:
      covertool congestion table
      covertool congestion import --format datex2 feed.xml -o observations.parquet
    """,
    no_args_is_help=True,
    rich_markup_mode=None,
)
app.add_typer(congestion_app)

Paper = Annotated[bool, typer.Option("--paper", help="Print the paper's Table I and its means.")]


@dataclass(frozen=True)
class Counted:
    """An occupancy table, how much of it lies at junctions, and the files behind both."""

    table: OccupancyTable
    shares: list[JunctionShare]
    files: tuple[Path, ...]


@congestion_app.command("table")
def table(
    observations: own.ObservationFile = None,
    segments: own.Segments = None,
    aoi: own.Aoi = None,
    at: own.At = None,
    tz: own.Tz = None,
    fold: own.FoldChoice = None,
    tolerance: own.Tolerance = own.TOLERANCE,
    occupied: own.Occupied = own.OCCUPIED,
    mean_of: own.MeanOf = "cells",
    weight: own.Weight = "directed",
    min_coverage: own.MinCoverage = 0.8,
    holidays: own.Holidays = None,
    absent_is_free: own.AbsentIsFree = False,
    profile: own.ProfileName = None,
    paper: Paper = False,
    output: options.Output = None,
    into: options.Into = None,
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
) -> None:
    """Share of the street length that is occupied, by weekday and rush hour.

    \b
    Examples:
      covertool congestion table
      covertool congestion table obs.parquet --segments town.gpkg --tz Europe/Dublin
      covertool congestion table obs.csv --segments net.gpkg:segments --tz Europe/Dublin
          --at lunch=13:00 --at evening=19:30 --occupied very_slow,stationary -o table.xlsx
      covertool congestion table --paper

    \b
    "flagged" is the length of segments whose status is in the occupied set; "filled" is the length
    that the queued cars themselves take, which is several times less. With --into the study gets
    the tables "occupancy" and "occupancy_means".
    """
    counted = _paper_table() if paper else _counted(
        Asked(
            observations, segments, aoi, at, tz, fold, tolerance, absent_is_free, profile,
            occupied, mean_of, min_coverage, holidays,
        ),
        weight,
    )  # fmt: skip
    made_from = whence(counted.files)
    _write(counted.table, Target(output, into, overwrite), made_from)
    if as_json:
        _print_json(counted, made_from)
    else:
        _print(counted)


def _paper_table() -> Counted:
    """Return the paper's Table I."""
    from covertool.paper import table_1

    return Counted(table_1(), [], ())


def _counted(asked: Asked, weight: str) -> Counted:
    """Return what the observations give."""
    from covertool.congestion.junctions import junction_shares

    case = read_case(asked)
    network = case.network(weight)
    shares = junction_shares(case.observations, network, case.options)
    return Counted(case.table(network), shares, case.files)


def _write(table: OccupancyTable, target: Target, made_from: Provenance) -> None:
    """Write the table as a file of its own, and into a study as its tables."""
    from covertool.report.congestion_tables import tables, write_table

    if target.output is not None:
        write_table(target.output, table, overwrite=target.overwrite)
        say(f"wrote {target.output}")
    if target.into is not None:
        replace(target, output=None).write(tables(table), made_from.to_metadata())


def _print_json(counted: Counted, made_from: Provenance) -> None:
    from covertool.report.congestion_tables import content

    junctions = [vars(share) for share in counted.shares]
    print_json(
        "congestion table",
        {**content(counted.table), "junctions": junctions, "provenance": made_from.to_json()},
    )


def _print(counted: Counted) -> None:
    from covertool.report.congestion_tables import header, rows

    print_table(header(counted.table), rows(counted.table))
    for share in counted.shares:
        typer.echo(share.text())

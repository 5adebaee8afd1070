"""`covertool congestion`: import feeds, and the share of street length that stands or crawls."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from covertool.cli import congestion_case as case
from covertool.cli import options
from covertool.cli.app import Verbs, app
from covertool.cli.console import print_json, print_table
from covertool.cli.whence import whence

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


@congestion_app.command("table")
def table(
    observations: case.ObservationFile = None,
    segments: case.Segments = None,
    aoi: case.Aoi = None,
    at: case.At = None,
    tz: case.Tz = None,
    fold: case.FoldChoice = None,
    tolerance: case.Tolerance = case.TOLERANCE,
    occupied: case.Occupied = case.OCCUPIED,
    mean_of: case.MeanOf = "cells",
    weight: case.Weight = "directed",
    min_coverage: case.MinCoverage = 0.8,
    holidays: case.Holidays = None,
    absent_is_free: case.AbsentIsFree = False,
    profile: case.ProfileName = None,
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
    from covertool.gis.write import write_layers
    from covertool.report.congestion_tables import content, header, rows, tables, write_table

    files: tuple[Path, ...] = ()
    if paper:
        from covertool.paper import table_1

        result, shares = table_1(), []
    else:
        from covertool.congestion.junctions import junction_shares
        from covertool.congestion.occupancy import days_of, table_of_days
        from covertool.congestion.streets import streets

        read = case.read_case(
            observations,
            segments,
            aoi=aoi,
            at=at,
            tz=tz,
            fold=fold,
            tolerance=tolerance,
            occupied=occupied,
            mean_of=mean_of,
            min_coverage=min_coverage,
            holidays=holidays,
            absent_is_free=absent_is_free,
            profile=profile,
        )
        network = streets(read.segments, weight=weight, aoi=read.aoi)  # type: ignore[arg-type]
        result = table_of_days(days_of(read.observations, network, read.options), read.options)
        shares = junction_shares(read.observations, network, read.options)
        files = read.files
    if output is not None:
        write_table(output, result, overwrite=overwrite)
    if into is not None:
        write_layers(into, tables(result), into=True, metadata=whence(files).to_metadata())
    if as_json:
        near = [vars(share) for share in shares]
        print_json(
            "congestion table",
            {**content(result), "junctions": near, "provenance": whence(files).to_json()},
        )
        return
    print_table(header(result), rows(result))
    for share in shares:
        typer.echo(share.text())

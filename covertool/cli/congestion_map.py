"""`covertool congestion map` and `sensitivity`: where it stands, and what the threshold decides."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from covertool.cli import congestion_options as own
from covertool.cli import options
from covertool.cli.congestion import congestion_app
from covertool.cli.congestion_case import Asked, Case, read_case
from covertool.cli.console import print_json, print_table, say
from covertool.cli.target import Target
from covertool.cli.whence import whence

if TYPE_CHECKING:
    from covertool.congestion.sensitivity import Variant
    from covertool.congestion.streets import Streets

Heat = Annotated[
    Path | None,
    typer.Option("--heat", metavar="FILE", help="Also write weekday by hour (.png, .csv, ...)."),
]


@congestion_app.command("map")
def congestion_map(
    observations: own.ObservationFile = None,
    segments: own.Segments = None,
    day: own.Day = None,
    window: own.Window = None,
    aoi: own.Aoi = None,
    at: own.At = None,
    tz: own.Tz = None,
    fold: own.FoldChoice = None,
    tolerance: own.Tolerance = own.TOLERANCE,
    occupied: own.Occupied = own.OCCUPIED,
    absent_is_free: own.AbsentIsFree = False,
    profile: own.ProfileName = None,
    heat: Heat = None,
    output: options.Output = None,
    overwrite: options.Overwrite = False,
    into: options.Into = None,
) -> None:
    """Draw the network at one rush hour: occupied black, free yellow, as in the paper.

    \b
    Examples:
      covertool congestion map -o evening.png
      covertool congestion map obs.parquet --segments net.gpkg --tz Europe/Dublin
          --day 2014-06-17 --window evening -o evening.gpkg --heat week.png

    \b
    A picture (.png, .pdf, .svg) or a GIS layer "congestion" (.gpkg, .geojson, ...), by extension.
    """
    target = Target(output, into, overwrite)
    target.require(heat)
    asked = Asked(
        observations, segments, aoi, at, tz, fold, tolerance, absent_is_free, profile, occupied
    )  # fmt: skip
    case = read_case(asked)
    network = case.network()
    if output is not None or into is not None:
        _write_moment(case, network, own.day_of(day), window, target)
    if heat is not None:
        _write_heat(case, network, heat, overwrite)


def _write_moment(
    case: Case, network: Streets, day: date | None, window: str | None, target: Target
) -> None:
    """Write one rush hour as a picture or a layer, by extension, and as a layer into a study."""
    from covertool.congestion.moment import states_at
    from covertool.gis.figure import is_figure, write_figure
    from covertool.gis.study import inherited_metadata
    from covertool.report.congestion import congestion_layer, kinds
    from covertool.report.congestion import congestion_map as draw

    moment = states_at(case.observations, network, case.options, day=day, window=window)
    kind = kinds(moment.status, case.options.occupied)
    if target.output is not None and is_figure(target.output):
        title = f"Occupied streets, {moment.day:%A %d %B %Y}, {moment.window}"
        picture = draw(network.line, kind, network.crs, title=title)
        write_figure(target.output, picture, overwrite=target.overwrite)
        say(f"wrote {target.output}")
        target = replace(target, output=None)
    metadata = {**inherited_metadata(case.files), **whence(case.files).to_metadata()}
    target.write({"congestion": congestion_layer(network, moment, kind)}, metadata)


def _write_heat(case: Case, network: Streets, heat: Path, overwrite: bool) -> None:
    """Write the occupied share by weekday and hour as a picture or a table, by extension."""
    from covertool.congestion.occupancy import days_of, table_of_days
    from covertool.congestion.options import hourly
    from covertool.gis.figure import is_figure, write_figure
    from covertool.report.congestion import heat_matrix
    from covertool.report.congestion_tables import write_table

    hours = hourly(case.options)
    table = table_of_days(days_of(case.observations, network, hours), hours)
    if is_figure(heat):
        title = f"Flagged street length by weekday and hour ({hours.tz.key})"
        write_figure(heat, heat_matrix(table, title=title), overwrite=overwrite)
    else:
        write_table(heat, table, overwrite=overwrite)
    say(f"wrote {heat}")


@congestion_app.command("sensitivity")
def sensitivity(
    observations: own.ObservationFile = None,
    segments: own.Segments = None,
    aoi: own.Aoi = None,
    at: own.At = None,
    tz: own.Tz = None,
    fold: own.FoldChoice = None,
    tolerance: own.Tolerance = own.TOLERANCE,
    mean_of: own.MeanOf = "cells",
    weight: own.Weight = "directed",
    min_coverage: own.MinCoverage = 0.8,
    absent_is_free: own.AbsentIsFree = False,
    as_json: options.Json = False,
) -> None:
    """The means under each status profile and occupied set: the threshold decides the answer.

    \b
    Examples:
      covertool congestion sensitivity
      covertool congestion sensitivity obs.parquet --segments net.gpkg --tz Europe/Dublin --json
    """
    from covertool.congestion.sensitivity import sensitivity as variants_of

    asked = Asked(
        observations, segments, aoi, at, tz, fold, tolerance, absent_is_free, mean_of=mean_of,
        min_coverage=min_coverage,
    )  # fmt: skip
    case = read_case(asked)
    variants = variants_of(case.observations, case.network(weight), case.options)
    if as_json:
        found = [_variant(each) for each in variants]
        provenance = whence(case.files).to_json()
        print_json("congestion sensitivity", {"variants": found, "provenance": provenance})
    else:
        _print(variants)


def _variant(variant: Variant) -> dict[str, Any]:
    return {
        "profile": variant.profile,
        "occupied": list(variant.occupied),
        "means": [dict(vars(mean)) for mean in variant.table.means],
    }


def _print(variants: list[Variant]) -> None:
    columns = [f"{mean.group} {mean.window} %" for mean in variants[0].table.means]
    rows = [
        [
            f"{variant.profile or 'as observed'}: {', '.join(variant.occupied)}",
            *(mean.text or "-" for mean in variant.table.means),
        ]
        for variant in variants
    ]
    print_table(["profile: occupied", *columns], rows)

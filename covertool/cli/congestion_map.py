"""`covertool congestion map` and `sensitivity`: where it stands, and what the threshold decides."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from covertool.cli import congestion_case as case
from covertool.cli import options
from covertool.cli.congestion import congestion_app
from covertool.cli.console import print_json, print_table, say
from covertool.cli.whence import whence

if TYPE_CHECKING:
    from covertool.cli.congestion_case import Case
    from covertool.congestion.streets import Streets

_PICTURES = (".png", ".pdf", ".svg")

Day = Annotated[
    str | None, typer.Option("--day", metavar="YYYY-MM-DD", help="The local day; else the first.")
]
Window = Annotated[
    str | None, typer.Option("--window", metavar="NAME", help="The window; else the last.")
]
Heat = Annotated[
    Path | None,
    typer.Option("--heat", metavar="FILE", help="Also write weekday by hour (.png, .csv, ...)."),
]


@congestion_app.command("map")
def congestion_map(
    observations: case.ObservationFile = None,
    segments: case.Segments = None,
    day: Day = None,
    window: Window = None,
    aoi: case.Aoi = None,
    at: case.At = None,
    tz: case.Tz = None,
    fold: case.FoldChoice = None,
    tolerance: case.Tolerance = case.TOLERANCE,
    occupied: case.Occupied = case.OCCUPIED,
    absent_is_free: case.AbsentIsFree = False,
    profile: case.ProfileName = None,
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
    from covertool.congestion.streets import streets

    if output is None and into is None and heat is None:
        raise typer.BadParameter("say where to write", param_hint="-o")
    read = case.read_case(
        observations,
        segments,
        aoi=aoi,
        at=at,
        tz=tz,
        fold=fold,
        tolerance=tolerance,
        occupied=occupied,
        absent_is_free=absent_is_free,
        profile=profile,
    )
    network = streets(read.segments, aoi=read.aoi)
    if output is not None or into is not None:
        _write_moment(read, network, day, window, output, into, overwrite)
    if heat is not None:
        _write_heat(read, network, heat, overwrite)


def _write_moment(
    read: Case,
    network: Streets,
    day: str | None,
    window: str | None,
    output: Path | None,
    into: Path | None,
    overwrite: bool,
) -> None:
    from covertool.congestion.moment import states_at
    from covertool.gis.figure import write_figure
    from covertool.gis.study import inherited_metadata
    from covertool.gis.write import write_layers
    from covertool.report.congestion import congestion_map as draw
    from covertool.report.congestion import kinds

    status, queue_m, on, at = states_at(
        read.observations, network, read.options, day=case.day_of(day), window=window
    )
    kind = kinds(status, read.options.occupied)
    if output is not None and output.suffix.lower() in _PICTURES:
        title = f"Occupied streets, {on:%A %d %B %Y}, {at}"
        picture = draw(network.line, kind, network.crs, title=title)
        write_figure(output, picture, overwrite=overwrite)
        say(f"wrote {output}")
        output = None
    layer = _layer(network, status=status, kind=kind, queue_m=queue_m, day=str(on), window=at)
    metadata = {**inherited_metadata(read.files), **whence(read.files).to_metadata()}
    if output is not None:
        write_layers(output, {"congestion": layer}, overwrite=overwrite, metadata=metadata)
        say(f"wrote layer congestion to {output}")
    if into is not None:
        write_layers(into, {"congestion": layer}, into=True, metadata=metadata)
        say(f"wrote layer congestion into {into}")


def _layer(network: Streets, **columns: Any) -> Any:
    import geopandas as gpd

    ids = {"segment_id": network.segment_id, "length_m": network.length_m, "lanes": network.lanes}
    return gpd.GeoDataFrame({**ids, **columns}, geometry=list(network.line), crs=network.crs)


def _write_heat(read: Case, network: Streets, heat: Path, overwrite: bool) -> None:
    from covertool.congestion.occupancy import days_of, hourly, table_of_days
    from covertool.gis.figure import write_figure
    from covertool.report.congestion import heat_matrix
    from covertool.report.congestion_tables import write_table

    hours = hourly(read.options)
    table = table_of_days(days_of(read.observations, network, hours), hours)
    if heat.suffix.lower() in _PICTURES:
        title = f"Flagged street length by weekday and hour ({hours.tz.key})"
        write_figure(heat, heat_matrix(table, title=title), overwrite=overwrite)
    else:
        write_table(heat, table, overwrite=overwrite)
    say(f"wrote {heat}")


@congestion_app.command("sensitivity")
def sensitivity(
    observations: case.ObservationFile = None,
    segments: case.Segments = None,
    aoi: case.Aoi = None,
    at: case.At = None,
    tz: case.Tz = None,
    fold: case.FoldChoice = None,
    tolerance: case.Tolerance = case.TOLERANCE,
    mean_of: case.MeanOf = "cells",
    weight: case.Weight = "directed",
    min_coverage: case.MinCoverage = 0.8,
    absent_is_free: case.AbsentIsFree = False,
    as_json: options.Json = False,
) -> None:
    """The means under each status profile and occupied set: the threshold decides the answer.

    \b
    Examples:
      covertool congestion sensitivity
      covertool congestion sensitivity obs.parquet --segments net.gpkg --tz Europe/Dublin --json
    """
    from covertool.congestion.sensitivity import sensitivity as variants_of
    from covertool.congestion.streets import streets

    read = case.read_case(
        observations,
        segments,
        aoi=aoi,
        at=at,
        tz=tz,
        fold=fold,
        tolerance=tolerance,
        occupied=case.OCCUPIED,
        mean_of=mean_of,
        min_coverage=min_coverage,
        absent_is_free=absent_is_free,
    )
    network = streets(read.segments, weight=weight, aoi=read.aoi)  # type: ignore[arg-type]
    variants = variants_of(read.observations, network, read.options)
    if as_json:
        found = [
            {
                "profile": variant.profile,
                "occupied": list(variant.occupied),
                "means": [dict(vars(mean)) for mean in variant.table.means],
            }
            for variant in variants
        ]
        print_json("congestion sensitivity", {"variants": found})
        return
    columns = [f"{mean.group} {mean.window} %" for mean in variants[0].table.means]
    rows = [
        [
            f"{variant.profile or 'as observed'}: {', '.join(variant.occupied)}",
            *(mean.text or "-" for mean in variant.table.means),
        ]
        for variant in variants
    ]
    print_table(["profile: occupied", *columns], rows)

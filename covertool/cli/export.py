"""`covertool export`: a study as layers in other formats, as tables, or as a map."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from covertool.cli import options
from covertool.cli.app import app
from covertool.cli.console import say
from covertool.cli.whence import whence

Study = Annotated[Path, typer.Argument(metavar="STUDY.gpkg", help="The study to export.")]
Output = Annotated[
    Path,
    typer.Option(
        "-o",
        "--output",
        metavar="FILE",
        help="Layers: .gpkg .kml .shp.zip .geojson .parquet .fgb .shp .csv. "
        "Tables: .xlsx .csv .tex .md. Figures: .png .pdf .svg.",
    ),
]
Layers = Annotated[
    list[str] | None,
    typer.Option("--layer", metavar="NAME", help="A layer to write (repeatable)."),
]
Table = Annotated[
    str | None,
    typer.Option(
        "--table",
        metavar="NAME",
        help="The table to write: summary, coverage, curve, penetration, zones, congestion, "
        "congestion_means, positioning, improvements, parked_met, parameters, dictionary.",
    ),
]
Discs = Annotated[
    list[str] | None,
    typer.Option(
        "--discs",
        metavar="METRES|CLASS",
        help="Also the disc of each anchor as a layer (repeatable).",
    ),
]
Show = Annotated[
    str,
    typer.Option(
        "--show",
        metavar="VIEW",
        help="What a figure shows: coverage, parked, streets, circuit, curve, penetration.",
    ),
]
Radius = Annotated[
    float | None,
    typer.Option("--radius", metavar="METRES", help="Which coverage the map shows."),
]
MapBounds = Annotated[
    str | None,
    typer.Option("--bounds", metavar="X0,Y0,X1,Y1", help="The part that the map shows."),
]
Title = Annotated[str | None, typer.Option("--title", help="Headline of the map.")]
Licence = Annotated[
    str | None, typer.Option("--licence", help="Licence of the data, for the foot of the map.")
]
DataDate = Annotated[
    str | None, typer.Option("--data-date", help="When the data is of, for the foot.")
]


@app.command()
def export(
    study: Study,
    output: Output,
    layer: Layers = None,
    table: Table = None,
    discs: Discs = None,
    show: Show = "coverage",
    radius: Radius = None,
    bounds: MapBounds = None,
    title: Title = None,
    licence: Licence = None,
    data_date: DataDate = None,
    overwrite: options.Overwrite = False,
) -> None:
    """Write a study as layers for a GIS, as tables, or as a map for print; nothing is computed.

    \b
    Examples:
      covertool export town.gpkg -o tables.xlsx
      covertool export town.gpkg -o town.kml
      covertool export town.gpkg --layer transit -o transit.geojson
      covertool export town.gpkg --discs A -o discs.gpkg
      covertool export town.gpkg --table coverage -o coverage.tex
      covertool export town.gpkg -o centre.pdf --radius 15 --bounds 693500,737000,694500,737800
    """
    from covertool.report.export import export as write
    from covertool.report.views import MapOptions

    shown = _parse_bounds(bounds) if bounds else None
    write(
        study,
        output,
        layers=layer or (),
        table=table,
        discs=discs or (),
        figure=MapOptions(show, radius, shown, title, licence, data_date),
        overwrite=overwrite,
        metadata=whence([study]).to_metadata(),
    )
    say(f"wrote {output}")


def _parse_bounds(text: str) -> tuple[float, float, float, float]:
    """Return the four numbers of ``X0,Y0,X1,Y1``."""
    try:
        x0, y0, x1, y1 = (float(part) for part in text.split(","))
    except ValueError:
        raise typer.BadParameter("give four numbers: X0,Y0,X1,Y1", param_hint="--bounds") from None
    if not (x0 < x1 and y0 < y1):
        raise typer.BadParameter("X0 < X1 and Y0 < Y1 must hold", param_hint="--bounds")
    return x0, y0, x1, y1

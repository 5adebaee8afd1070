"""`covertool export`: a study as a map or as a layer in another format."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from covertool.cli.app import app
from covertool.cli.options import Overwrite

_MAP_LAYERS = (
    "buildings",
    "transit",
    "coverage_level_1",
    "coverage_level_2",
    "coverage_level_3",
    "anchors",
)


@app.command()
def export(
    study: Annotated[Path, typer.Argument(metavar="STUDY", help="The study, a GeoPackage.")],
    output: Annotated[
        Path,
        typer.Option(
            "-o", "--output", metavar="FILE",
            help="Map: .png .pdf .svg. Layer: .geojson .parquet .fgb .shp .csv.",
        ),
    ],
    layer: Annotated[
        str | None, typer.Option("--layer", metavar="NAME", help="The layer to write.")
    ] = None,
    radius: Annotated[
        float | None,
        typer.Option("--radius", metavar="METRES", help="Which coverage the map shows."),
    ] = None,
    bounds: Annotated[
        str | None,
        typer.Option("--bounds", metavar="X0,Y0,X1,Y1", help="The part that the map shows."),
    ] = None,
    title: Annotated[str | None, typer.Option("--title", help="Headline of the map.")] = None,
    overwrite: Overwrite = False,
) -> None:  # fmt: skip
    """Write a study as a map for print, or one of its layers in another GIS format.

    \b
    Examples:
      covertool export town.gpkg -o town.png
      covertool export town.gpkg -o centre.pdf --radius 15 --bounds 693500,737000,694500,737800
      covertool export town.gpkg --layer transit -o transit.geojson
    """
    from covertool.gis.figure import FIGURE_FORMATS
    from covertool.gis.formats import by_suffix

    if by_suffix(output, FIGURE_FORMATS) is None:
        _export_layer(study, output, layer, overwrite)
    else:
        _export_map(study, output, radius, bounds, title, overwrite)


def _export_layer(study: Path, output: Path, layer: str | None, overwrite: bool) -> None:
    from covertool.gis.layers import read_layer
    from covertool.gis.write import write_layers

    spec = f"{study}:{layer}" if layer else str(study)
    frame = read_layer(spec, None).frame
    write_layers(output, {layer or study.stem: frame}, overwrite=overwrite, inputs=[study])


def _export_map(
    study: Path,
    output: Path,
    radius: float | None,
    bounds: str | None,
    title: str | None,
    overwrite: bool,
) -> None:
    from covertool.errors import FileError
    from covertool.gis.figure import write_figure
    from covertool.gis.study import inherited_metadata, read_layers
    from covertool.report.figures import coverage_map, of_one_radius

    layers = read_layers(study, _MAP_LAYERS)
    if "transit" not in layers:
        raise FileError(
            "the study has no transit layer", str(study), "make it with covertool transit"
        )
    shown, coverage = of_one_radius(layers, radius)
    figure = coverage_map(
        shown,
        title=title or f"{study.stem}: {coverage}",
        footnote=_footnote(study, inherited_metadata([study])),
        bounds=_parse_bounds(bounds) if bounds else None,
    )
    write_figure(output, figure, overwrite=overwrite)


def _footnote(study: Path, metadata: Mapping[str, str]) -> str:
    synthetic = (
        f"; synthetic: {metadata.get('title', 'invented data')}" if "synthetic" in metadata else ""
    )
    return f"covertool, from {study.name}{synthetic}"


def _parse_bounds(text: str) -> tuple[float, float, float, float]:
    try:
        x0, y0, x1, y1 = (float(part) for part in text.split(","))
    except ValueError:
        raise typer.BadParameter("give four numbers: X0,Y0,X1,Y1", param_hint="--bounds") from None
    if not (x0 < x1 and y0 < y1):
        raise typer.BadParameter("X0 < X1 and Y0 < Y1 must hold", param_hint="--bounds")
    return x0, y0, x1, y1

"""The options that several verbs share, so that each is spelled and explained once."""

from pathlib import Path
from typing import Annotated

import typer

Output = Annotated[
    Path | None,
    typer.Option("-o", "--output", metavar="FILE", help="Where to write; the extension decides."),
]
Into = Annotated[
    Path | None,
    typer.Option("--into", metavar="STUDY.gpkg", help="Add or replace this verb's layers there."),
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace an existing output.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout.")]
Crs = Annotated[
    str | None,
    typer.Option("--crs", metavar="EPSG:CODE", help="CRS of input that names none."),
]
DstCrs = Annotated[
    str | None,
    typer.Option("--dst-crs", metavar="EPSG:CODE", help="Compute and write in this CRS."),
]
Seed = Annotated[int, typer.Option("--seed", metavar="N", help="Seed of everything random.")]
AnchorFiles = Annotated[
    list[str] | None,
    typer.Option("--anchors", metavar="FILE[:LAYER]", help="Anchors (repeatable)."),
]
TransitFile = Annotated[
    str | None,
    typer.Option("--transit", metavar="FILE[:LAYER]", help="Transit area."),
]

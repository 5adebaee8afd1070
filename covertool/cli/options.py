"""The options that several verbs share, so that each is spelled and explained once."""

from pathlib import Path
from typing import Annotated

import typer

Study = Annotated[
    Path | None,
    typer.Argument(metavar="STUDY.gpkg", help="A study; without one the sample study."),
]
AnchorFiles = Annotated[
    list[str] | None,
    typer.Option("--anchors", metavar="FILE[:LAYER]", help="Anchors (repeatable)."),
]
TransitFile = Annotated[
    str | None,
    typer.Option("--transit", metavar="FILE[:LAYER]", help="Transit area."),
]
Crs = Annotated[
    str | None,
    typer.Option("--crs", metavar="EPSG:CODE", help="CRS of input that names none."),
]
DstCrs = Annotated[
    str | None,
    typer.Option("--dst-crs", metavar="EPSG:CODE", help="Compute and write in this CRS."),
]

# How it is computed.
Seed = Annotated[int, typer.Option("--seed", metavar="N", help="Seed of everything random.")]
Workers = Annotated[
    int, typer.Option("--workers", metavar="N", min=1, help="Compute on N processes.")
]
Scheduler = Annotated[
    str | None,
    typer.Option("--scheduler", metavar="ADDRESS", help="Compute on a dask cluster, or 'local'."),
]
Resume = Annotated[
    Path | None,
    typer.Option("--resume", metavar="FOLDER", help="Keep finished pieces here; take them up."),
]

# Where it goes.
Output = Annotated[
    Path | None,
    typer.Option("-o", "--output", metavar="FILE", help="Where to write; the extension decides."),
]
OutputFile = Annotated[
    Path,
    typer.Option("-o", "--output", metavar="FILE", help="Where to write; the extension decides."),
]
"""The same for verbs that always write a file."""
Into = Annotated[
    Path | None,
    typer.Option("--into", metavar="STUDY.gpkg", help="Add or replace this verb's layers there."),
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace an existing output.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout.")]

"""`covertool sample`: the sample study, copied out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from covertool.cli import options
from covertool.cli.app import app
from covertool.cli.console import say


@app.command()
def sample(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Where to copy it; made if new.")],
    overwrite: options.Overwrite = False,
) -> None:
    """Copy the synthetic sample study into a folder: open it in QGIS, or start from it.

    \b
    Examples:
      covertool sample sample
      covertool coverage sample/sample.gpkg --radius 15
    """
    from covertool.gis.sample import copy_sample

    for path in copy_sample(folder, overwrite=overwrite):
        typer.echo(path)
    say("the sample study is synthetic: its README says how it was made")

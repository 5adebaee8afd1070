"""`covertool report`: a study as one HTML page that opens offline."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from covertool.cli import options
from covertool.cli.app import app
from covertool.cli.console import say

if TYPE_CHECKING:
    from covertool.report.page import ReportStudy


Study = Annotated[
    Path | None,
    typer.Argument(metavar="STUDY.gpkg", help="A study; without one the sample plan runs."),
]
Page = Annotated[
    Path, typer.Option("-o", "--output", metavar="FILE.html", help="Where to write the page.")
]


@app.command()
def report(
    study: Study = None,
    output: Page = Path("report.html"),
    overwrite: options.Overwrite = False,
) -> None:
    """Write a study as one HTML page: map, tables, plots, provenance and limits.

    \b
    Examples:
      covertool report
      covertool report town.gpkg -o town.html
      covertool report town.gpkg -o town.html --overwrite

    \b
    The page opens in any browser without a network. It shows what the study holds and computes
    nothing: a part that is missing is named with the command that makes it. Without a study the
    sample plan (covertool run --example) runs first, and its study is kept in your cache.
    """
    from covertool.gis.guard import output_file
    from covertool.gis.textfile import HTML, write_text
    from covertool.report.page import report_page

    output_file(output, (HTML,), overwrite=overwrite)  # told before anything is read
    if study is None:
        from covertool.cli.run import study_of_the_sample_plan

        study = study_of_the_sample_plan()
    page = report_page(read_parts(study))
    write_text(output, page, HTML, overwrite=overwrite, inputs=[study])
    say(f"wrote {output} ({output.stat().st_size / 1e6:.1f} MB)")


def read_parts(study: Path) -> ReportStudy:
    """Return what a report shows of a study, as it lies in the file."""
    from covertool.gis.provenance import sha256
    from covertool.gis.study import inherited_metadata, read_layers, read_tables
    from covertool.report.page import LAYERS, TABLES, ReportStudy

    return ReportStudy(
        name=study.name,
        sha256=sha256(study),
        layers=read_layers(study, LAYERS),
        tables=read_tables(study, TABLES),
        metadata=inherited_metadata([study]),
    )

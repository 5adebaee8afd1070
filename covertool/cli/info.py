"""`covertool info`: what is in a file."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from covertool.cli import options
from covertool.cli.app import app
from covertool.cli.console import print_json

if TYPE_CHECKING:
    from covertool.gis.inspection import FileInfo, Part


@app.command()
def info(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A study, layer or raster.")],
    as_json: options.Json = False,
) -> None:
    """Tell what is in a file: layers, counts, CRS, columns, where it came from, what is wrong.

    \b
    Examples:
      covertool info town.gpkg
      covertool info orthophoto.tif --json
    """
    from covertool.gis.inspection import inspect_file

    found = inspect_file(file)
    if as_json:
        content = {**dataclasses.asdict(found), "problems": found.problems}
        print_json("info", content)
        return
    for line in _lines(found):
        typer.echo(line)


def _lines(found: FileInfo) -> list[str]:
    lines = [f"{found.path}: {found.format}, {found.size_bytes:,} bytes"]
    for part in found.parts:
        lines += _part(part)
    if found.metadata:
        lines.append("metadata")
        lines += [f"  {key}: {_short(value)}" for key, value in sorted(found.metadata.items())]
    count = found.problems
    lines.append(f"{count} problem{'' if count == 1 else 's'}" if count else "no problems")
    return lines


def _part(part: Part) -> list[str]:
    rows = f"{part.rows:,} rows" if part.kind == "table" else part.kind
    lines = [f"{part.name}: {rows}"]
    if part.crs is not None:
        lines.append(f"  CRS {part.crs}")
    if part.bounds is not None:
        lines.append("  bounds " + ", ".join(f"{value:.10g}" for value in part.bounds))
    if part.columns:
        lines.append("  columns " + ", ".join(part.columns))
    lines += [f"  {fact}" for fact in part.facts]
    return lines + [f"  problem: {problem}" for problem in part.problems]


def _short(value: str, width: int = 100) -> str:
    line = " ".join(value.split())
    return line if len(line) <= width else line[: width - 4] + " ..."

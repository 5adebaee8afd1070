"""What `covertool reproduce` prints and writes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from covertool.cli.console import print_table, say
from covertool.cli.whence import whence

if TYPE_CHECKING:
    from covertool.paper.comparison import Comparison
    from covertool.paper.scenarios import LayoutResult

COLUMNS = (
    "", "quantity", "paper", "ours", "difference", "95 % of layouts", "paper's sign", "inside",
    "best",
)  # fmt: skip


def print_comparisons(
    comparisons: Sequence[Comparison],
    numbers: Sequence[int],
    found: dict[str, list[LayoutResult]],
) -> None:
    """Print each table, what differs in its set-up, and the verdict."""
    from covertool.paper.comparison import summary
    from covertool.paper.reproduce import DIFFERENCES, OPEN_POINTS, ROMAN

    for number in numbers:
        rows = [_row(each) for each in comparisons if each.table == number]
        print_table(COLUMNS, rows, f"\nTable {ROMAN[number]}")
        for line in DIFFERENCES[number]:
            typer.echo(f"  {line}")
    for name, results in found.items():
        typer.echo(f"\n{_beside(name, results)}")
    typer.echo()
    for line in (*summary(comparisons), *(OPEN_POINTS if found else ())):
        typer.echo(line)


def _row(each: Comparison) -> list[str]:
    from covertool.report.positioning_tables import number

    interval = f"{each.interval[0]:.2f} to {each.interval[1]:.2f}" if each.interval else "-"
    sign = "-" if each.same_sign is None else f"{100 * each.same_sign:.0f} %"
    inside = "-" if each.inside is None else "yes" if each.inside else "no"
    note = f" ({each.note})" if each.note else ""
    return [
        each.row, each.quantity + note, number(each.paper), number(each.ours),
        "-" if each.difference is None else f"{each.difference:+.2f}", interval, sign, inside,
        number(each.best),
    ]  # fmt: skip


def _beside(name: str, results: Sequence[LayoutResult]) -> str:
    """Return what the paper lacks: cars without any range, on the same traffic."""
    from statistics import fmean

    from covertool.report.positioning_tables import number

    def mean(values: list[float | None]) -> str:
        known = [value for value in values if value is not None]
        return number(fmean(known) if known else None)

    return (
        f"{name}: {len(results)} layouts, {results[0].vehicles} cars, "
        f"{mean([float(each.anchors) for each in results])} anchors on average; without any range "
        f"GPS alone has {mean([each.gps_m for each in results])} m of mean error, GPS and odometry "
        f"{mean([each.gps_odometry_m for each in results])} m (rows that the paper lacks)."
    )


def json_content(
    comparisons: Sequence[Comparison],
    numbers: Sequence[int],
    found: dict[str, list[LayoutResult]],
    layouts: int,
    runs: int,
) -> dict[str, Any]:
    """Return the content of ``reproduce --json`` but for the seconds."""
    from covertool.gis.sample import SAMPLE_STUDY, sample_folder
    from covertool.paper.comparison import summary
    from covertool.paper.reproduce import DIFFERENCES, OPEN_POINTS

    return {
        "tables": list(numbers),
        "layouts": layouts,
        "runs": runs,
        "comparisons": [{**each.to_row(), "each": each.each} for each in comparisons],
        "without_ranges": {
            name: [
                {"gps_m": each.gps_m, "gps_odometry_m": each.gps_odometry_m,
                 "anchors": each.anchors, "vehicles": each.vehicles}
                for each in results
            ]
            for name, results in found.items()
        },
        "differences": {str(number): DIFFERENCES[number] for number in numbers},
        "open_points": OPEN_POINTS,
        "summary": summary(comparisons),
        "provenance": whence([sample_folder() / SAMPLE_STUDY]).to_json(),
    }  # fmt: skip


def write_comparisons(
    path: Path,
    comparisons: Sequence[Comparison],
    numbers: Sequence[int],
    layouts: int,
    overwrite: bool,
) -> None:
    """Write the figures as CSV, or the tables as Markdown."""
    if path.suffix.lower() == ".csv":
        import pandas as pd

        from covertool.gis.records import write_records

        frame = pd.DataFrame([each.to_row() for each in comparisons])
        write_records(path, [frame], overwrite=overwrite)
    else:
        from covertool.gis.textfile import MARKDOWN, write_text

        text = _markdown(comparisons, numbers, layouts)
        write_text(path, text, MARKDOWN, overwrite=overwrite)
    say(f"wrote {len(comparisons)} figures to {path}")


def _markdown(comparisons: Sequence[Comparison], numbers: Sequence[int], layouts: int) -> str:
    from covertool.paper.comparison import summary
    from covertool.paper.reproduce import DIFFERENCES, OPEN_POINTS, ROMAN

    lines = ["# The paper's tables beside ours", "", f"Layouts: seeds 1 to {layouts}.", ""]
    lines += [f"- {line}" for line in (*summary(comparisons), *OPEN_POINTS)]
    for number in numbers:
        lines += ["", f"## Table {ROMAN[number]}", "", *DIFFERENCES[number], ""]
        lines += ["| " + " | ".join(COLUMNS) + " |", "| --- | --- |" + " ---: |" * 7]
        lines += [
            "| " + " | ".join(_row(each)) + " |" for each in comparisons if each.table == number
        ]
    return "\n".join(lines) + "\n"

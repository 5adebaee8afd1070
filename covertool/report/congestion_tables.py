"""The occupancy table as text, CSV, XLSX, LaTeX and JSON."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from covertool.congestion.rounding import half_up
from covertool.errors import MissingExtraError
from covertool.gis import guard
from covertool.gis.formats import Format
from covertool.model import OccupancyTable

if TYPE_CHECKING:
    import pandas as pd

FORMATS = (
    Format("CSV", "", (".csv",)),
    Format("Excel workbook", "", (".xlsx",)),
    Format("LaTeX", "", (".tex",)),
    Format("JSON", "", (".json",)),
)
Rows = list[list[str]]


def header(table: OccupancyTable) -> list[str]:
    """Return the column names of the printed table."""
    names = [
        name
        for window in _windows(table)
        for name in (f"{window} flagged %", f"{window} filled %", f"{window} days")
    ]
    return ["day", *names]


def rows(table: OccupancyTable) -> Rows:
    """Return the printed table: the days, then the means with their confidence intervals."""
    days = list(dict.fromkeys(cell.day for cell in table.cells))
    cells = {(cell.day, cell.window): cell for cell in table.cells}
    means = {(mean.group, mean.window): mean for mean in table.means}
    body = []
    for day in days:
        row = [day]
        for window in _windows(table):
            cell = cells[day, window]
            row += [_percent(cell.percent), _percent(cell.filled_percent), str(cell.days)]
        body.append(row)
    for group in dict.fromkeys(mean.group for mean in table.means):
        row = [f"{group} mean"]
        for window in _windows(table):
            mean = means[group, window]
            row += [mean.text or "-", _percent(mean.filled_percent), str(mean.count)]
        body.append(row)
        intervals = [means[group, window].ci95 for window in _windows(table)]
        if any(intervals):
            body.append([f"{group} 95 % from", *_thirds(intervals, 0)])
            body.append([f"{group} 95 % to", *_thirds(intervals, 1)])
    return body


def _thirds(intervals: Sequence[tuple[float, float] | None], end: int) -> list[str]:
    """Return one end of each window's interval, under the first of the window's three columns."""
    ends = ["-" if interval is None else half_up(interval[end]) for interval in intervals]
    return [text for value in ends for text in (value, "", "")]


def content(table: OccupancyTable) -> dict[str, Any]:
    """Return the table as JSON knows it; percentages are not rounded."""
    return {
        "cells": [dict(vars(cell)) for cell in table.cells],
        "means": [dict(vars(mean)) for mean in table.means],
        "days": [{**vars(day), "date": day.date.isoformat()} for day in table.days],
    }


def tables(table: OccupancyTable) -> dict[str, pd.DataFrame]:
    """Return the cells and the means as the tables of a study; percentages are not rounded."""
    import pandas as pd

    def frame(records: Sequence[object]) -> pd.DataFrame:
        whole = pd.DataFrame([vars(record) for record in records])
        ends = pd.DataFrame(
            [(None, None) if pair is None else pair for pair in whole.pop("ci95")],
            columns=["ci95_low", "ci95_high"],
            dtype=float,
        )
        return whole.join(ends)

    return {"occupancy": frame(table.cells), "occupancy_means": frame(table.means)}


def write_table(path: str | Path, table: OccupancyTable, *, overwrite: bool = False) -> None:
    """Write the table; the extension decides the format.

    Raises
    ------
    FileError
        When the path cannot be written.
    MissingExtraError
        When an XLSX is asked for and openpyxl is not installed.
    """
    target, known = guard.output_file(path, FORMATS, overwrite=overwrite)
    with guard.replacing(target) as temporary:
        _WRITERS[known.name](temporary, table)


def _windows(table: OccupancyTable) -> list[str]:
    return list(dict.fromkeys(cell.window for cell in table.cells))


def _percent(value: float | None) -> str:
    return "-" if value is None else half_up(value)


def _write_csv(path: Path, table: OccupancyTable) -> None:
    names = ("day", "window", "percent", "filled_percent", "days", "observed_fraction")
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*names, "ci95_low", "ci95_high"])
        for cell in table.cells:
            writer.writerow([*(getattr(cell, name) for name in names), *(cell.ci95 or ("", ""))])
        for mean in table.means:
            figures = (mean.percent, mean.filled_percent, mean.count, "")
            interval = mean.ci95 or ("", "")
            writer.writerow([f"{mean.group} mean", mean.window, *figures, *interval])


def _write_xlsx(path: Path, table: OccupancyTable) -> None:
    try:
        from openpyxl import Workbook
    except ImportError:
        raise MissingExtraError(
            "XLSX files need the package openpyxl", str(path), "pip install openpyxl, or write .csv"
        ) from None
    book = Workbook()
    sheet = book.active
    sheet.title = "congestion"
    sheet.append(header(table))
    for row in rows(table):
        sheet.append([row[0], *(_number(text) for text in row[1:])])
    # A name that begins with = must stay a name.
    for cells in sheet.iter_rows():
        for cell in cells:
            if cell.data_type == "f":
                cell.data_type = "s"
    sheet.freeze_panes = "B2"
    book.save(path)


def _number(text: str) -> float | None:
    return float(text) if text not in ("-", "") else None


def _write_latex(path: Path, table: OccupancyTable) -> None:
    columns = header(table)
    lines = [
        rf"\begin{{tabular}}{{l{'r' * (len(columns) - 1)}}}",
        r"\hline",
        _latex_row(columns),
        r"\hline",
        *(_latex_row(row) for row in rows(table)),
        r"\hline",
        r"\end{tabular}",
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


_LATEX_SPECIAL: Mapping[int, str] = str.maketrans(
    {char: rf"\{char}" for char in "%&_#${}"} | {"\\": r"\textbackslash{}"}
)


def _latex_row(row: list[str]) -> str:
    return " & ".join(text.translate(_LATEX_SPECIAL) for text in row) + r" \\"


def _write_json(path: Path, table: OccupancyTable) -> None:
    whole = {"schema_version": 1, "command": "congestion table", **content(table)}
    path.write_text(json.dumps(whole, ensure_ascii=False, indent=1) + "\n", encoding="utf-8")


_WRITERS: Mapping[str, Callable[[Path, OccupancyTable], None]] = {
    "CSV": _write_csv,
    "Excel workbook": _write_xlsx,
    "LaTeX": _write_latex,
    "JSON": _write_json,
}

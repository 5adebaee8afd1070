"""The occupancy table as text, CSV, XLSX, LaTeX and JSON."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from covertool.congestion.rounding import half_up
from covertool.gis import guard
from covertool.gis.formats import Format
from covertool.gis.spreadsheet import CSV_TABLE, XLSX, write_csv, write_workbook
from covertool.gis.textfile import LATEX, write_text
from covertool.model import OccupancyTable
from covertool.model.sheets import Cell, Heading, Sheet
from covertool.report.markup import latex

if TYPE_CHECKING:
    import pandas as pd

FORMATS = (CSV_TABLE, XLSX, LATEX, Format("JSON", "", (".json",)))
_TITLE = "Share of the street length that is slow or stands, by weekday and time"
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
    """
    checked, known = guard.output_file(path, FORMATS, overwrite=overwrite)
    if known is CSV_TABLE:
        write_csv(checked, _cells(table), overwrite=overwrite)
    elif known is XLSX:
        write_workbook(checked, [_printed(table)], title=_TITLE, overwrite=overwrite)
    elif known is LATEX:
        write_text(checked, latex([_printed(table)]), known, overwrite=overwrite)
    else:
        whole = {"schema_version": 1, "command": "congestion table", **content(table)}
        text = json.dumps(whole, ensure_ascii=False, indent=1)
        write_text(checked, f"{text}\n", known, overwrite=overwrite)


def _windows(table: OccupancyTable) -> list[str]:
    return list(dict.fromkeys(cell.window for cell in table.cells))


def _percent(value: float | None) -> str:
    return "-" if value is None else half_up(value)


def _cells(table: OccupancyTable) -> Sheet:
    """Return one row for each cell and mean, with all digits."""
    names = ("day", "window", "percent", "filled_percent", "days", "observed_fraction")
    rows: list[tuple[Cell, ...]] = [
        (*(getattr(cell, name) for name in names), *(cell.ci95 or (None, None)))
        for cell in table.cells
    ]
    rows += [
        (f"{mean.group} mean", mean.window, mean.percent, mean.filled_percent, mean.count, None)
        + (mean.ci95 or (None, None))
        for mean in table.means
    ]
    titles = tuple(Heading(name, name) for name in (*names, "ci95_low", "ci95_high"))
    return Sheet("congestion", _TITLE, titles, tuple(rows))


def _printed(table: OccupancyTable) -> Sheet:
    """Return the printed table with its figures as numbers."""
    first, *others = header(table)
    titles = [Heading(name, name, 0 if name.endswith(" days") else 2) for name in others]
    body = [(row[0], *(_number(text) for text in row[1:])) for row in rows(table)]
    return Sheet("congestion", _TITLE, (Heading(first, first), *titles), tuple(body))


def _number(text: str) -> float | None:
    return float(text) if text not in ("-", "") else None

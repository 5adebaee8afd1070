"""What a study found, as tables for a spreadsheet, a paper or a page; nothing is computed anew."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from covertool.errors import FileError, OptionError
from covertool.gis.provenance import provenances
from covertool.model.coverage import LEVEL_LABELS, LEVELS
from covertool.model.sheets import Cell, Heading, Sheet
from covertool.report.dictionary import heading, meaning
from covertool.report.findings import Findings
from covertool.report.parts import PARTS, typed

if TYPE_CHECKING:
    import pandas as pd


ALWAYS = ("summary", "parameters", "dictionary")
TABLE_NAMES = ("summary", *PARTS, "parameters", "dictionary")
"""The sheets of a workbook, in their order; of `PARTS` those that the study holds."""


def sheet(found: Findings, name: str) -> Sheet:
    """Return one table of a study.

    Raises
    ------
    OptionError
        When there is no table of that name.
    FileError
        When the study lacks what it is made from; the error names the verb.
    """
    if name in _MADE:
        return _MADE[name](found)
    if name not in PARTS:
        raise OptionError(
            f"there is no table {name!r}", "--table", f"choose one of: {', '.join(TABLE_NAMES)}"
        )
    part = PARTS[name]
    frame = found.tables.get(part.table)
    if frame is None:
        raise part.absent(found.path)
    as_levels = {"level", "fraction"} <= set(frame.columns) or "expected" in frame.columns
    return (_side_by_side if as_levels else _flat)(name, part.title, frame)


def sheets(found: Findings) -> list[Sheet]:
    """Return every table that a study holds, the summary first.

    Raises
    ------
    FileError
        When the study holds no findings at all.
    """
    held = [name for name, part in PARTS.items() if part.table in found.tables]
    if not held:
        raise FileError(
            "the study holds no findings yet",
            found.path,
            typed(PARTS["coverage"].mend, found.path),
        )
    return [sheet(found, name) for name in TABLE_NAMES if name in held or name in ALWAYS]


def _flat(name: str, title: str, frame: pd.DataFrame) -> Sheet:
    columns = [str(column) for column in frame.columns]
    rows = zip(*(frame[column].tolist() for column in frame.columns), strict=True)
    return Sheet(
        name,
        title,
        tuple(heading(column, name) for column in columns),
        tuple(tuple(_cell(value) for value in row) for row in rows),
    )


def _cell(value: Any) -> Cell:
    """Return a value as a cell: what is missing is empty, what is no number is text."""
    import pandas as pd

    if pd.isna(value):
        return None
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return value
    return str(value)


_OF_LEVELS: Mapping[str, tuple[str, str, float, int]] = {
    # column: (name, unit, factor, decimals)
    "area_m2": ("m2", "m2", 1.0, 0),
    "fraction": ("percent", "%", 100.0, 2),
    "expected": ("percent", "%", 100.0, 2),
    "se": ("se_percent", "standard error, %", 100.0, 4),
    "slope_per_m": ("percent_per_m", "% per m", 100.0, 3),
}


def _side_by_side(name: str, title: str, frame: pd.DataFrame) -> Sheet:
    """Return the four levels of a thing in one row, as in the paper's Table IV."""
    values = [column for column in _OF_LEVELS if column in frame.columns]
    keys = [str(column) for column in frame.columns if column not in (*values, "level")]
    titles = [heading(key) for key in keys]
    for level, label in enumerate(LEVEL_LABELS):
        for column in values:
            short, unit, _, digits = _OF_LEVELS[column]
            titles.append(Heading(f"level_{level}_{short}", f"{label} ({unit})", digits))
    titles.append(Heading("covered_percent", "covered, Levels 1 to 3 (%)", 2))
    rows = []
    for key, group in frame.groupby(keys, dropna=False, sort=False):
        by_level = group.set_index("level")[values].to_dict("index")
        cells = [_cell(value) for value in key]
        for level in LEVELS:
            found = by_level.get(level, {})
            cells += [_scaled(found.get(column), _OF_LEVELS[column][2]) for column in values]
        shares = [by_level.get(level, {}).get(_share_of(values)) for level in (1, 2, 3)]
        rows.append((*cells, 100 * sum(share for share in shares if share is not None)))
    return Sheet(name, title, tuple(titles), tuple(rows))


def _share_of(values: Sequence[str]) -> str:
    return "expected" if "expected" in values else "fraction"


def _scaled(value: Any, factor: float) -> Cell:
    cell = _cell(value)
    return cell * factor if isinstance(cell, int | float) else None


def _summary(found: Findings) -> Sheet:
    """Return the figures of a study that are asked for first."""
    rows: list[tuple[Cell, ...]] = [
        ("study", found.name, "", found.metadata.get("title")),
        ("run", found.run_id, "", "first digits of the study's SHA-256"),
        ("coordinate reference system", found.crs, "", None),
    ]
    if "synthetic" in found.metadata:
        rows.append(("synthetic", found.metadata["synthetic"], "", "no measured data"))
    if found.transit_area_m2 is not None:
        rows.append(("transit area", round(found.transit_area_m2, 1), "m2", "where cars drive"))
    rows += [
        (f"rows of the layer {name}", count, "", None)
        for name, count in found.counts.items()
        if not name.startswith("coverage_level_")  # which has one row a radius
    ]
    rows += [*_covered(found), *_congested(found), *_improved(found), *_missing(found)]
    titles = (
        Heading("item", "item"),
        Heading("value", "value"),
        Heading("unit", "unit"),
        Heading("note", "note"),
    )
    return Sheet("summary", f"Summary of {found.name}", titles, tuple(rows))


def _rounded(value: Any) -> Cell:
    cell = _cell(value)
    return round(cell, 2) if isinstance(cell, float) else cell


def _covered(found: Findings) -> list[tuple[Cell, ...]]:
    if "coverage_summary" not in found.tables:
        return []
    table = sheet(found, "coverage")
    names = [title.name for title in table.headings]
    rows: list[tuple[Cell, ...]] = []
    for row in table.rows:
        values: dict[str, Any] = dict(zip(names, row, strict=True))
        size = "each its own" if values["radius_m"] is None else f"{values['radius_m']:g} m"
        size = f"{size}, {values['origin']} only" if values.get("origin") else size
        note = f"Level 3 alone: {values['level_3_percent']:.2f} %"
        rows.append((f"covered at radius {size}", _rounded(values["covered_percent"]), "%", note))
    return rows


def _congested(found: Findings) -> list[tuple[Cell, ...]]:
    table = found.tables.get("occupancy_means")
    if table is None:
        return []
    return [
        (f"flagged street length, {group} {window}", _rounded(percent), "%", f"mean of {count}")
        for group, window, percent, count in zip(
            table["group"], table["window"], table["percent"], table["count"], strict=True
        )
    ]


def _improved(found: Findings) -> list[tuple[Cell, ...]]:
    """Return what parked cars take off the position error, case by case."""
    table = found.tables.get("improvements")
    if table is None or not {"vehicle", "percent", "estimator"} <= set(table.columns):
        return []
    rows: list[tuple[Cell, ...]] = []
    for record in table[table["vehicle"] == "all"].to_dict("records"):
        named = [
            f"{key} {value}" if isinstance(value, str) else f"{key} {value:g}"
            for key, value in record.items()
            if key in ("estimator", "preset", "sigma_range_m", "radius_m")
            and _cell(value) is not None
        ]
        rows.append(
            ("position error taken off", _rounded(record["percent"]), "%", ", ".join(named))
        )
    return rows


def _missing(found: Findings) -> list[tuple[Cell, ...]]:
    return [
        (f"not in this study: {name.replace('_', ' ')}", None, "", f"made by: {part.mend}")
        for name, part in PARTS.items()
        if part.table not in found.tables
    ]


def _parameters(found: Findings) -> Sheet:
    """Return the provenance of every verb that wrote into the study, one row for each fact."""
    rows: list[tuple[Cell, ...]] = []
    told_by, rest = provenances(found.metadata)
    rows += [("study", "metadata", key, text) for key, text in rest.items()]
    for verb, told in told_by.items():
        rows.append((verb, "command", "", " ".join(map(str, told.get("command", [])))))
        rows += [
            (verb, "input sha256", str(given.get("path")), str(given.get("sha256")))
            for given in told.get("inputs", [])
        ]
        for kind in ("options", "seeds", "versions"):
            rows += [
                (verb, kind.removesuffix("s"), str(name), str(value))
                for name, value in told.get(kind, {}).items()
            ]
    titles = tuple(Heading(name, name) for name in ("verb", "kind", "name", "value"))
    return Sheet("parameters", "Parameters and provenance", titles, tuple(rows))


def _dictionary(found: Findings) -> Sheet:
    rows = [
        (where, column, *meaning(column, where))
        for where, columns in found.columns.items()
        for column in columns
    ]
    names = ("layer or table", "column", "meaning", "unit")
    titles = tuple(Heading(name.replace(" ", "_"), name) for name in names)
    return Sheet("dictionary", "Data dictionary", titles, tuple(rows))


_MADE: Mapping[str, Callable[[Findings], Sheet]] = {
    "summary": _summary,
    "parameters": _parameters,
    "dictionary": _dictionary,
}

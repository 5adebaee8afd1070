"""Tables that go out to spreadsheets (XLSX) and as CSV; no cell of text is ever a formula."""

from __future__ import annotations

import csv
import zipfile
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

from covertool.errors import FileError
from covertool.gis import guard
from covertool.gis.formats import Format
from covertool.gis.textfile import speakable
from covertool.model.sheets import Cell, Heading, Sheet

XLSX = Format("Excel workbook", "XLSX", (".xlsx",), ((0, b"PK\x03\x04"),), layers=True)
CSV_TABLE = Format("CSV", "CSV", (".csv",))

_STARTS_FORMULA = ("=", "+", "-", "@", "\t", "\r")
_DATE = datetime(2000, 1, 1)
_ROWS = 1_048_576
_CELL_CHARACTERS = 32_767
_SHEET_NAME = 31
_WIDEST = 60


def starts_formula(text: str) -> bool:
    """Return True for text that a spreadsheet would run as a formula.

    >>> starts_formula("=1+1"), starts_formula("Main Street")
    (True, False)
    """
    return text.startswith(_STARTS_FORMULA)


def write_workbook(
    path: str | Path, sheets: Sequence[Sheet], *, title: str = "", overwrite: bool = False
) -> None:
    """Write sheets as one XLSX workbook; the same sheets give the same bytes.

    Numbers stay numbers with all their digits, text stays text also where it begins like a
    formula, and the first row holds the column names.

    Raises
    ------
    FileError
        When the path may not be written or a sheet has more rows than the format.
    """
    import openpyxl
    from openpyxl.writer.excel import ExcelWriter

    checked, _ = guard.output_file(path, (XLSX,), overwrite=overwrite)
    book = openpyxl.Workbook()
    book.remove(book.active)
    book.properties.creator = "covertool"
    book.properties.title = speakable(title)
    book.properties.created = book.properties.modified = _DATE
    for sheet in sheets:
        _fill(book.create_sheet(sheet.name[:_SHEET_NAME]), sheet, str(checked))
    with guard.replacing(checked) as temporary:
        with _UndatedZip(temporary, "w", zipfile.ZIP_DEFLATED, allowZip64=True) as archive:
            ExcelWriter(book, archive).save()
        _check(temporary, checked, sheets)


class _UndatedZip(zipfile.ZipFile):
    """An archive whose entries all bear the same date."""

    def writestr(
        self,
        zinfo_or_arcname: Any,
        data: Any,
        compress_type: int | None = None,
        compresslevel: int | None = None,
    ) -> None:
        name = getattr(zinfo_or_arcname, "filename", zinfo_or_arcname)
        entry = zipfile.ZipInfo(name, _DATE.timetuple()[:6])
        super().writestr(entry, data, compress_type or zipfile.ZIP_DEFLATED, compresslevel)

    def write(
        self,
        filename: Any,
        arcname: Any = None,
        compress_type: int | None = None,
        compresslevel: int | None = None,
    ) -> None:
        content = Path(filename).read_bytes()
        self.writestr(str(arcname or filename), content, compress_type, compresslevel)


def _fill(page: Any, sheet: Sheet, where: str) -> None:
    """Write a sheet's names and rows into a page of a workbook."""
    from openpyxl.styles import Alignment, Font

    if len(sheet.rows) >= _ROWS:
        raise FileError(
            f"the table {sheet.name} has {len(sheet.rows):,} rows; a workbook takes {_ROWS - 1:,}",
            where,
            f"write it as CSV: --table {sheet.name} -o {sheet.name}.csv",
        )
    for column, heading in enumerate(sheet.headings, start=1):
        cell = page.cell(1, column)
        _set(cell, heading.label)
        cell.font = Font(bold=True)
        cell.alignment = Alignment(wrap_text=True, vertical="top")
        page.column_dimensions[cell.column_letter].width = _width(sheet, column - 1)
    for row, values in enumerate(sheet.rows, start=2):
        for column, (heading, value) in enumerate(
            zip(sheet.headings, values, strict=True), start=1
        ):
            if value is not None:
                cell = page.cell(row, column)
                _set(cell, value)
                cell.number_format = _number_format(heading, value)
    page.freeze_panes = "B2"


def _set(cell: Any, value: Cell) -> None:
    if not isinstance(value, str):
        finite = value is not None and value == value and abs(value) != float("inf")
        cell.value = value if finite else None
        return
    text = speakable(value)[:_CELL_CHARACTERS]
    cell.value = text
    cell.data_type = "s"
    if starts_formula(text):
        cell.quotePrefix = True


def _number_format(heading: Heading, value: Cell) -> str:
    if isinstance(value, str) or heading.digits is None:
        return "General"
    return "0" if heading.digits == 0 else f"0.{'0' * heading.digits}"


def _width(sheet: Sheet, column: int) -> float:
    cells = [row[column] for row in sheet.rows[:200]]
    lengths = [len(cell) if isinstance(cell, str) else 11 for cell in cells if cell is not None]
    longest_word = max(map(len, sheet.headings[column].label.split()), default=0)
    return float(min(max([longest_word + 2, *lengths, 8]), _WIDEST))


def _check(temporary: Path, path: Path, sheets: Sequence[Sheet]) -> None:
    """Reopen the workbook and count the rows of each sheet."""
    import openpyxl

    book = openpyxl.load_workbook(temporary, read_only=True)
    try:
        for sheet in sheets:
            rows = book[sheet.name[:_SHEET_NAME]].max_row
            if rows != len(sheet.rows) + 1:
                raise FileError(
                    f"{rows - 1} of {len(sheet.rows)} rows of {sheet.name} arrived",
                    str(path),
                    "check free space and try again",
                )
    finally:
        book.close()


def write_csv(path: str | Path, sheet: Sheet, *, overwrite: bool = False) -> None:
    """Write one sheet as CSV in UTF-8: names that programs look up, numbers with all their digits.

    Text that a spreadsheet would run as a formula is led by an apostrophe, as it marks text there.

    Raises
    ------
    FileError
        When the path may not be written.
    """
    checked, _ = guard.output_file(path, (CSV_TABLE,), overwrite=overwrite)
    with (
        guard.replacing(checked) as temporary,
        temporary.open("w", encoding="utf-8", newline="") as file,
    ):
        writer = csv.writer(file)  # RFC 4180: lines end in CRLF, so that a lone CR is quoted
        writer.writerow([heading.name for heading in sheet.headings])
        writer.writerows([_csv_cell(cell) for cell in row] for row in sheet.rows)


def _csv_cell(cell: Cell) -> Cell:
    return f"'{cell}" if isinstance(cell, str) and starts_formula(cell) else cell

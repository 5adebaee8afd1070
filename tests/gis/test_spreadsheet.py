"""Workbooks and CSV tables as pandas and openpyxl read them back."""

import csv
import zipfile
from pathlib import Path

import openpyxl
import pandas as pd
import pytest

from covertool.errors import ColumnError, FileError
from covertool.gis.spreadsheet import write_csv, write_workbook
from covertool.model.sheets import Heading, Sheet

FORMULAS = ["=1+1", "+1", "-1+cmd|' /C calc'!A0", "@SUM(A1)", "\t=1", "\r=1", '=HYPERLINK("x")']


def sheet(rows: tuple[tuple[object, ...], ...], name: str = "zones") -> Sheet:
    headings = (Heading("zone", "zone"), Heading("area_m2", "area (m2)", 1))
    return Sheet(name, "Zones", headings, rows)  # type: ignore[arg-type]


def test_text_that_begins_like_a_formula_stays_text_in_a_workbook(tmp_path: Path) -> None:
    path = tmp_path / "t.xlsx"
    write_workbook(path, [sheet(tuple((text, -1.5) for text in FORMULAS))])
    page = openpyxl.load_workbook(path)["zones"]
    cells = [page.cell(row, 1) for row in range(2, 2 + len(FORMULAS))]
    assert {cell.data_type for cell in cells} == {"s"}
    assert all(cell.quotePrefix for cell in cells)
    assert [str(cell.value).replace("\r", "") for cell in cells] == [
        text.replace("\r", "") for text in FORMULAS
    ]
    with zipfile.ZipFile(path) as archive:
        assert b"<f>" not in archive.read("xl/worksheets/sheet1.xml")
    assert [page.cell(row, 2).value for row in range(2, 4)] == [-1.5, -1.5]


def test_text_that_begins_like_a_formula_is_quoted_in_csv_and_numbers_are_not(tmp_path) -> None:
    path = tmp_path / "t.csv"
    write_csv(path, sheet(tuple((text, -1.5) for text in FORMULAS)))
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    assert [row[0] for row in rows[1:]] == [f"'{text}" for text in FORMULAS]
    assert {row[1] for row in rows[1:]} == {"-1.5"}


def test_a_label_of_a_column_is_no_formula_either(tmp_path: Path) -> None:
    path = tmp_path / "t.xlsx"
    write_workbook(path, [Sheet("s", "s", (Heading("=x", "=1+1"),), ())])
    assert openpyxl.load_workbook(path)["s"].cell(1, 1).data_type == "s"


def test_pandas_reads_numbers_with_all_their_digits(tmp_path: Path) -> None:
    path = tmp_path / "t.xlsx"
    write_workbook(path, [sheet((("a", 0.1 + 0.2), ("Straße", None))), sheet((), "none")])
    back = pd.read_excel(path, sheet_name=None)
    assert list(back) == ["zones", "none"]
    assert back["zones"]["area (m2)"].tolist()[0] == pytest.approx(0.3, rel=1e-14)
    assert back["zones"]["area (m2)"].isna().tolist() == [False, True]
    assert back["zones"]["zone"].tolist() == ["a", "Straße"]
    assert len(back["none"]) == 0


def test_what_a_cell_cannot_hold_is_replaced_or_left_empty(tmp_path: Path) -> None:
    path = tmp_path / "t.xlsx"
    rows = (("a\x00b", float("nan")), ("x" * 40_000, float("inf")))
    write_workbook(path, [sheet(rows)])
    page = openpyxl.load_workbook(path)["zones"]
    assert page.cell(2, 1).value == "a\ufffdb"
    assert len(str(page.cell(3, 1).value)) == 32_767
    assert page.cell(2, 2).value is None is page.cell(3, 2).value


def test_the_same_sheets_give_the_same_bytes(tmp_path: Path) -> None:
    for name in ("one.xlsx", "two.xlsx"):
        write_workbook(tmp_path / name, [sheet((("a", 1.0),))], title="town")
    assert (tmp_path / "one.xlsx").read_bytes() == (tmp_path / "two.xlsx").read_bytes()
    with zipfile.ZipFile(tmp_path / "one.xlsx") as archive:
        assert {entry.date_time[0] for entry in archive.infolist()} == {2000}


def test_more_rows_than_a_workbook_takes_are_refused_with_the_way_out(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="1,048,576") as caught:
        write_workbook(tmp_path / "t.xlsx", [sheet((("a", 1.0),) * 1_048_576)])
    assert "--table zones" in caught.value.mend
    assert list(tmp_path.iterdir()) == []


def test_a_row_has_one_cell_for_each_column() -> None:
    with pytest.raises(ColumnError):
        sheet((("a",),))

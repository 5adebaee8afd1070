"""Tables as LaTeX and Markdown: what users write stays text, numbers are rounded half up."""

import re

import pytest

from covertool.model.sheets import Heading, Sheet
from covertool.report.markup import latex, markdown, texts

NASTY = r"50 % & {a_b} \input{/etc/passwd} $x^2$ #1 ~ <b> | `c`"


def sheet(*cells: object) -> Sheet:
    rows = tuple((cell, 2.345) for cell in cells)
    return Sheet("my_zones", NASTY, (Heading("z", "zone"), Heading("p", "p (%)", 2)), rows)  # type: ignore[arg-type]


def test_numbers_are_rounded_half_up_in_decimal_and_gaps_are_dashes() -> None:
    rows = ((13.025, None), (2.675, float("2")))
    table = Sheet("s", "s", (Heading("a", "a", 2), Heading("b", "b")), rows)
    assert texts(table) == [["13.03", "-"], ["2.68", "2"]]


def test_latex_has_the_rules_of_booktabs_and_one_cell_for_each_column() -> None:
    text = latex([sheet("Main Street")])
    for rule in (r"\toprule", r"\midrule", r"\bottomrule", r"\begin{tabular}{lr}"):
        assert text.count(rule) == 1
    assert r"Main Street & 2.35 \\" in text
    assert r"\label{tab:my-zones}" in text


def test_nothing_that_a_user_writes_is_a_command_in_latex() -> None:
    text = latex([sheet(NASTY)])
    left = text.replace(r"\textbackslash{}", "").replace(r"\textasciitilde{}", "")
    left = left.replace(r"\textasciicircum{}", "")
    assert r"\input" not in left
    row = next(line for line in left.splitlines() if line.startswith("50"))
    assert not re.search(r"(?<!\\)[%#$_]", row)
    assert len(re.findall(r"(?<!\\)&", row)) == 1
    assert not re.search(
        r"[~^<>](?!\\})", row.replace(r"\textless{}", "").replace(r"\textgreater{}", "")
    )


def test_nothing_that_a_user_writes_breaks_a_markdown_table() -> None:
    text = markdown([sheet(NASTY, "line\nbreak")])
    rows = [line for line in text.splitlines() if line.startswith("|")]
    assert len(rows) == 4
    assert all(len(re.findall(r"(?<!\\)\|", row)) == 3 for row in rows)
    assert not any(re.search(r"(?<!\\)<b", row) for row in rows)
    assert "| --- | ---: |" in rows


@pytest.mark.parametrize("render", [latex, markdown])
def test_a_table_without_rows_is_a_table(render) -> None:
    assert "zone" in render([sheet()])

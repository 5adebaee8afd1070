"""Tables as text for papers and pages: LaTeX with booktabs' rules, and Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from covertool.congestion.rounding import half_up
from covertool.model.sheets import Cell, Heading, Sheet

_LATEX: Mapping[int, str] = str.maketrans(
    {char: rf"\{char}" for char in "%&_#${}"}
    | {
        "\\": r"\textbackslash{}",
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
        "<": r"\textless{}",
        ">": r"\textgreater{}",
        "\n": " ",
        "\r": " ",
    }
)
_MARKDOWN: Mapping[int, str] = str.maketrans(
    {char: f"\\{char}" for char in "\\|`*_[]<>"} | {"\n": " ", "\r": " "}
)


def latex(sheets: Iterable[Sheet]) -> str:
    r"""Return each sheet as a LaTeX table; the document needs ``\usepackage{booktabs}``.

    >>> from covertool.model.sheets import Heading, Sheet
    >>> sheet = Sheet("s", "50 % & more", (Heading("a", "a"),), (("x_1",),))
    >>> "50 \\% \\& more" in latex([sheet]), "x\\_1" in latex([sheet])
    (True, True)
    """
    return "\n".join(["% needs \\usepackage{booktabs}", *map(_latex_table, sheets)])


def _latex_table(sheet: Sheet) -> str:
    """Return one sheet as a LaTeX table."""
    columns = "".join("r" if _is_number(sheet, i) else "l" for i in range(len(sheet.headings)))
    lines = [
        r"\begin{table}",
        rf"\caption{{{sheet.title.translate(_LATEX)}}}",
        rf"\label{{tab:{sheet.name.replace('_', '-')}}}",
        r"\centering",
        rf"\begin{{tabular}}{{{columns}}}",
        r"\toprule",
        _latex_row(heading.label for heading in sheet.headings),
        r"\midrule",
        *(_latex_row(row) for row in texts(sheet)),
        r"\bottomrule",
        r"\end{tabular}",
        r"\end{table}",
        "",
    ]
    return "\n".join(lines)


def _latex_row(cells: Iterable[str]) -> str:
    return " & ".join(cell.translate(_LATEX) for cell in cells) + r" \\"


def markdown(sheets: Iterable[Sheet]) -> str:
    r"""Return each sheet as a Markdown table under its title.

    >>> from covertool.model.sheets import Heading, Sheet
    >>> print(markdown([Sheet("s", "Sizes", (Heading("r", "r (m)", 1),), ((1.25,),))]))
    ## Sizes
    <BLANKLINE>
    | r (m) |
    | ---: |
    | 1.3 |
    <BLANKLINE>
    """
    return "\n".join(map(_markdown_table, sheets))


def _markdown_table(sheet: Sheet) -> str:
    rules = ["---:" if _is_number(sheet, i) else "---" for i in range(len(sheet.headings))]
    lines = [
        f"## {sheet.title.translate(_MARKDOWN)}",
        "",
        _markdown_row(heading.label.translate(_MARKDOWN) for heading in sheet.headings),
        _markdown_row(rules),
        *(_markdown_row(text.translate(_MARKDOWN) for text in row) for row in texts(sheet)),
        "",
    ]
    return "\n".join(lines)


def _markdown_row(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"


def texts(sheet: Sheet) -> list[list[str]]:
    """Return the cells as people read them: rounded half up, a dash where a cell is empty."""
    return [
        [_shown(heading, cell) for heading, cell in zip(sheet.headings, row, strict=True)]
        for row in sheet.rows
    ]


def _shown(heading: Heading, cell: Cell) -> str:
    if cell is None:
        return "-"
    if isinstance(cell, str):
        return cell
    if heading.digits is not None:
        return half_up(float(cell), heading.digits)
    return f"{cell:.10g}"


def _is_number(sheet: Sheet, column: int) -> bool:
    cells = [row[column] for row in sheet.rows if row[column] is not None]
    return bool(cells) and not any(isinstance(cell, str) for cell in cells)

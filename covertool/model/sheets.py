"""Tables for people: named columns with words to read, and cells of numbers and text."""

from __future__ import annotations

from dataclasses import dataclass

from covertool.errors import ColumnError

Cell = str | float | int | None


@dataclass(frozen=True)
class Heading:
    """One column of a sheet.

    Attributes
    ----------
    name : as other programs look it up, such as ``area_m2``
    label : as people read it, with its unit
    digits : decimals to show; None for text and for numbers as they are
    """

    name: str
    label: str
    digits: int | None = None


@dataclass(frozen=True)
class Sheet:
    """A table of findings.

    Attributes
    ----------
    name : short and unique, such as ``coverage``
    title : one line that says what the table shows
    headings : the columns
    rows : one tuple for each row, with a cell for each column; None is an empty cell

    Raises
    ------
    ColumnError
        When a row has not one cell for each column.

    Examples
    --------
    >>> sheet = Sheet("radii", "Radii", (Heading("radius_m", "radius (m)", 0),), ((15.0,),))
    >>> sheet.rows[0][0]
    15.0
    """

    name: str
    title: str
    headings: tuple[Heading, ...]
    rows: tuple[tuple[Cell, ...], ...]

    def __post_init__(self) -> None:
        wrong = next((row for row in self.rows if len(row) != len(self.headings)), None)
        if wrong is not None:
            raise ColumnError(
                f"a row has {len(wrong)} cells, not {len(self.headings)}",
                f"the table {self.name}",
                "give each row one cell for each column",
            )

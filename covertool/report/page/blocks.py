"""The pieces that a page is made of: prose, tables, plots, and parts that are missing."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

if TYPE_CHECKING:
    from bokeh.models import Model

    from covertool.report.page.theme import Pair


@dataclass(frozen=True)
class Prose:
    """Paragraphs of plain text."""

    kind: ClassVar[str] = "prose"
    paragraphs: tuple[str, ...]


@dataclass(frozen=True)
class Table:
    """A table of texts, whose first column names the row.

    Attributes
    ----------
    caption : what the table shows
    columns : the head of each column
    rows : texts, each row as long as ``columns``
    words : how many columns from the left hold words; the others hold numbers
    folded : whether the reader unfolds it first
    note : a line below
    """

    kind: ClassVar[str] = "table"
    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    words: int = 1
    folded: bool = False
    note: str = ""


@dataclass(frozen=True)
class Bars:
    """Shares of Levels 1, 2, 3 and 0 as stacked bars: label and four shares in percent each."""

    kind: ClassVar[str] = "bars"
    rows: tuple[tuple[str, tuple[float, float, float, float]], ...]


@dataclass(frozen=True)
class KeyEntry:
    """One entry of a plot's key: its form (area, dot, tick, line, dashed) and colour."""

    label: str
    form: str
    colour: Pair


@dataclass(frozen=True)
class Plot:
    """A plot and, for those who do not see it, what it says.

    Attributes
    ----------
    key : the name of its element on the page
    title : the headline
    summary : what the plot says, in a sentence or two
    figure : the Bokeh figure
    entries : the key; it stands in the page's own text, which wraps where a plot's does not
    """

    kind: ClassVar[str] = "plot"
    key: str
    title: str
    summary: str
    figure: Model = field(repr=False)
    entries: tuple[KeyEntry, ...] = ()


@dataclass(frozen=True)
class Missing:
    """A part that the study does not hold, and the command that makes it."""

    kind: ClassVar[str] = "missing"
    what: str
    command: str


Block = Prose | Table | Bars | Plot | Missing


@dataclass(frozen=True)
class Section:
    """A headed part of the page."""

    key: str
    title: str
    blocks: tuple[Block, ...]

    @property
    def plots(self) -> list[Plot]:
        """The plots among the blocks."""
        return [block for block in self.blocks if isinstance(block, Plot)]

"""Texts of the map's pop-ups."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd

Values = dict[str, list[str]]
"""Texts by heading, one for each shape."""
Columns = dict[str, tuple[str, Callable[[Any], str]]]
"""By column: its heading, and what writes a value."""


def column(frame: pd.DataFrame, name: str, default: object) -> list[Any]:
    """Return a column's values, or as many defaults."""
    return list(frame[name]) if name in frame else [default] * len(frame)


def texts(frame: pd.DataFrame, columns: Columns) -> Values:
    """Return pop-up texts of the columns that are there and hold something."""
    return {
        head: ["–" if _blank(value) else write(value) for value in frame[name]]
        for name, (head, write) in columns.items()
        if name in frame and frame[name].notna().any()
    }


def _blank(value: Any) -> bool:
    return value is None or value != value or value == ""


def plain(value: Any) -> str:
    """Return any value as text.

    >>> plain(1200.5), plain(None)
    ('1,200.5', '–')
    """
    if _blank(value):
        return "–"
    return f"{value:,.2f}".rstrip("0").rstrip(".") if isinstance(value, float) else str(value)


def spaced(value: Any) -> str:
    """Return a code word as words.

    >>> spaced("on_street")
    'on street'
    """
    return str(value).replace("_", " ")


def metres(value: Any) -> str:
    """Return a length as text."""
    return f"{float(value):,.1f} m"


def square_metres(value: Any) -> str:
    """Return an area as text."""
    return f"{float(value):,.0f} m²"

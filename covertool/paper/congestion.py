"""The paper's Table I: congestion in Dublin."""

from __future__ import annotations

from collections.abc import Mapping
from decimal import Decimal

from covertool.congestion.occupancy import DAYS, means_of
from covertool.congestion.options import RUSH_HOURS
from covertool.model import OccupancyCell, OccupancyTable

TABLE_1_CELLS: Mapping[str, tuple[str, str]] = {
    "Monday": ("18.39", "13.07"),
    "Tuesday": ("17.68", "16.17"),
    "Wednesday": ("25.03", "14.58"),
    "Thursday": ("23.49", "20.67"),
    "Friday": ("28.63", "14.07"),
    "Saturday": ("14.95", "9.72"),
    "Sunday": ("13.77", "16.33"),
}
"""Table I: percentage of slow and very slow traffic at lunch (13:00) and in the evening (19:30),
Dublin, 16 to 23 June 2014: eight days in seven rows."""

TABLE_1_MEANS: Mapping[tuple[str, str], Decimal] = {
    ("weekday", "lunch"): Decimal("22.64"),
    ("weekday", "evening"): Decimal("15.71"),
    ("weekend", "lunch"): Decimal("14.36"),
    ("weekend", "evening"): Decimal("13.03"),
}
"""The means that the paper prints; they are those over the cells, rounded half up."""


def table_1() -> OccupancyTable:
    """Return the paper's Table I, with the means that its cells have.

    Examples
    --------
    >>> [mean.text for mean in table_1().means]
    ['22.64', '15.71', '14.36', '13.03']
    """
    cells = tuple(
        OccupancyCell(day, window, float(percent), None, 2 if day == DAYS[0] else 1, 1.0)
        for day, percents in TABLE_1_CELLS.items()
        for window, percent in zip(RUSH_HOURS, percents, strict=True)
    )
    return OccupancyTable(cells, means_of(cells, (), RUSH_HOURS))

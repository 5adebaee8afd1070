"""One figure of the paper beside ours: the difference, the scatter over layouts, the verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

CALIBRATED = "calibrated"
"""The note of figures to which the sample town was fitted: they are no evidence."""


@dataclass(frozen=True)
class Comparison:
    """One figure of the paper and ours.

    Attributes
    ----------
    table : number of the paper's table, 1 to 8
    row, quantity : what it is
    paper : the printed value
    ours : ours, the mean over the layouts; None when it could not be computed
    each : (layouts,) ours of each layout; one value where there are no layouts
    best : the same with second_order, which takes all that can be known; None where it has none
    note : what must be known about it
    signed : whether the sign is the claim (an improvement)
    """

    table: int
    row: str
    quantity: str
    paper: float
    ours: float | None
    each: tuple[float, ...] = ()
    best: float | None = None
    note: str = ""
    signed: bool = False

    @property
    def difference(self) -> float | None:
        """Ours less the paper's."""
        return None if self.ours is None else self.ours - self.paper

    @property
    def interval(self) -> tuple[float, float] | None:
        """The interval in which 95 % of the layouts lie; None for fewer than two."""
        if len(self.each) < 2:
            return None
        low, high = np.percentile(self.each, [2.5, 97.5])
        return float(low), float(high)

    @property
    def same_sign(self) -> float | None:
        """Share of the layouts in which ours has the paper's sign; None where no sign is claimed.

        >>> Comparison(5, "EKF", "improvement", 8.0, 1.0, (3.0, -1.0), signed=True).same_sign
        0.5
        """
        if not self.signed or not self.each:
            return None
        return float(np.mean(np.sign(self.each) == np.sign(self.paper)))

    @property
    def inside(self) -> bool | None:
        """Whether the paper's value lies in the interval; None without one."""
        if self.interval is None:
            return None
        return self.interval[0] <= self.paper <= self.interval[1]

    def to_row(self) -> dict[str, object]:
        """Return it as one row of plain values."""
        low, high = self.interval or (None, None)
        return {
            "table": self.table,
            "row": self.row,
            "quantity": self.quantity,
            "paper": self.paper,
            "ours": self.ours,
            "difference": self.difference,
            "low": low,
            "high": high,
            "layouts": len(self.each),
            "same_sign": self.same_sign,
            "inside": self.inside,
            "best": self.best,
            "note": self.note,
        }


def over_layouts(
    table: int,
    row: str,
    quantity: str,
    paper: float,
    each: Sequence[float | None],
    best: Sequence[float | None] = (),
    *,
    signed: bool = False,
) -> Comparison:
    """Return a figure with the mean over the layouts in which nothing diverged.

    Parameters
    ----------
    table, row, quantity, paper, signed : as in :class:`Comparison`
    each, best : ours of each layout, None where a car diverged

    Examples
    --------
    >>> over_layouts(5, "EKF", "improvement, %", 8.0, [2.0, None, 4.0]).ours
    3.0
    """
    ours = tuple(value for value in each if value is not None)
    others = [value for value in best if value is not None]
    lost = len(each) - len(ours)
    return Comparison(
        table,
        row,
        quantity,
        paper,
        float(np.mean(ours)) if ours else None,
        ours,
        float(np.mean(others)) if others else None,
        f"diverged in {lost} layouts" if lost else "",
        signed,
    )


def summary(comparisons: Sequence[Comparison]) -> list[str]:
    """Return in words where ours has the paper's sign, and where it does not match.

    Figures that are copied or calibrated are not counted.
    """
    signed = [each for each in comparisons if each.signed and each.each]
    ranged = [each for each in comparisons if each.inside is not None]
    lines = []
    if signed:
        good = sum((each.same_sign or 0) >= 0.5 for each in signed)
        lines.append(
            f"{good} of {len(signed)} improvements have the paper's sign in at least half of the "
            "layouts."
        )
    if ranged:
        out = [each for each in ranged if not each.inside]
        lines.append(
            f"{len(ranged) - len(out)} of {len(ranged)} of the paper's figures lie where 95 % of "
            f"our layouts lie; {len(out)} do not match."
        )
    return lines

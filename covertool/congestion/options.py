"""How an occupancy table is counted: windows, tolerance, what counts as occupied."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from datetime import date, time, timedelta
from typing import Literal
from zoneinfo import ZoneInfo

from covertool.congestion.status import ORDERED
from covertool.errors import OptionError

RUSH_HOURS: Mapping[str, time] = {"lunch": time(13, 0), "evening": time(19, 30)}
"""The paper's two rush hours."""
OCCUPIED = ("slow", "very_slow", "stationary")
"""What the paper counts as occupied: slow and very slow traffic, and what stands."""

MeanOf = Literal["cells", "days"]


@dataclass(frozen=True)
class OccupancyOptions:
    """How an occupancy table is counted.

    Attributes
    ----------
    tz : the zone whose clock the windows are read from
    windows : times of day by name
    tolerance : how far from the window an observation may lie
    occupied : the statuses that count as occupied
    mean_of : ``cells`` averages the weekdays' cells as the paper does, ``days`` the dates
    min_coverage : least share of the length that must be known
    holidays : local dates kept apart from the weekdays
    absent_is_free : a segment that a living feed does not mention is free, not unknown
    """

    tz: ZoneInfo
    windows: Mapping[str, time] = field(default_factory=lambda: dict(RUSH_HOURS))
    tolerance: timedelta = timedelta(minutes=10)
    occupied: Collection[str] = OCCUPIED
    mean_of: MeanOf = "cells"
    min_coverage: float = 0.8
    holidays: Collection[date] = ()
    absent_is_free: bool = False

    def __post_init__(self) -> None:
        strange = sorted(set(self.occupied) - set(ORDERED))
        if strange or not self.occupied:
            raise OptionError(
                f"the occupied set {', '.join(self.occupied) or '(empty)'} is not of the scale",
                "--occupied",
                f"choose from {', '.join(ORDERED)}",
            )
        if not 0 <= self.min_coverage <= 1:
            raise OptionError(f"{self.min_coverage} is not a share", "--min-coverage", "use 0 to 1")
        if self.mean_of not in ("cells", "days"):
            raise OptionError(
                f"{self.mean_of!r} is no way to average", "--mean-of", "use cells or days"
            )


def hourly(options: OccupancyOptions) -> OccupancyOptions:
    """Return the options with a window at each full hour that reaches half an hour further."""
    windows = {f"{hour:02d}": time(hour) for hour in range(24)}
    return replace(options, windows=windows, tolerance=options.tolerance + timedelta(minutes=30))

"""Observations of the traffic and the occupancy table made of them."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import shapely

from covertool.model.tables import Floats, Objects, Table

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Observations(Table):
    """What was seen of the traffic on street segments, one row each.

    Attributes
    ----------
    segment_id : (N,) object array of str
    time : (N,) datetime64[us] in UTC, when it was seen, or the start of the interval
    until : (N,) datetime64[us] in UTC, the end of the interval; NaT for a moment
    status : (N,) object array of words of the status scale (free, slow, very_slow, stationary,
        closed, unknown)
    relative_speed : (N,) speed over free-flow speed; NaN when unknown
    speed_mps : (N,) metres per second; NaN when unknown
    queue_m : (N,) measured length of the queue in metres; NaN when unknown
    line : (N,) object array of WGS 84 LineStrings (lon, lat), or None where the source names
        only the segment
    """

    segment_id: Objects
    time: npt.NDArray[np.datetime64]
    until: npt.NDArray[np.datetime64]
    status: Objects
    relative_speed: Floats
    speed_mps: Floats
    queue_m: Floats
    line: Objects

    @classmethod
    def from_columns(
        cls,
        segment_id: npt.ArrayLike,
        time: npt.ArrayLike,
        status: npt.ArrayLike,
        **more: npt.ArrayLike,
    ) -> Observations:
        """Return observations from the columns that are known; the others are filled with gaps.

        >>> len(Observations.from_columns(["a"], ["2014-06-16T12:00"], ["slow"]))
        1
        """
        ids = np.asarray(segment_id, dtype=object)
        gaps: dict[str, Any] = {
            "until": np.full(ids.size, np.datetime64("NaT"), dtype="datetime64[us]"),
            "relative_speed": np.full(ids.size, np.nan),
            "speed_mps": np.full(ids.size, np.nan),
            "queue_m": np.full(ids.size, np.nan),
            "line": np.full(ids.size, None, dtype=object),
        }
        given = {name: np.asarray(column, gaps[name].dtype) for name, column in more.items()}
        times = np.asarray(time, dtype="datetime64[us]")
        return cls(ids, time=times, status=np.asarray(status, dtype=object), **(gaps | given))

    @classmethod
    def concatenate(cls, parts: list[Observations]) -> Observations:
        """Return the rows of several tables, in order, as one."""
        if not parts:
            return cls.from_columns([], [], [])
        return cls(**cls.joined(parts))

    def to_frame(self) -> pd.DataFrame:
        """Return the observations as a table; times are in UTC."""
        import pandas as pd

        frame = pd.DataFrame({n: c for n, c in self.columns().items() if n != "line"})
        frame["time"] = frame["time"].dt.tz_localize("UTC")
        frame["until"] = frame["until"].dt.tz_localize("UTC")
        frame["line"] = shapely.to_wkb(self.line) if len(self) else self.line
        return frame


@dataclass(frozen=True)
class OccupancyCell:
    """One weekday and window: how much street length was flagged and how much queues fill.

    Attributes
    ----------
    day, window : which they are, such as Monday and lunch
    percent : flagged length, of the length known and not closed; None for a blank cell
    filled_percent : length that the queued cars themselves fill, of the same; None for a blank one
    days : number of days that are not blank
    observed_fraction : share of the length of which anything was known, over all days, 0 to 1
    ci95 : 95 % confidence interval of ``percent``; None for fewer than three days
    """

    day: str
    window: str
    percent: float | None
    filled_percent: float | None
    days: int
    observed_fraction: float
    ci95: tuple[float, float] | None = None


@dataclass(frozen=True)
class OccupancyDay:
    """One date and window: percentages are None where too little was observed.

    Attributes
    ----------
    date : the local date
    day : its weekday, or Holiday
    window : name of the window
    percent, filled_percent, observed_fraction : as in :class:`OccupancyCell`
    """

    date: date
    day: str
    window: str
    percent: float | None
    filled_percent: float | None
    observed_fraction: float


@dataclass(frozen=True)
class OccupancyMean:
    """A mean over a group of cells or days.

    Attributes
    ----------
    group : weekday, weekend or holiday
    window : name of the window
    percent, filled_percent : the means; None where every cell or day is blank
    count : cells or days that are not blank
    text : ``percent`` rounded half up to two decimals
    ci95 : 95 % confidence interval of ``percent``; None for fewer than three
    """

    group: str
    window: str
    percent: float | None
    filled_percent: float | None
    count: int
    text: str
    ci95: tuple[float, float] | None = None


@dataclass(frozen=True)
class OccupancyTable:
    """Flagged street length by weekday and window, as in the paper's Table I.

    Attributes
    ----------
    cells : one for each weekday and window
    means : over weekdays, weekend and holidays
    days : the dates behind the cells; empty where they are not known

    Examples
    --------
    >>> cell = OccupancyCell("Monday", "lunch", 18.39, None, 2, 1.0)
    >>> OccupancyTable((cell,), ()).to_frame()["percent"].tolist()
    [18.39]
    """

    cells: tuple[OccupancyCell, ...]
    means: tuple[OccupancyMean, ...]
    days: tuple[OccupancyDay, ...] = ()

    def to_frame(self) -> pd.DataFrame:
        """Return one row for each cell."""
        import pandas as pd

        return pd.DataFrame([vars(cell) for cell in self.cells])

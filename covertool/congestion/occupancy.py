"""The occupancy table: flagged street length by weekday and rush hour (the paper's Table I)."""

from __future__ import annotations

import logging
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import date, time, timedelta
from typing import TYPE_CHECKING, Literal
from zoneinfo import ZoneInfo

import numpy as np
import shapely

from covertool.congestion.clock import local_days, window_instant
from covertool.congestion.fill import filled_fraction
from covertool.congestion.nearest import Timeline
from covertool.congestion.rounding import half_up
from covertool.congestion.status import CLOSED, ORDERED, UNKNOWN
from covertool.congestion.streets import Streets, Weight, streets
from covertool.errors import OptionError
from covertool.model import (
    Floats,
    Objects,
    Observations,
    OccupancyCell,
    OccupancyDay,
    OccupancyMean,
    OccupancyTable,
)

if TYPE_CHECKING:
    import geopandas as gpd

log = logging.getLogger(__name__)

DAYS = ("Monday", "Tuesday", "Wednesday", "Thursday", "Friday", "Saturday", "Sunday")
HOLIDAY = "Holiday"
GROUPS: Mapping[str, tuple[str, ...]] = {
    "weekday": DAYS[:5],
    "weekend": DAYS[5:],
    "holiday": (HOLIDAY,),
}
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


def occupancy_table(
    observations: Observations,
    segments: gpd.GeoDataFrame,
    options: OccupancyOptions,
    *,
    weight: Weight = "directed",
    aoi: shapely.Geometry | None = None,
) -> OccupancyTable:
    """Return the share of street length in the occupied set, by weekday and window.

    A day's figure is the occupied length over the length that is known and not closed; a cell is
    the mean over its days, a group's mean the mean over its cells or days (the paper, section
    II-3). ``filled_percent`` is the length that the queued cars themselves fill.

    Parameters
    ----------
    observations : Observations
    segments : GeoDataFrame of directed lines in metres; see ``streets``
    options : OccupancyOptions
    weight : ``directed``, ``undirected`` or ``lane``
    aoi : area outside of which street length does not count

    Raises
    ------
    ColumnError, GeometryError, OptionError
        When observations and network do not fit, or an option is out of range.

    Examples
    --------
    >>> import geopandas as gpd
    >>> lines = [shapely.LineString([(0, y), (100, y)]) for y in (0, 50, 100, 150)]
    >>> town = gpd.GeoDataFrame({"segment_id": list("abcd")}, geometry=lines, crs=2157)
    >>> seen = Observations.from_columns(
    ...     list("abcd"), ["2014-06-16T12:00"] * 4, ["slow", "free", "free", "free"]
    ... )
    >>> table = occupancy_table(seen, town, OccupancyOptions(ZoneInfo("Europe/Dublin")))
    >>> [(cell.day, cell.window, cell.percent) for cell in table.cells]
    [('Monday', 'lunch', 25.0), ('Monday', 'evening', None)]
    """
    network = streets(segments, weight=weight, aoi=aoi)
    return table_of_days(days_of(observations, network, options), options)


def days_of(
    observations: Observations, network: Streets, options: OccupancyOptions
) -> list[OccupancyDay]:
    """Return the figures of every local date that has observations, for every window.

    Dates on which something was observed but nothing near a window have blank figures.
    """
    ids, piece_of = np.unique(network.segment_id.astype(str), return_inverse=True)
    timeline = Timeline(observations, ids.astype(object))
    lengths: Floats = np.bincount(piece_of, weights=network.length_m).astype(float)
    weights: Floats = np.bincount(piece_of, weights=network.weight).astype(float)
    figures = []
    for day in _candidate_days(observations, options):
        for window, at in options.windows.items():
            moment = window_instant(day, at, options.tz)
            if moment is None:
                log.warning("%s has no %s: the clocks skip it", day, at.isoformat("minutes"))
                continue
            rows = timeline.nearest(moment, np.timedelta64(options.tolerance))
            status, queue_m = states(timeline, rows, absent_is_free=options.absent_is_free)
            filled = filled_fraction(status, queue_m, lengths)
            name = HOLIDAY if day in options.holidays else DAYS[day.weekday()]
            figures.append(_day(day, name, window, status, filled, weights, options))
    seen = set(local_days(observations.time, options.tz))
    return [f for f in figures if f.date in seen or f.observed_fraction > 0]


def _candidate_days(observations: Observations, options: OccupancyOptions) -> list[date]:
    """Return the local dates on which an observation may be the nearest to a window.

    A window shortly before midnight may be told by an observation shortly after it.
    """
    reach = np.timedelta64(options.tolerance)
    ends = observations.until[~np.isnat(observations.until)]
    times = np.concatenate([observations.time, ends])
    return local_days(np.concatenate([times - reach, times, times + reach]), options.tz)


def states(
    timeline: Timeline, rows: np.ndarray[tuple[int], np.dtype[np.int64]], *, absent_is_free: bool
) -> tuple[Objects, Floats]:
    """Return each segment's status and measured queue; where nothing was seen it is unknown.

    With ``absent_is_free`` it is free there, as long as the feed said anything at all.
    """
    seen = rows >= 0
    absent = "free" if absent_is_free and seen.any() else UNKNOWN
    status: Objects = np.full(rows.size, absent, dtype=object)
    queue_m = np.full(rows.size, np.nan)
    status[seen] = timeline.status[rows[seen]]
    queue_m[seen] = timeline.queue_m[rows[seen]]
    return status, queue_m


def _day(
    day: date,
    name: str,
    window: str,
    status: Objects,
    filled: Floats,
    weights: Floats,
    options: OccupancyOptions,
) -> OccupancyDay:
    known = status != UNKNOWN
    flowing = known & (status != CLOSED)
    occupied = flowing & np.isin(status.astype(str), list(options.occupied))
    observed = float(weights[known].sum() / weights.sum())
    length_m = float(weights[flowing].sum())
    # A hair of slack: 0.8 of the length must not miss 0.8 by the last bit of a sum.
    if observed < options.min_coverage - 1e-12 or length_m <= 0:
        return OccupancyDay(day, name, window, None, None, observed)
    percent = 100 * float(weights[occupied].sum()) / length_m
    fill = 100 * float((weights * filled)[flowing].sum()) / length_m
    return OccupancyDay(day, name, window, percent, fill, observed)


def table_of_days(days: Sequence[OccupancyDay], options: OccupancyOptions) -> OccupancyTable:
    """Return the table of days already counted."""
    names = [*DAYS, HOLIDAY] if options.holidays else list(DAYS)
    present = [name for name in names if any(day.day == name for day in days)]
    cells = [
        _cell(name, window, [d for d in days if (d.day, d.window) == (name, window)])
        for name in present
        for window in options.windows
    ]
    means = means_of(cells, days, options.windows, options.mean_of)
    return OccupancyTable(tuple(cells), means, tuple(days))


def means_of(
    cells: Sequence[OccupancyCell],
    days: Sequence[OccupancyDay],
    windows: Iterable[str],
    mean_of: MeanOf = "cells",
) -> tuple[OccupancyMean, ...]:
    """Return the means over weekdays, weekend and holidays, of cells or of days."""
    means = (
        _mean(group, window, members, cells, days, mean_of)
        for group, members in GROUPS.items()
        for window in windows
    )
    return tuple(mean for mean in means if mean is not None)


def _cell(name: str, window: str, days: list[OccupancyDay]) -> OccupancyCell:
    percents = _given(day.percent for day in days)
    return OccupancyCell(
        day=name,
        window=window,
        percent=_average(percents),
        filled_percent=_average(_given(day.filled_percent for day in days)),
        days=len(percents),
        observed_fraction=_average([day.observed_fraction for day in days]) or 0.0,
        ci95=confidence_95(percents),
    )


def _mean(
    group: str,
    window: str,
    members: tuple[str, ...],
    cells: Sequence[OccupancyCell],
    days: Sequence[OccupancyDay],
    mean_of: MeanOf,
) -> OccupancyMean | None:
    figures: Sequence[OccupancyCell | OccupancyDay] = cells if mean_of == "cells" else days
    chosen = [f for f in figures if f.day in members and f.window == window]
    if not chosen:
        return None
    percents = _given(figure.percent for figure in chosen)
    percent = _average(percents)
    return OccupancyMean(
        group=group,
        window=window,
        percent=percent,
        filled_percent=_average(_given(figure.filled_percent for figure in chosen)),
        count=len(percents),
        text="" if percent is None else half_up(percent),
        ci95=confidence_95(percents),
    )


def _given(values: Iterable[float | None]) -> list[float]:
    return [value for value in values if value is not None]


def _average(values: Sequence[float]) -> float | None:
    return float(np.mean(values)) if values else None


def confidence_95(values: Sequence[float]) -> tuple[float, float] | None:
    """Return the 95 % confidence interval of a mean (Student's t); None for fewer than three.

    Examples
    --------
    >>> low, high = confidence_95([1.0, 2.0, 3.0])
    >>> round(low, 3), round(high, 3)
    (-0.484, 4.484)
    """
    if len(values) < 3:
        return None
    from scipy.stats import t

    half = float(t.ppf(0.975, len(values) - 1) * np.std(values, ddof=1) / np.sqrt(len(values)))
    mean = float(np.mean(values))
    return mean - half, mean + half

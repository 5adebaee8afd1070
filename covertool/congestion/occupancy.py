"""The occupancy table: flagged street length by weekday and rush hour (the paper's Table I)."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping, Sequence
from datetime import date
from typing import TYPE_CHECKING

import numpy as np
import shapely

from covertool.congestion.clock import local_days, window_instant
from covertool.congestion.fill import filled_fraction
from covertool.congestion.options import MeanOf, OccupancyOptions
from covertool.congestion.rounding import half_up
from covertool.congestion.states import SegmentStates
from covertool.congestion.status import CLOSED, UNKNOWN
from covertool.congestion.streets import Streets, Weight, streets
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

_LOG = logging.getLogger(__name__)

DAYS = ("Monday", "Tuesday", "Wednesday", "Thursday", "Friday", "Saturday", "Sunday")
HOLIDAY = "Holiday"
GROUPS: Mapping[str, tuple[str, ...]] = {
    "weekday": DAYS[:5],
    "weekend": DAYS[5:],
    "holiday": (HOLIDAY,),
}


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
    >>> from zoneinfo import ZoneInfo
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
    states = SegmentStates(observations, network, options)
    lengths, weights = states.summed(network.length_m), states.summed(network.weight)
    figures = []
    for day in _candidate_days(observations, options):
        for window, at in options.windows.items():
            moment = window_instant(day, at, options.tz)
            if moment is None:
                _LOG.warning("%s has no %s: the clocks skip it", day, at.isoformat("minutes"))
                continue
            status, queue_m = states.at(moment)
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


def _day(
    day: date,
    name: str,
    window: str,
    status: Objects,
    filled: Floats,
    weights: Floats,
    options: OccupancyOptions,
) -> OccupancyDay:
    """Return the figures of one date and window."""
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
    """Return the means over weekdays, weekend and holidays, where there are any.

    Parameters
    ----------
    cells, days : the figures
    windows : names of the windows
    mean_of : whether the cells or the days are averaged
    """
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
    """Return the mean of a group's cells or days in a window; None where it has none."""
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

"""Observation tables of any origin: named columns become observations, units told apart."""

from __future__ import annotations

import difflib
from datetime import datetime
from typing import TYPE_CHECKING

import numpy as np
import shapely

from covertool.congestion.clock import Instants, instant, parse_instant, to_numpy
from covertool.congestion.feeds.protocol import SPEED_UNITS, FeedOptions
from covertool.congestion.status import status_of_speed, status_of_words
from covertool.errors import ColumnError
from covertool.model import Floats, Objects, Observations

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = (
    "segment_id",
    "time",
    "until",
    "status",
    "relative_speed",
    "speed_mps",
    "speed_kmh",
    "free_flow_mps",
    "free_flow_kmh",
    "queue_m",
)


def observations_of(frame: pd.DataFrame, options: FeedOptions) -> Observations:
    """Return a table as observations.

    Columns: ``segment_id``, ``time`` (ISO 8601), and ``status`` or ``relative_speed`` or a speed
    with its free-flow speed (``speed_mps`` or ``speed_kmh``, ``free_flow_mps`` or
    ``free_flow_kmh``; ``speed`` and ``free_flow`` need the option ``speed_unit``); optionally
    ``until`` and ``queue_m``. A status word wins over a speed.

    Raises
    ------
    ColumnError
        When a column is missing, a time is naive or wrong, or a status is not on the scale.
    """
    frame = frame.rename(columns=lambda name: str(name).strip().lower())
    twice = frame.columns[frame.columns.duplicated()]
    if twice.size:
        raise ColumnError(f"the column {twice[0]} stands twice", options.where, "leave one out")
    ids = _required(frame, "segment_id", options)
    if ids.isna().any():
        raise ColumnError(
            f"row {int(ids.isna().to_numpy().argmax()) + 1} has no segment_id",
            options.where,
            "fill it in or delete the row",
        )
    speed = _speed(frame, "speed", options)
    relative = _relative(frame, speed, _speed(frame, "free_flow", options), options)
    return Observations.from_columns(
        ids.astype(str).to_numpy(dtype=object),
        instants(_required(frame, "time", options), options),
        _status(frame, relative, options),
        until=instants(frame["until"], options, gaps=True) if "until" in frame else _never(frame),
        relative_speed=relative,
        speed_mps=speed,
        queue_m=_numbers(frame, "queue_m", options),
        line=_lines(frame),
    )


def instants(column: pd.Series, options: FeedOptions, *, gaps: bool = False) -> Instants:
    """Return a column of times, as text or as datetimes, as instants in UTC."""
    import pandas as pd

    where = f"{options.where}, column {column.name}"
    codes, distinct = pd.factorize(column)
    if (codes < 0).any() and not gaps:
        raise ColumnError(
            f"row {int(np.argmax(codes < 0)) + 1} has no time", where, "fill it in or delete it"
        )

    def moment(value: object) -> np.datetime64:
        if isinstance(value, pd.Timestamp):
            value = value.floor("us").to_pydatetime()
        if isinstance(value, datetime):
            return to_numpy(instant(value, options.tz, options.fold, where))
        if not isinstance(value, str):
            raise ColumnError(f"{value!r} is not a time", where, "write ISO 8601 text")
        return to_numpy(parse_instant(value, options.tz, options.fold, where))

    known = np.array([*(moment(value) for value in distinct), np.datetime64("NaT", "us")])
    return known.astype("datetime64[us]")[codes]


def _required(frame: pd.DataFrame, name: str, options: FeedOptions) -> pd.Series:
    if name in frame:
        column: pd.Series = frame[name]
        return column
    near = difflib.get_close_matches(name, [str(c) for c in frame.columns], 1, 0.6)
    raise ColumnError(
        f"there is no column {name} (found: {', '.join(map(str, frame.columns))})",
        options.where,
        f"rename {near[0]!r} to {name}" if near else f"add it; known columns: {', '.join(COLUMNS)}",
    )


def _numbers(frame: pd.DataFrame, name: str, options: FeedOptions) -> Floats:
    """Return a column as floats of at least 0; NaN where it is empty or absent."""
    import pandas as pd

    if name not in frame:
        return np.full(len(frame), np.nan)
    column = frame[name]
    numbers = pd.to_numeric(column, errors="coerce").to_numpy(dtype=float)
    wrong = (column.notna() & (column.astype(str).str.strip() != "")).to_numpy() & (
        ~(numbers >= 0) | np.isinf(numbers)
    )
    if wrong.any():
        row = int(np.argmax(wrong))
        raise ColumnError(
            f"{column.iloc[row]!r} in row {row + 1} is not a number of at least 0",
            f"{options.where}, column {name}",
            "correct it, or leave it empty",
        )
    return numbers


def _speed(frame: pd.DataFrame, name: str, options: FeedOptions) -> Floats:
    """Return a speed in m/s from the column that names its unit, or from the unit option."""
    given = [c for c in (f"{name}_mps", f"{name}_kmh", name) if c in frame]
    if len(given) > 1:
        raise ColumnError(
            f"the columns {' and '.join(given)} both give a speed", options.where, "keep one"
        )
    if not given:
        return np.full(len(frame), np.nan)
    unit = {"mps": "m/s", "kmh": "km/h"}.get(given[0].rpartition("_")[2], options.speed_unit)
    if unit is None:
        raise ColumnError(
            f"the column {name} does not say its unit",
            options.where,
            f"rename it to {name}_mps or {name}_kmh, or add --speed-unit km/h",
        )
    return _numbers(frame, given[0], options) * SPEED_UNITS[unit]


def _relative(
    frame: pd.DataFrame, speed: Floats, free_flow: Floats, options: FeedOptions
) -> Floats:
    given = _numbers(frame, "relative_speed", options)
    free = np.where(np.isfinite(free_flow), free_flow, options.free_speed_mps)
    with np.errstate(divide="ignore", invalid="ignore"):
        quotient = np.where(free > 0, speed / free, np.nan)
    return np.where(np.isfinite(given), given, quotient)


def _status(frame: pd.DataFrame, relative: Floats, options: FeedOptions) -> Objects:
    if "status" not in frame:
        if not np.isfinite(relative).any():
            raise ColumnError(
                "there is no column status, and no relative speed to tell it from",
                options.where,
                "add status, or relative_speed, or a speed with its free-flow speed",
            )
        return status_of_speed(relative, options.speed_profile)
    words = frame["status"].astype(object).to_numpy(dtype=object)
    status = status_of_words(words, options.profile)
    empty = frame["status"].isna().to_numpy() & np.isfinite(relative)
    return np.where(empty, status_of_speed(relative, options.speed_profile), status)


def _never(frame: pd.DataFrame) -> Instants:
    return np.full(len(frame), np.datetime64("NaT"), dtype="datetime64[us]")


def _lines(frame: pd.DataFrame) -> Objects:
    lines = np.full(len(frame), None, dtype=object)
    if "line" in frame:
        wkb = frame["line"].to_numpy(dtype=object)
        there = np.array([isinstance(value, bytes) for value in wkb], dtype=bool)
        lines[there] = shapely.from_wkb(wkb[there])
    return lines

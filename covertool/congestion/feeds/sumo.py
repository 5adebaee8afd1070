"""SUMO: mean data of edges or lanes (edgeData, laneData)."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, timedelta
from typing import BinaryIO

import numpy as np

from covertool.congestion.feeds.protocol import FeedOptions, FlowRecord, batches
from covertool.congestion.feeds.xmlstream import Element, elements
from covertool.errors import ColumnError
from covertool.model import Observations

_LONGEST_S = 3.2e9
"""A hundred years."""
_INSTANT = timedelta(microseconds=1)


def read(stream: BinaryIO, options: FeedOptions) -> Iterator[Observations]:
    """Yield one observation for each edge and interval.

    The relative speed is ``speedRelative`` (speed over speed limit), else ``speed`` in m/s over
    the free-flow speed of the options. An edge that no car used in the interval is free: the
    simulation sees all. ``options.time`` is the moment of second 0. An interval holds from its
    begin up to its end, which belongs to the next.
    """
    return batches(_records(stream, options), options)


def _records(stream: BinaryIO, options: FeedOptions) -> Iterator[FlowRecord]:
    """Yield one record for each edge and interval."""
    if options.time is None:
        raise ColumnError(
            "SUMO counts seconds from the start of the simulation",
            options.where,
            "say when second 0 was, such as --time 2014-06-16T07:00:00+01:00",
        )
    start = options.time.astimezone(UTC)
    for _, edge in elements(stream, ("edge",), options):
        interval = edge.getparent()
        if edge.get("id", ":").startswith(":"):
            continue
        begin, end = (_seconds(interval, key, options) for key in ("begin", "end"))
        parts = list(edge.iterfind("{*}lane")) or [edge]
        speed, relative = _mean(parts, "speed"), _mean(parts, "speedRelative")
        if not np.isfinite(relative):
            relative = speed / options.free_speed_mps
        empty = all(_value(part, "sampledSeconds") == 0 for part in parts)
        yield FlowRecord(
            segment_id=edge.get("id"),
            time=start + timedelta(seconds=begin),
            until=max(start + timedelta(seconds=end) - _INSTANT, start + timedelta(seconds=begin)),
            status="free" if empty else None,
            relative_speed=relative,
            speed_mps=speed,
        )


def _seconds(interval: Element, key: str, options: FeedOptions) -> float:
    value = _value(interval, key) if interval is not None else np.nan
    if not abs(value) < _LONGEST_S:
        raise ColumnError(
            f"an interval has no {key} that can be a time", options.where, "write it with SUMO"
        )
    return value


def _mean(parts: list[Element], key: str) -> float:
    """Return the mean over an edge or its lanes, by the seconds that cars spent there."""
    values = np.array([_value(part, key) for part in parts])
    weights = np.nan_to_num([_value(part, "sampledSeconds") for part in parts], nan=1.0)
    there = np.isfinite(values) & (weights > 0)
    return float(np.average(values[there], weights=weights[there])) if there.any() else np.nan


def _value(element: Element, key: str) -> float:
    try:
        return float(element.get(key, "nan"))
    except ValueError:
        return np.nan

"""Waze for Cities: the jams of a snapshot in JSON (Data Feed specifications, traffic jams)."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from typing import Any, BinaryIO

from covertool.congestion.feeds.jsontext import line_of, number, read_object
from covertool.congestion.feeds.protocol import FeedOptions, FlowRecord, batches
from covertool.congestion.status import CLOSED, WAZE, status_of_word
from covertool.errors import ColumnError, FileError
from covertool.model import Observations

_LOG = logging.getLogger(__name__)


def read(stream: BinaryIO, options: FeedOptions) -> Iterator[Observations]:
    """Yield the jams of a snapshot.

    Level 5 with a delay of -1 is a blocked road, which is closed and never stationary. A jam is
    seen from the start of the snapshot to its end; its own ``pubMillis`` may be hours older. The
    segment is the jam's ``uuid`` until its line is matched to a network. ``speed`` is in m/s and
    ``speedKMH`` in km/h.
    """
    return batches(_records(stream, options), options)


def _records(stream: BinaryIO, options: FeedOptions) -> Iterator[FlowRecord]:
    """Yield one record for each jam."""
    content = read_object(stream, options)
    jams = content.get("jams")
    if not isinstance(jams, list):
        raise FileError("there is no list of jams", options.where, "give a Waze for Cities feed")
    start, end = (_moment(content.get(key)) for key in ("startTimeMillis", "endTimeMillis"))
    for place, jam in enumerate(jams):
        if not isinstance(jam, Mapping):
            raise FileError(f"jam {place + 1} is not an object", options.where, "check the feed")
        seen = start or options.time or _moment(jam.get("pubMillis"))
        if seen is None:
            raise ColumnError(
                f"jam {place + 1} has no time, nor has the feed", options.where, "add --time"
            )
        yield FlowRecord(
            segment_id=str(jam.get("uuid") or jam.get("id") or f"jam-{place + 1}"),
            time=seen,
            status=_status(jam, options),
            until=end if start and end and end > start else None,
            speed_mps=_speed(jam, options),
            line=line_of(jam.get("line"), "x", "y"),
        )


def _status(jam: Mapping[str, Any], options: FeedOptions) -> str:
    if jam.get("delay") == -1:
        return CLOSED
    level = jam.get("level")
    word = None if level is None else str(level)
    return status_of_word(word, options.word_profile(WAZE))


def _speed(jam: Mapping[str, Any], options: FeedOptions) -> float:
    in_mps, in_kmh = number(jam.get("speed")), number(jam.get("speedKMH"))
    if abs(in_mps * 3.6 - in_kmh) > max(1.0, 0.05 * in_kmh):
        _LOG.warning(
            "%s: jam %s says %g m/s and %g km/h; the second is used",
            options.where,
            jam.get("uuid"),
            in_mps,
            in_kmh,
        )
        return in_kmh / 3.6
    return in_mps if math.isfinite(in_mps) else in_kmh / 3.6


def _moment(millis: Any) -> datetime | None:
    seconds = number(millis) / 1000
    return datetime.fromtimestamp(seconds, UTC) if 0 < seconds < 4e9 else None

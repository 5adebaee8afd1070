"""TomTom Traffic API: one flow segment in JSON (Flow Segment Data, version 4)."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from datetime import UTC
from typing import BinaryIO

from covertool.congestion.feeds.jsontext import line_of, number, read_object
from covertool.congestion.feeds.protocol import SPEED_UNITS, FeedOptions, FlowRecord, batches
from covertool.congestion.status import CLOSED
from covertool.errors import ColumnError, FileError
from covertool.model import Observations


def read(stream: BinaryIO, options: FeedOptions) -> Iterator[Observations]:
    """Yield the one observation of a flow segment.

    The relative speed is currentSpeed over freeFlowSpeed, in whichever unit; the speed itself is
    in km/h unless the option says that miles were asked for. The answer carries no time, so the
    option ``time`` must. The segment is named by its ``openlr`` code or by a hash of its line.
    """
    return batches(_records(stream, options), options)


def _records(stream: BinaryIO, options: FeedOptions) -> Iterator[FlowRecord]:
    """Yield the one record of a flow segment."""
    flow = read_object(stream, options).get("flowSegmentData")
    if not isinstance(flow, dict):
        raise FileError("there is no flowSegmentData", options.where, "give a TomTom flow segment")
    if options.time is None:
        raise ColumnError(
            "a TomTom flow segment carries no time",
            options.where,
            "say when it was fetched, such as --time 2026-07-24T08:00:00+02:00",
        )
    coordinates = flow.get("coordinates") or {}
    line = line_of(coordinates.get("coordinate"), "longitude", "latitude")
    speed, free = number(flow.get("currentSpeed")), number(flow.get("freeFlowSpeed"))
    digest = hashlib.sha256(line.wkb if line else b"").hexdigest()[:12]
    yield FlowRecord(
        segment_id=str(flow.get("openlr") or flow.get("openLr") or f"tomtom-{digest}"),
        time=options.time.astimezone(UTC),
        status=CLOSED if flow.get("roadClosure") is True else None,
        relative_speed=speed / free if free > 0 else float("nan"),
        speed_mps=speed * SPEED_UNITS[options.speed_unit or "km/h"],
        line=line,
    )

"""What a feed is: a guarded byte stream in, batches of observations out.

A new feed is one module in this folder with a function ``read(stream, options)`` and its name in
``FORMATS``.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from importlib import import_module
from typing import BinaryIO, Protocol, cast
from zoneinfo import ZoneInfo

import numpy as np
import shapely

from covertool.congestion.clock import Fold, parse_instant, to_numpy
from covertool.congestion.status import DATEX, UNKNOWN, Profile, status_of_speed
from covertool.errors import FileError, OptionError, TruncatedError
from covertool.model import Observations

_LOG = logging.getLogger(__name__)

FORMATS = ("csv", "parquet", "datex2", "waze", "tomtom", "sumo", "trips")
SPEED_UNITS: Mapping[str, float] = {"m/s": 1.0, "km/h": 1 / 3.6, "mph": 0.44704}
"""Metres per second in one unit of speed."""
_BATCH = 50_000


@dataclass(frozen=True)
class Limits:
    """What a feed may cost before it is refused as damaged or hostile.

    Attributes
    ----------
    depth : levels of nesting
    records : records in one file
    elements : XML elements in one record
    text_bytes : size of a feed that must be read whole (JSON)
    """

    depth: int = 64
    records: int = 20_000_000
    elements: int = 200_000
    text_bytes: int = 256 * 2**20


@dataclass(frozen=True)
class Site:
    """A place that a feed refers to.

    Attributes
    ----------
    segment_id : the segment that it stands for
    line : in WGS 84 (lon, lat); None where it is not known
    length_m : NaN where it is not known
    groups : ids of the groups that it belongs to
    """

    segment_id: str
    line: shapely.LineString | None = None
    length_m: float = np.nan
    groups: frozenset[str] = frozenset()


@dataclass(frozen=True)
class FeedOptions:
    """What a feed does not say itself.

    Attributes
    ----------
    where : the file, for messages
    profile : the status profile; None takes the feed's own
    tz, fold : the zone of naive times, and what the repeated hour means
    time : the moment of a feed without times; for SUMO the moment of second 0
    speed_unit : one of ``SPEED_UNITS`` for speeds whose unit the feed leaves open
    free_speed_mps : free-flow speed where the feed gives none
    sites : places by the feed's own id
    limits : caps
    allow_partial : keep what was read of a truncated feed
    """

    where: str = "feed"
    profile: Profile | None = None
    tz: ZoneInfo | None = None
    fold: Fold = None
    time: datetime | None = None
    speed_unit: str | None = None
    free_speed_mps: float = np.nan
    sites: Mapping[str, Site] = field(default_factory=dict)
    limits: Limits = field(default_factory=Limits)
    allow_partial: bool = False

    def __post_init__(self) -> None:
        if self.speed_unit is not None and self.speed_unit not in SPEED_UNITS:
            raise OptionError(
                f"there is no unit of speed {self.speed_unit!r}",
                "--speed-unit",
                f"use {', '.join(SPEED_UNITS)}",
            )

    @property
    def speed_profile(self) -> Profile:
        """The profile for relative speeds: the chosen one when it has bands, else the default."""
        chosen = self.profile
        return chosen if chosen is not None and chosen.bands is not None else DATEX

    def instant(self, text: str | None) -> datetime | None:
        """Return a feed's own time in UTC, or None where it names none.

        >>> FeedOptions().instant("2014-06-16T13:00:00+01:00").isoformat()
        '2014-06-16T12:00:00+00:00'
        """
        return parse_instant(text, self.tz, self.fold, self.where) if text else None

    def word_profile(self, own: Profile) -> Profile:
        """Return the profile for words: the chosen one when it has words, else the feed's own."""
        return self.profile if self.profile is not None and self.profile.words else own


@dataclass(frozen=True, slots=True)
class FlowRecord:
    """One observation as a feed tells it.

    Attributes
    ----------
    segment_id : the segment, or the feed's own id of the place
    time, until : in UTC; no ``until`` is a moment
    status : a word of the status scale; None leaves it to the speed
    relative_speed, speed_mps, queue_m : as in :class:`covertool.model.Observations`
    line : in WGS 84 (lon, lat), or None
    """

    segment_id: str
    time: datetime
    status: str | None = None
    until: datetime | None = None
    relative_speed: float = np.nan
    speed_mps: float = np.nan
    queue_m: float = np.nan
    line: shapely.LineString | None = None


class Feed(Protocol):
    """A module that reads one format."""

    def read(self, stream: BinaryIO, options: FeedOptions) -> Iterator[Observations]:
        """Yield the observations of a feed in batches."""
        ...


def feed(name: str) -> Feed:
    """Return the module that reads a format.

    Raises
    ------
    OptionError
        When there is none of that name.

    Examples
    --------
    >>> feed("waze").__name__
    'covertool.congestion.feeds.waze'
    """
    if name not in FORMATS:
        raise OptionError(
            f"there is no feed format {name!r}", "--format", f"use one of {', '.join(FORMATS)}"
        )
    return cast(Feed, import_module(f"covertool.congestion.feeds.{name}"))


def batches(records: Iterable[FlowRecord], options: FeedOptions) -> Iterator[Observations]:
    """Yield records as tables of bounded size.

    Raises
    ------
    TruncatedError
        When the records end early, unless ``options.allow_partial``; what came before is lost.
    FileError
        When there are more records than the limit.
    """
    pending: list[FlowRecord] = []
    total = 0
    try:
        for record in records:
            pending.append(record)
            total += 1
            if total > options.limits.records:
                raise FileError(
                    f"the feed has more than {options.limits.records} records",
                    options.where,
                    "split it, by day for example",
                )
            if len(pending) == _BATCH:
                yield table(pending, options.speed_profile)
                pending = []
    except TruncatedError as fault:
        keep_or_raise(fault, total, options)
    if pending:
        yield table(pending, options.speed_profile)


def keep_or_raise(fault: TruncatedError, records: int, options: FeedOptions) -> None:
    """Warn that a feed was cut off when a part is wanted; else raise the fault."""
    if not options.allow_partial:
        raise fault
    _LOG.warning("%s: %s; the %d records before that are kept", fault.where, fault.what, records)


def table(records: list[FlowRecord], profile: Profile) -> Observations:
    """Return records as one table, with the status of the speed where the feed gave no word."""
    never = np.datetime64("NaT", "us")
    lines = np.empty(len(records), dtype=object)
    lines[:] = [r.line for r in records]
    relative = np.array([r.relative_speed for r in records])
    by_speed = status_of_speed(relative, profile)
    return Observations.from_columns(
        [r.segment_id for r in records],
        np.array([to_numpy(r.time) for r in records], dtype="datetime64[us]"),
        [r.status or (by_speed[i] or UNKNOWN) for i, r in enumerate(records)],
        until=np.array([to_numpy(r.until) if r.until else never for r in records]),
        relative_speed=relative,
        speed_mps=[r.speed_mps for r in records],
        queue_m=[r.queue_m for r in records],
        line=lines,
    )

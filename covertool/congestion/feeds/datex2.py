"""DATEX II v2: measured data, elaborated data and situations (schema 2_0 to 2_3)."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import datetime
from typing import BinaryIO

import numpy as np

from covertool.congestion.feeds.protocol import FeedOptions, FlowRecord, Site, batches
from covertool.congestion.feeds.situations import Situations
from covertool.congestion.feeds.xmlstream import Element, elements, find, local_name, number, text
from covertool.congestion.status import DATEX2_V2, UNKNOWN, status_of_word
from covertool.errors import ColumnError, FileError
from covertool.model import Observations

_LOG = logging.getLogger(__name__)

_RECORDS = ("siteMeasurements", "elaboratedData", "situation")
_HEADS = ("publicationTime", "timeDefault", "referenceSettings")


def read(stream: BinaryIO, options: FeedOptions) -> Iterator[Observations]:
    """Yield the traffic status that a publication tells.

    Measured and elaborated data: TrafficStatus, else travel time over free-flow travel time,
    else speed (km/h) over a free-flow speed. ``trafficStatusDefault`` holds for every place of
    the site table that the publication does not list. Situations: AbnormalTraffic and closures,
    the latest version of each record, until its end. Places are joined with ``options.sites``.
    """
    return batches(_Publication(options).records(stream), options)


@dataclass
class _Publication:
    """One publication while it streams by: its defaults, what it listed, what it skipped."""

    options: FeedOptions
    published: datetime | None = None
    default_time: datetime | None = None
    default_status: str | None = None
    group: str | None = None
    listed: set[str] = field(default_factory=set)
    skipped: Counter[str] = field(default_factory=Counter)
    words: dict[str | None, str] = field(default_factory=dict)

    def records(self, stream: BinaryIO) -> Iterator[FlowRecord]:
        """Yield the records of a publication, and warn at its end of what was left out."""
        situations = Situations(self.options)
        for name, element in elements(stream, (*_RECORDS, *_HEADS), self.options):
            if name in _HEADS:
                self._head(name, element)
            elif name == "situation":
                situations.add(element, self._time(None))
            else:
                record = self._flow(name, element)
                if record is not None:
                    self.listed.add(_site_id(name, element) or "")
                    yield record
        yield from situations.records()
        yield from self._defaults()
        self._report(situations.skipped)

    def _head(self, name: str, element: Element) -> None:
        if name == "publicationTime":
            _refuse_v3(element, self.options)
            self.published = self.options.instant(element.text)
        elif name == "timeDefault":
            self.default_time = self.options.instant(element.text)
        else:
            self.default_status = text(element, "trafficStatusDefault")
            group = find(element, "predefinedNonOrderedLocationGroupReference")
            self.group = None if group is None else group.get("id")

    def _time(self, value: str | None) -> datetime:
        found = (
            self.options.instant(value) or self.default_time or self.published or self.options.time
        )
        if found is None:
            raise ColumnError("the publication has no time", self.options.where, "add --time")
        return found

    def _flow(self, name: str, element: Element) -> FlowRecord | None:
        """Return what a site or location tells, or None when it tells nothing about the flow."""
        place = _site_id(name, element)
        if place is None:
            self.skipped["place without an id"] += 1
            return None
        status, relative, speed = self._values(element)
        if status is None and not np.isfinite(relative):
            self.skipped["no traffic status, travel time or free-flow speed"] += 1
            return None
        stated = text(element, "measurementOrCalculationTime")
        site = self.options.sites.get(place, Site(place))
        return FlowRecord(
            segment_id=site.segment_id,
            time=self._time(stated or text(element, "measurementTimeDefault")),
            status=status,
            relative_speed=relative,
            speed_mps=speed,
            line=site.line,
        )

    def _values(self, element: Element) -> tuple[str | None, float, float]:
        speed = number(element, "averageVehicleSpeed", "speed") / 3.6
        travel = number(element, "travelTime", "duration")
        free = number(element, "freeFlowTravelTime", "duration")
        relative = free / travel if travel > 0 else speed / self.options.free_speed_mps
        return self._status(element), relative, speed

    def _status(self, element: Element) -> str | None:
        values = find(element, "trafficStatus")
        if values is None:
            return None
        if text(values, "dataError") == "true":
            return UNKNOWN
        return self._word(text(values, "trafficStatusValue"))

    def _word(self, word: str | None) -> str:
        if word not in self.words:
            profile = self.options.word_profile(DATEX2_V2)
            self.words[word] = status_of_word(word, profile)
        return self.words[word]

    def _defaults(self) -> Iterator[FlowRecord]:
        """Yield the default status for every known place that the publication left out."""
        if self.default_status is None:
            return
        places = self.options.sites
        members = {i for i, site in places.items() if self.group in site.groups} or set(places)
        if not members:
            _LOG.warning(
                "%s: the default status %s for places not listed cannot be used without --sites",
                self.options.where,
                self.default_status,
            )
        for place in sorted(members - self.listed):
            site = places[place]
            status = self._word(self.default_status)
            yield FlowRecord(site.segment_id, self._time(None), status, line=site.line)

    def _report(self, more: Counter[str]) -> None:
        for reason, count in (self.skipped + more).items():
            _LOG.warning("%s: %d records left out: %s", self.options.where, count, reason)
        strangers = self.listed - set(self.options.sites)
        if self.options.sites and strangers:
            _LOG.warning(
                "%s: %d places are not in the site table, such as %s; they keep their own id",
                self.options.where,
                len(strangers),
                min(strangers),
            )


def _site_id(name: str, element: Element) -> str | None:
    reference = "measurementSiteReference"
    if name == "elaboratedData":
        reference = "predefinedLocationReference"
    found = find(element, reference)
    return None if found is None else found.get("id")


def _refuse_v3(element: Element, options: FeedOptions) -> None:
    if "/schema/3/" in str(element.tag):
        raise FileError(
            f"this is DATEX II version 3 ({local_name(element.getroottree().getroot())})",
            options.where,
            "give a version 2 publication; in version 3 the same words mean something else",
        )

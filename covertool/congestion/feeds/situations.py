"""DATEX II v2 situations: versions, ends, closures and abnormal traffic."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from datetime import datetime

from covertool.congestion.feeds.protocol import FeedOptions, FlowRecord, Site
from covertool.congestion.feeds.sites import line_in
from covertool.congestion.feeds.xmlstream import Element, find, text
from covertool.congestion.status import CLOSED, DATEX2_V2, status_of_word

_CLOSURES = ("roadClosed", "carriagewayClosures")
_BLOCKED = ("roadBlocked", "carriagewayBlocked")
_TYPE = "{http://www.w3.org/2001/XMLSchema-instance}type"


class Situations:
    """Situation records gathered by id: of several versions the latest counts."""

    def __init__(self, options: FeedOptions) -> None:
        self.options = options
        self.skipped: Counter[str] = Counter()
        self._latest: dict[str, tuple[tuple[int, str], FlowRecord | None]] = {}

    def add(self, situation: Element, published: datetime) -> None:
        """Take in one situation of a publication."""
        for record in situation.iterfind("{*}situationRecord"):
            key = record.get("id") or situation.get("id") or ""
            version = _version(record.get("version") or situation.get("version") or "0")
            if key in self._latest and self._latest[key][0] > version:
                continue
            self._latest[key] = (version, self._record(key, record, published))

    def records(self) -> Iterator[FlowRecord]:
        """Yield the latest version of each record that tells about the flow."""
        return (record for _, record in self._latest.values() if record is not None)

    def _record(self, key: str, element: Element, published: datetime) -> FlowRecord | None:
        """Return what a situation tells about the flow, or None when it tells nothing."""
        status = self._status(element)
        if status is None:
            kind = str(element.get(_TYPE, "situation record")).rpartition(":")[2]
            self.skipped[f"{kind} tells no traffic status"] += 1
            return None
        start = self.options.instant(text(element, "overallStartTime")) or published
        until = self._until(element, published)
        if until is None or until < start:
            self.skipped["cancelled, suspended or not begun"] += 1
            return None
        reference = find(element, "predefinedLocationReference")
        place = key if reference is None else reference.get("id") or key
        site = self.options.sites.get(place, Site(place))
        return FlowRecord(
            segment_id=site.segment_id,
            time=start,
            until=until,
            status=status,
            line=site.line or line_in(element),
        )

    def _status(self, element: Element) -> str | None:
        if text(element, "probabilityOfOccurrence") in ("riskOf", "improbable"):
            return None
        closed = text(element, "roadOrCarriagewayOrLaneManagementType") in _CLOSURES
        if closed or text(element, "trafficConstrictionType") in _BLOCKED:
            return CLOSED
        word = text(element, "abnormalTrafficType")
        if word in (None, "unspecifiedAbnormalTraffic", "other"):
            return None
        return status_of_word(word, self.options.word_profile(DATEX2_V2))

    def _until(self, element: Element, published: datetime) -> datetime | None:
        """Return how long the record is known to hold; None when it was taken back."""
        if text(element, "cancel") == "true" or text(element, "validityStatus") == "suspended":
            return None
        ends = self.options.instant(text(element, "overallEndTime"))
        if text(element, "lifeCycleManagement", "end") == "true":
            return self.options.instant(text(element, "situationRecordVersionTime")) or ends
        return ends or published


def _version(value: str) -> tuple[int, str]:
    """Return a version so that 10 comes after 9, and text after numbers of equal weight."""
    return (int(value), "") if value.isdigit() else (0, value)

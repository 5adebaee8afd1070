"""Site tables: which segment, and which line, a feed's place id stands for."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from typing import BinaryIO

import numpy as np
import shapely
from pyproj import CRS

from covertool import crs
from covertool.congestion.feeds.protocol import FeedOptions, Site
from covertool.congestion.feeds.xmlstream import Element, elements
from covertool.errors import ColumnError

_LAMBERT_93 = CRS.from_epsg(2154)
_XML_PLACES = (
    "measurementSiteRecord",
    "predefinedLocation",
    "predefinedLocationContainer",
    "predefinedNonOrderedLocationGroup",
)


def read_sites(stream: BinaryIO, options: FeedOptions) -> Mapping[str, Site]:
    """Return the places of a site table by the feed's own id.

    Known are a CSV table with the columns ``site_id, segment_id``, the reference directory of
    Bison Futé (semicolons, no header, Lambert 93), and DATEX II v2 site or location tables.

    Examples
    --------
    >>> table = io.BytesIO(b"site_id,segment_id\\nM1,main_street\\n")
    >>> read_sites(table, FeedOptions())["M1"].segment_id
    'main_street'
    """
    head = stream.read(4096)
    rest = _Rejoined(head, stream)
    if head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<"):
        return _xml_sites(rest, options)
    rows = io.TextIOWrapper(io.BufferedReader(rest), encoding="utf-8-sig", newline="")
    first_line = head.partition(b"\n")[0]
    if first_line.count(b";") >= 15:
        return _bison_fute(rows, options)
    return _csv_sites(rows, options)


class _Rejoined(io.RawIOBase):
    """The bytes already looked at, and then those of the stream."""

    def __init__(self, head: bytes, stream: BinaryIO) -> None:
        self._head, self._stream = head, stream

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: bytearray | memoryview) -> int:  # type: ignore[override]
        chunk = self._head[: len(buffer)] or self._stream.read(len(buffer))
        self._head = self._head[len(buffer) :]
        buffer[: len(chunk)] = chunk
        return len(chunk)


def _csv_sites(rows: io.TextIOWrapper, options: FeedOptions) -> dict[str, Site]:
    table = csv.DictReader(rows)
    if not {"site_id", "segment_id"} <= set(table.fieldnames or ()):
        raise ColumnError(
            "a site table needs the columns site_id and segment_id"
            f" (found: {', '.join(table.fieldnames or ())})",
            options.where,
            "rename the columns",
        )
    return {row["site_id"]: Site(row["segment_id"]) for row in table}


def _bison_fute(rows: io.TextIOWrapper, options: FeedOptions) -> dict[str, Site]:
    """Return sites of the reference directory: the id, then both ends from column 15 on."""
    sites = {}
    for place, row in enumerate(csv.reader(rows, delimiter=";")):
        if not row:
            continue
        try:
            x1, y1, x2, y2 = (float(value) for value in row[14:18])
        except ValueError:
            raise ColumnError(
                f"row {place + 1} has no coordinates of both ends",
                options.where,
                "give the reference directory as it is published",
            ) from None
        ends = crs.transform(np.array([x1, x2]), np.array([y1, y2]), _LAMBERT_93, crs.WGS84)
        line = shapely.LineString(np.column_stack(ends))
        sites[row[0]] = Site(row[0], line, float(np.hypot(x2 - x1, y2 - y1)))
    return sites


def _xml_sites(stream: _Rejoined, options: FeedOptions) -> dict[str, Site]:
    sites: dict[str, Site] = {}
    buffered = io.BufferedReader(stream)
    for _, element in elements(buffered, _XML_PLACES, options):
        members = list(element.iterfind(".//{*}predefinedLocation"))
        for member in members:
            _add(sites, member, element.get("id"))
        if not members:
            _add(sites, element, None)
    return sites


def _add(sites: dict[str, Site], element: Element, group: str | None) -> None:
    place = element.get("id")
    if place:
        groups = frozenset() if group is None else frozenset({group})
        sites[place] = Site(place, line_in(element), groups=groups)


def line_in(element: Element) -> shapely.LineString | None:
    """Return the line through the coordinates below an element; None for fewer than two."""
    try:
        lat = [float(e.text) for e in element.iterdescendants("{*}latitude")]
        lon = [float(e.text) for e in element.iterdescendants("{*}longitude")]
    except (TypeError, ValueError):
        return None
    if len(lat) != len(lon) or len(lat) < 2 or not np.isfinite([lat, lon]).all():
        return None
    return shapely.LineString(np.column_stack([lon, lat]))

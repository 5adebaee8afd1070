"""Which OpenStreetMap roads carry traffic, and how wide their carriageways are."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

Tags = Mapping[str, str]

LANE_WIDTH_M = {
    "motorway": 3.75,
    "trunk": 3.5,
    "primary": 3.5,
    "secondary": 3.25,
    "tertiary": 3.0,
    "unclassified": 3.0,
    "residential": 2.75,
    "living_street": 2.5,
    "service": 2.5,
    "busway": 3.25,
    "road": 3.0,
}
"""Width of a lane in metres by ``highway`` class; a ``_link`` has the width of its class.

Chosen from the usual range of design guides (2.5 m at low speed to 3.75 m on motorways)."""

ONE_LANE = ("living_street", "service")
"""Classes that are as wide as one and a half lanes when nothing says otherwise."""

_SERVICE_YARDS = ("driveway", "parking_aisle", "drive-through", "emergency_access")
_FOOT_M = 0.3048
_NUMBER = re.compile(r"\s*(\d+(?:[.,]\d+)?)\s*(m|metres?|meters?|ft|feet|')?\s*(?:(\d+)\s*\")?\s*$")
_WIDTHS_M = (1.5, 60.0)
"""Widths beyond these are taken for slips of the pen and not used."""


@dataclass(frozen=True)
class RoadChoice:
    """Which roads belong to the transit area.

    Attributes
    ----------
    tunnels : with roads in tunnels and building passages
    private : with roads whose access is private or forbidden
    yards : with driveways and parking aisles
    """

    tunnels: bool = False
    private: bool = False
    yards: bool = False


def is_transit(tags: Tags, choice: RoadChoice) -> bool:
    """Return True when cars drive on a road with these tags.

    >>> is_transit({"highway": "footway"}, RoadChoice())
    False
    """
    if _class(tags) not in LANE_WIDTH_M or tags.get("area") == "yes":
        return False
    if not choice.tunnels and tags.get("tunnel", "no") != "no":
        return False
    access = tags.get("motor_vehicle", tags.get("vehicle", tags.get("access", "yes")))
    if not choice.private and access in ("private", "no"):
        return False
    return choice.yards or tags.get("service") not in _SERVICE_YARDS


def carriageway_width_m(tags: Tags, choice: RoadChoice | None = None) -> float:
    """Return the width of a carriageway: ``width``, else lanes times the class's lane width.

    Without either, a class has two lanes (one and a half where it is a living street or a service
    road, two each way on a motorway); a one-way road has half of that, at least one lane.

    >>> carriageway_width_m({"highway": "residential", "width": "5.5 m"})
    5.5
    >>> carriageway_width_m({"highway": "primary", "lanes": "3"})
    10.5
    >>> carriageway_width_m({"highway": "residential", "oneway": "yes"})
    2.75
    """
    for key in ("width:carriageway", "width"):
        tagged = parsed_width_m(tags.get(key))
        if tagged is not None:
            return tagged
    kind = _class(tags)
    lane_m = LANE_WIDTH_M[kind]
    lanes = _lanes(tags.get("lanes"))
    if lanes is not None:
        return lanes * lane_m
    usual = 4.0 if kind == "motorway" else 1.5 if kind in ONE_LANE else 2.0
    return lane_m * max(usual / 2 if is_one_way(tags) else usual, 1.0)


def is_one_way(tags: Tags) -> bool:
    """Return True for one-way roads, said or implied (motorways, roundabouts, links)."""
    said = tags.get("oneway")
    if said is not None:
        return said in ("yes", "true", "1", "-1")
    highway = tags.get("highway", "")
    implied = highway == "motorway" or highway.endswith("_link")
    return implied or tags.get("junction") in ("roundabout", "circular")


def parsed_width_m(text: str | None) -> float | None:
    """Return a width in metres from ``5.5``, ``5,5 m``, ``18'`` or ``16'6"``; None if unreadable.

    >>> parsed_width_m("5,5 m"), round(parsed_width_m("18'") or 0, 4), parsed_width_m("wide")
    (5.5, 5.4864, None)
    """
    found = _NUMBER.match(text or "")
    if found is None:
        return None
    value = float(found[1].replace(",", "."))
    if found[2] in ("ft", "feet", "'"):
        value = (value + float(found[3] or 0) / 12) * _FOOT_M
    return value if _WIDTHS_M[0] <= value <= _WIDTHS_M[1] else None


def _class(tags: Tags) -> str:
    return tags.get("highway", "").removesuffix("_link")


def _lanes(text: str | None) -> float | None:
    try:
        lanes = float(text or "")
    except ValueError:
        return None
    return lanes if 1 <= lanes <= 16 else None

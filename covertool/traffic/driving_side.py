"""On which side of the road cars drive: read from the roads of an extract, else from its place."""

from __future__ import annotations

import logging
import re
from collections import Counter
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import shapely
from pyproj import CRS

from covertool import crs as crs_door
from covertool.model import Bounds, Floats, Objects

if TYPE_CHECKING:
    import geopandas as gpd

SIDES = ("left", "right")
Votes = dict[str, int]
_LOG = logging.getLogger(__name__)

_ENOUGH_VOTES, _MAJORITY = 3, 0.8
_APART_M = (4.0, 30.0)
"""How far apart the two carriageways of one street lie."""
_SAMPLE_M = 25.0
_OPPOSITE = -0.95

_LEFT_COUNTRIES = (
    "AG AI AU BB BD BM BN BS BT BW CC CK CX CY DM FJ FK GB GD GG GY HK ID IE IM IN JE JM JP KE KI"
    " KN KY LC LK LS MO MS MT MU MV MW MY MZ NA NF NP NR NU NZ PG PK PN SB SC SG SH SR SZ TC TH TK"
    " TL TO TT TV TZ UG UK VC VG VI WS ZA ZM ZW"
)
"""ISO 3166 codes (and OSM's UK) of the countries and territories that drive on the left."""
_COUNTRY_TAGS = ("addr:country", "maxspeed:type", "source:maxspeed", "zone:maxspeed", "maxspeed")
_COUNTRY = re.compile(r"([A-Z]{2})(?::|$)")
_LEFT_BOXES: tuple[Bounds, ...] = (
    (-11.0, 49.8, 1.5, 61.0),  # Ireland and Great Britain
    (129.0, 30.0, 146.0, 45.6),  # Japan
    (112.0, -48.0, 180.0, -9.0),  # Australia, New Zealand, Papua New Guinea
    (95.0, -11.0, 141.0, 6.0),  # Indonesia, Malaysia, Singapore
    (68.0, 5.5, 89.0, 27.0),  # India, Sri Lanka
    (98.0, 6.0, 102.0, 18.0),  # Thailand
    (11.5, -35.0, 41.0, -15.0),  # southern Africa
    (29.5, -12.0, 42.0, 4.0),  # eastern Africa
)
"""Very rough; asked last, and never without a warning."""


def side_of_roads(roads: gpd.GeoDataFrame, where: str) -> str:
    """Return left or right for the roads of an OSM extract, as `gis.osm.read_roads` gives them.

    Asked in this order: ``driving_side`` tags; country codes in tags such as
    ``maxspeed:type=IE:urban``; the sense in which roundabouts turn, and the side on which the
    other carriageway of a street lies. When none of these tells clearly, the place decides by
    rough boxes, and a warning says so.
    """
    for votes in (_votes_of_tags(roads), _votes_of_countries(roads), _votes_of_roads(roads)):
        total = sum(votes.values())
        best = max(SIDES, key=lambda side: votes[side])
        if total >= _ENOUGH_VOTES and votes[best] >= _MAJORITY * total:
            _LOG.info("%s: the roads say that cars drive on the %s (%s)", where, best, votes)
            return best
    return _side_of_place(roads, where)


def _votes_of_tags(roads: gpd.GeoDataFrame) -> Votes:
    told = Counter(tags.get("driving_side") for tags in roads["tags"])
    return {side: told[side] * _ENOUGH_VOTES for side in SIDES}


def _votes_of_countries(roads: gpd.GeoDataFrame) -> Votes:
    votes = dict.fromkeys(SIDES, 0)
    for tags in roads["tags"]:
        for key in _COUNTRY_TAGS:
            found = _COUNTRY.match(tags.get(key, ""))
            if found is not None:
                left = found[1] in _LEFT_COUNTRIES.split()
                votes["left" if left else "right"] += 1
    return votes


def _votes_of_roads(roads: gpd.GeoDataFrame) -> Votes:
    """Return how many places on the roads speak for each side."""
    lines = np.asarray(roads.geometry.array, dtype=object)
    tags = list(roads["tags"])
    rings = [tag.get("junction") in ("roundabout", "circular") for tag in tags]
    turns = [_turned(line) for line, ring in zip(lines, rings, strict=True) if ring]
    clockwise = sum(turn < -np.pi / 4 for turn in turns)
    votes = {"left": clockwise, "right": sum(turn > np.pi / 4 for turn in turns)}
    one_way = [
        _direction(tag) != 0 and not ring and bool(tag.get("name"))
        for tag, ring in zip(tags, rings, strict=True)
    ]
    for side, count in _votes_of_pairs(lines, tags, np.flatnonzero(one_way)).items():
        votes[side] += count
    return votes


def _direction(tags: dict[str, str]) -> int:
    """Return 1 for a street that is one-way as drawn, -1 against it, 0 for both ways."""
    told = tags.get("oneway", "no")
    return {"yes": 1, "true": 1, "1": 1, "-1": -1, "reverse": -1}.get(told, 0)


def _turned(line: shapely.LineString) -> float:
    """Return by how many radians a line turns to the left from its start to its end."""
    steps = np.diff(shapely.get_coordinates(line), axis=0)
    angles = np.arctan2(steps[:, 1], steps[:, 0])
    return float(np.sum((np.diff(angles) + np.pi) % (2 * np.pi) - np.pi))


def _votes_of_pairs(
    lines: Objects, tags: list[dict[str, str]], rows: npt.NDArray[np.intp]
) -> Votes:
    """Count on which side the opposite carriageway of the same street lies."""
    votes = {"left": 0, "right": 0}
    xy, heading, names = _sampled(lines, tags, rows)
    for one, other in _close_pairs(xy) if names else []:
        opposite = float(heading[one] @ heading[other]) < _OPPOSITE
        if names[one] != names[other] or not opposite:
            continue
        gap = xy[other] - xy[one]
        across = heading[one][0] * gap[1] - heading[one][1] * gap[0]
        along = abs(float(heading[one] @ gap))
        if along < _SAMPLE_M / 2 and _APART_M[0] < abs(across) < _APART_M[1]:
            # To drive on the left is to have those who come towards you on the right.
            votes["right" if across > 0 else "left"] += 1
    return votes


def _sampled(
    lines: Objects, tags: list[dict[str, str]], rows: npt.NDArray[np.intp]
) -> tuple[Floats, Floats, list[str]]:
    """Return (N, 2) places along one-way streets, the directions there, and the streets' names."""
    points, headings = [np.empty((0, 2))], [np.empty((0, 2))]
    names: list[str] = []
    for row in rows:
        at = np.arange(_SAMPLE_M / 2, lines[row].length, _SAMPLE_M)
        here = shapely.get_coordinates(shapely.line_interpolate_point(lines[row], at))
        ahead = shapely.get_coordinates(shapely.line_interpolate_point(lines[row], at + 1.0))
        points.append(here)
        headings.append((ahead - here) * _direction(tags[row]))
        names += [tags[row]["name"]] * len(at)
    return np.concatenate(points), np.concatenate(headings), names


def _close_pairs(xy: Floats) -> list[tuple[int, int]]:
    places = np.asarray(shapely.points(xy), dtype=object)
    found = shapely.STRtree(places).query(places, predicate="dwithin", distance=_APART_M[1])
    return [(int(one), int(other)) for one, other in found.T if one < other]


def _side_of_place(roads: gpd.GeoDataFrame, where: str) -> str:
    x0, y0, x1, y1 = (float(value) for value in roads.total_bounds)
    middle = np.array([(x0 + x1) / 2]), np.array([(y0 + y1) / 2])
    crs = CRS.from_user_input(roads.crs)
    lon, lat = (float(v[0]) for v in crs_door.transform(*middle, crs, crs_door.WGS84))
    left = any(w <= lon <= e and s <= lat <= n for w, s, e, n in _LEFT_BOXES)
    side = "left" if left else "right"
    _LOG.warning(
        "%s: the roads do not tell on which side cars drive; by the place (%.2f, %.2f) "
        "the %s is assumed; --driving-side says otherwise",
        where, lat, lon, side,
    )  # fmt: skip
    return side

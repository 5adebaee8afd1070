"""Bays: where cars can stand in parking areas and along kerbs, without saying which do."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import shapely
from shapely import affinity

from covertool.model import Floats

BAY_WIDTH_M, BAY_DEPTH_M, PARALLEL_LENGTH_M, PARALLEL_WIDTH_M = 2.4, 4.8, 6.0, 2.0
"""Bays at right angles 2.4 x 4.8 m, along the kerb 6 x 2 m.

The first is near what the Dublin City Development Plan 2016-2022 asks of car parks (section
16.38.9: never below 2.4 m in width, 4.75 m in length); the second is an assumption, a car with the
room it needs to leave.
"""

AISLE_M = 6.0
"""Between rows of bays at right angles; an assumption."""

SPACING_M = {
    "parallel": PARALLEL_LENGTH_M,
    "diagonal": BAY_WIDTH_M * np.sqrt(2),
    "perpendicular": BAY_WIDTH_M,
}
"""Kerb that one car takes, by orientation; diagonal is taken as 45 degrees."""

DEPTH_M = {
    "parallel": PARALLEL_WIDTH_M,
    "diagonal": (BAY_DEPTH_M + BAY_WIDTH_M) / np.sqrt(2),
    "perpendicular": BAY_DEPTH_M,
}
"""How far a bay reaches from the kerb, by orientation."""

_ALLOWED = ("lane", "street_side", "on_kerb", "half_on_kerb", "shoulder", "yes")
_FORBIDDING = ("no_parking", "no_stopping", "no_standing", "loading_only")
_SLACK_M = 0.05


def kerb_orientation(tags: Mapping[str, str], side: str) -> str | None:
    """Return how cars park at a side (left or right of the way), or None where they do not.

    Both tagging schemas are read: ``parking:right=lane`` with ``parking:right:orientation``, and
    the older ``parking:lane:right=parallel``; ``both`` stands for either side.

    >>> kerb_orientation({"parking:lane:both": "diagonal"}, "left")
    'diagonal'
    >>> kerb_orientation({"parking:right": "lane"}, "right")
    'parallel'
    >>> kerb_orientation({"parking:right": "lane"}, "left") is None
    True
    """
    where = _either(tags, "parking:{}", side)
    if where is not None:
        if where not in _ALLOWED or _either(tags, "parking:{}:restriction", side) in _FORBIDDING:
            return None
        said = _either(tags, "parking:{}:orientation", side) or "parallel"
        return said if said in SPACING_M else "parallel"
    old = _either(tags, "parking:lane:{}", side)
    if old is None or _either(tags, "parking:condition:{}", side) in _FORBIDDING:
        return None
    return "parallel" if old == "marked" else old if old in SPACING_M else None


def kerb_bays(line: shapely.LineString, side: str, orientation: str, half_m: float) -> Floats:
    """Return (N, 2) centres of the bays along one side of a road.

    Parameters
    ----------
    line : the road's centre line in metres
    side : left or right of the line's direction
    orientation : parallel, diagonal or perpendicular
    half_m : half the width of the carriageway
    """
    spacing = SPACING_M[orientation]
    count = int((line.length + 1e-9) // spacing)
    along = (np.arange(count) + 0.5) * spacing + (line.length - count * spacing) / 2
    ahead = 0.1
    start = shapely.get_coordinates(shapely.line_interpolate_point(line, along - ahead))
    stop = shapely.get_coordinates(shapely.line_interpolate_point(line, along + ahead))
    way = stop - start
    way /= np.hypot(way[:, 0], way[:, 1])[:, None] + 1e-12
    to_right = np.column_stack([way[:, 1], -way[:, 0]])
    offset = half_m + DEPTH_M[orientation] / 2
    bays: Floats = (start + stop) / 2 + to_right * (offset if side == "right" else -offset)
    return bays


def lot_bays(area: shapely.Polygon) -> Floats:
    """Return (N, 2) centres of bays in a parking area.

    Rows of bays at right angles to aisles of 6 m, along the area's longer or shorter side,
    whichever holds more; where none fits, one row of bays nose to tail.

    Examples
    --------
    >>> len(lot_bays(shapely.box(0, 0, 24, 15.6)))
    20
    """
    frame = area.minimum_rotated_rectangle
    corners = shapely.get_coordinates(frame)
    if len(corners) < 5:
        return np.empty((0, 2))
    side = corners[1] - corners[0]
    angle = float(np.degrees(np.arctan2(side[1], side[0])))
    best = np.empty((0, 2))
    for turn in (angle, angle + 90.0):
        rows = _rows(area, turn, BAY_WIDTH_M, BAY_DEPTH_M)
        best = rows if len(rows) > len(best) else best
    if len(best):
        return best
    longest = [
        _rows(area, turn, PARALLEL_LENGTH_M, PARALLEL_WIDTH_M) for turn in (angle, angle + 90)
    ]
    return max(longest, key=len)


def _rows(area: shapely.Polygon, angle_deg: float, wide_m: float, deep_m: float) -> Floats:
    """Return the centres of bays in rows along a direction: row, aisle, row, and again."""
    origin = (0.0, 0.0)
    upright = affinity.rotate(area, -angle_deg, origin=origin)
    x0, y0, x1, y1 = upright.bounds
    module = 2 * deep_m + AISLE_M
    starts = np.arange(y0, y1, module)
    rows = np.sort(np.concatenate([starts + deep_m / 2, starts + deep_m + AISLE_M + deep_m / 2]))
    count = int((x1 - x0 + _SLACK_M) // wide_m)
    columns = x0 + (np.arange(count) + 0.5) * wide_m + max(x1 - x0 - count * wide_m, 0) / 2
    x, y = (grid.ravel() for grid in np.meshgrid(columns, rows))
    boxes = shapely.box(x - wide_m / 2, y - deep_m / 2, x + wide_m / 2, y + deep_m / 2)
    room = upright.buffer(_SLACK_M, join_style="mitre")
    shapely.prepare(room)
    fits = shapely.covers(room, boxes)
    turn = np.radians(angle_deg)
    back = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    bays: Floats = np.column_stack([x, y])[fits] @ back
    return bays


def _either(tags: Mapping[str, str], key: str, side: str) -> str | None:
    return tags.get(key.format(side)) or tags.get(key.format("both"))

"""Joining lines that a feed draws to the segments of a street network."""

from __future__ import annotations

import logging

import numpy as np
import shapely

from covertool import crs
from covertool.congestion.streets import Streets
from covertool.model import Objects, Observations

_LOG = logging.getLogger(__name__)

NEAR_M = 20.0
LEAST_SHARE = 0.5


def match_lines(
    observations: Observations,
    network: Streets,
    *,
    near_m: float = NEAR_M,
    least_share: float = LEAST_SHARE,
) -> Observations:
    """Return observations of the segments along which each observed line runs.

    A segment takes part when at least ``least_share`` of its length lies within ``near_m`` of the
    line and both run the same way. Observations without a line keep their segment; lines that
    match nothing are counted in a warning and left out.

    Parameters
    ----------
    observations : with lines in WGS 84, or None for those that name their segment
    network : the streets, in metres
    near_m : how far from the line a segment may lie
    least_share : of a segment's length that must lie so near, 0 to 1
    """
    with_line = np.array([line is not None for line in observations.line], dtype=bool)
    rows = np.flatnonzero(with_line)
    lines = crs.transform_geometries(observations.line[rows], crs.WGS84, network.crs)
    places, segments = _pairs(lines, network.line, near_m, least_share)
    matched = observations.take(rows[places])
    joined = Observations(**{**matched.columns(), "segment_id": network.segment_id[segments]})
    lost = rows.size - np.unique(places).size
    if lost:
        _LOG.warning("%d of %d observed lines match no segment", lost, rows.size)
    return Observations.concatenate([observations.take(~with_line), joined])


def _pairs(
    lines: Objects, streets: Objects, near_m: float, least_share: float
) -> tuple[np.ndarray[tuple[int], np.dtype[np.intp]], np.ndarray[tuple[int], np.dtype[np.intp]]]:
    """Return which line runs along which street."""
    zones = shapely.buffer(lines, near_m, cap_style="flat")
    place, street = shapely.STRtree(streets).query(zones, predicate="intersects")
    inside = shapely.intersection(zones[place], streets[street])
    enough = shapely.length(inside) >= least_share * shapely.length(streets[street])
    place, street, inside = place[enough], street[enough], inside[enough]
    first, last = (_end(inside, end) for end in (0, -1))
    along = shapely.line_locate_point(lines[place], last) - shapely.line_locate_point(
        lines[place], first
    )
    # Crossing streets and the opposite carriageway advance little or backwards along the line.
    same_way = along > 0.5 * shapely.length(inside)
    return place[same_way], street[same_way]


def _end(inside: Objects, end: int) -> Objects:
    """Return the first or last point of each piece, in its street's direction."""
    merged = shapely.line_merge(inside, directed=True)
    parts = np.array([shapely.get_parts(geometry)[end] for geometry in merged], dtype=object)
    points: Objects = shapely.get_point(parts, end)
    return points

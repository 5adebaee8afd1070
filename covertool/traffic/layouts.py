"""Layouts of parked cars: which of them are equipped, and where along their street they stand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely

from covertool.errors import OptionError
from covertool.model import Anchors, Floats, Objects
from covertool.traffic.network import Network


def parked_layouts(
    anchors: Anchors,
    count: int,
    *,
    share: float = 1.0,
    seed: int = 1,
    network: Network | None = None,
) -> list[Anchors]:
    """Return layouts of parked cars: one as it is, or several that are drawn at random.

    Each layout keeps every car with probability ``share``. Of several layouts, each also moves
    the parked cars along the edge nearest to them, all of one edge by the same random way and round
    its end to its start, so that their number on each street, their gaps and their distance from
    the kerb stay. Without a network the cars stay where they are.

    Parameters
    ----------
    anchors : the parked cars
    count : number of layouts
    share : penetration rate, in (0, 1]
    seed : of the layouts
    network : the streets along which they stand, in the CRS of the anchors

    Raises
    ------
    OptionError
        When a number is out of range, or all layouts would be the same.
    """
    if count < 1 or not 0 < share <= 1:
        raise OptionError(
            "a number of layouts or a penetration rate is out of range",
            f"layouts={count}, penetration={share:g}",
            "use 1 or more layouts, and a rate above 0 and up to 1",
        )
    if count > 1 and network is None and share == 1:
        raise OptionError(
            "without a street network all layouts would be the same",
            f"layouts={count}, penetration=1",
            "name the network with --net, or add --penetration below 1",
        )
    layouts = []
    for number in range(count):
        rng = np.random.Generator(np.random.Philox(key=[seed, number]))
        moved = anchors if count == 1 or network is None else _along(anchors, network, rng)
        layouts.append(moved if share == 1 else moved.take(rng.random(len(moved)) < share))
    return layouts


def _along(anchors: Anchors, network: Network, rng: np.random.Generator) -> Anchors:
    """Return the anchors, each moved along its edge."""
    if not len(anchors):
        return anchors
    lines = np.array([shapely.LineString(edge.shape) for edge in network.edges.values()])
    places = shapely.points(anchors.x_m, anchors.y_m)
    nearest = shapely.STRtree(lines).nearest(places)
    line, length_m = lines[nearest], shapely.length(lines)[nearest]
    at_m = shapely.line_locate_point(line, places)
    foot, along = _foot(line, at_m, length_m)
    away = np.stack([anchors.x_m, anchors.y_m], axis=1) - foot
    across_m = along[:, 0] * away[:, 1] - along[:, 1] * away[:, 0]
    beyond_m = np.sum(along * away, axis=1)  # not 0 where the nearest point is an end of the edge
    shift_m = rng.random(lines.size)[nearest] * length_m
    foot, along = _foot(line, np.mod(at_m + shift_m, length_m), length_m)
    left = np.stack([-along[:, 1], along[:, 0]], axis=1)
    moved = foot + across_m[:, None] * left + beyond_m[:, None] * along
    return replace(anchors, x_m=moved[:, 0].copy(), y_m=moved[:, 1].copy())


def _foot(line: Objects, at_m: Floats, length_m: Floats) -> tuple[Floats, Floats]:
    """Return the points at some ways along lines, and the unit vectors of the lines there."""
    reach_m = np.minimum(0.5, length_m / 2)
    start_m = np.clip(at_m - reach_m, 0.0, length_m - 2 * reach_m)
    before, there, after = (
        shapely.get_coordinates(shapely.line_interpolate_point(line, way_m))
        for way_m in (start_m, at_m, start_m + 2 * reach_m)
    )
    ahead = after - before
    return there, ahead / np.maximum(np.hypot(*ahead.T), 1e-9)[:, None]

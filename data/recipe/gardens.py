"""Gardens: driveways in front of the houses, lawns and hedges behind them."""

from __future__ import annotations

import numpy as np
import shapely

from data.recipe.carparks import Bays
from data.recipe.curves import Points, rectangle
from data.recipe.plots import DEPTH_M, GARDEN_M, PAVEMENT_M, PITCH_M, Plot

_REAR_M = {"houses": 8.0, "terrace": 9.0, "ribbon": 13.0}
_SAME_HEDGE_M = 1.6


def rear_garden(plot: Plot) -> Points:
    """Return the four corners of the garden behind a house: two at the house, two at the end."""
    kind = plot.street.frontage
    house = PAVEMENT_M + GARDEN_M[kind] + DEPTH_M[kind]
    half = PITCH_M[kind] / 2
    end = house + _REAR_M[kind]
    return np.array(
        [plot.at(-half, house), plot.at(half, house), plot.at(half, end), plot.at(-half, end)]
    )


def hedges(built: list[Plot], taken: shapely.Geometry) -> list[Points]:
    """Return the hedges round the rear gardens, each once, clear of ``taken``."""
    sides = []
    for plot in built:
        corners = rear_garden(plot)
        sides += [corners[[1, 2]], corners[[2, 3]], corners[[3, 0]]]
    middles = shapely.points(np.array([side.mean(axis=0) for side in sides]))
    tree = shapely.STRtree(middles)
    shapely.prepare(taken)
    drawn: set[int] = set()
    for number, side in enumerate(sides):
        near = tree.query(middles[number], predicate="dwithin", distance=_SAME_HEDGE_M)
        if drawn.isdisjoint(near.tolist()) and not taken.intersects(shapely.LineString(side)):
            drawn.add(number)
    return [sides[number] for number in sorted(drawn)]


def driveways(drives: Bays) -> list[shapely.Polygon]:
    """Return the paved strips that lead from the kerb to the places before the houses."""
    angle = np.radians(drives.heading_deg)
    inward = np.column_stack([np.sin(angle), np.cos(angle)])
    places = np.column_stack([drives.x_m, drives.y_m])
    return [
        shapely.Polygon(rectangle(place - 0.8 * way, way, 8.2, 2.7))
        for place, way in zip(places, inward, strict=True)
    ]

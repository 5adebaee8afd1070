"""The whole town, from the drawing to the parked cars, in metres about Main Street."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import shapely

from data.recipe import blocks, carparks, plots, skeleton
from data.recipe.carparks import Bays
from data.recipe.carriageway import carriageway
from data.recipe.estates import grow_estates
from data.recipe.parameters import Calibrated
from data.recipe.parking import parked_cars
from data.recipe.plots import Building, Plot
from data.recipe.skeleton import Street


@dataclass(frozen=True)
class Fabric:
    """The town without its cars: streets, transit area, buildings and places to park.

    The first buildings are the houses that stand on ``built``, in its order.
    """

    streets: list[Street]
    transit: shapely.MultiPolygon
    buildings: list[Building]
    built: list[Plot]
    lots: Bays
    kerbs: Bays
    drives: Bays


def lay_out(calibrated: Calibrated) -> Fabric:
    """Return the town's fabric."""
    edge = skeleton.built_edge(calibrated.town_scale)
    roads = _within(skeleton.through_roads(), edge.buffer(calibrated.outskirts_m))
    reserved = skeleton.reserved_land()
    grounds = [carparks.ground(park) for park in skeleton.CAR_PARKS]
    railway = skeleton.railway_strip()
    green = shapely.union_all([*reserved.values(), railway, *[g.buffer(12.0) for g in grounds]])
    streets = roads + grow_estates(roads, edge.difference(green))
    ways_in = [carparks.way_in(park, streets, railway) for park in skeleton.CAR_PARKS]
    aisles = [aisle for park in skeleton.CAR_PARKS for aisle in carparks.aisles(park)]
    streets += [way for way in ways_in if way is not None]
    transit = carriageway(streets + aisles)
    taken = shapely.union_all([transit.buffer(1.5), railway, *grounds])
    frontage = plots.plots(streets)
    land = edge.buffer(60.0).difference(shapely.union_all(list(reserved.values())).buffer(-10.0))
    houses, built = plots.build_houses(frontage, taken, land)
    large = blocks.large_buildings(reserved, shapely.union_all([taken, *_outlines(houses)]))
    buildings = houses + large
    walls = shapely.union_all(_outlines(buildings))
    blocked = shapely.union_all([transit, walls])
    in_town = [s for s in streets if edge.buffer(40.0).intersects(s.line)]
    lots = _join([carparks.bays(park) for park in skeleton.CAR_PARKS])
    return Fabric(
        streets=streets + aisles,
        transit=transit,
        buildings=buildings,
        built=built,
        lots=plots.free_places(lots, blocked),
        kerbs=plots.free_places(plots.kerb_places(in_town), blocked),
        drives=plots.free_places(plots.driveways(built), blocked),
    )


def _within(roads: list[Street], limits: shapely.Polygon) -> list[Street]:
    """Return the roads without what lies beyond the town's limits."""
    shapely.prepare(limits)
    kept = []
    for road in roads:
        inside = shapely.contains_xy(limits, road.points[:, 0], road.points[:, 1])
        last = int(np.argmin(inside)) if not inside.all() else len(road.points)
        if last > 2:
            kept.append(replace(road, points=road.points[:last]))
    return kept


def _join(parts: list[Bays]) -> Bays:
    return Bays(
        np.concatenate([part.x_m for part in parts]),
        np.concatenate([part.y_m for part in parts]),
        np.concatenate([part.heading_deg for part in parts]),
        sum((part.site for part in parts), ()),
        sum((part.group for part in parts), ()),
    )


def _outlines(buildings: list[Building]) -> list[shapely.Polygon]:
    return [building.outline for building in buildings]


def park(fabric: Fabric, calibrated: Calibrated) -> Bays:
    """Return the parked cars; kerb and driveway cars that would touch are sorted out beforehand."""
    drives = plots.free_places(_join([fabric.kerbs, fabric.drives]), shapely.MultiPolygon())
    keep = np.array([site == "off_street" for site in drives.site])
    rows = np.flatnonzero(keep)
    clear = Bays(
        drives.x_m[rows],
        drives.y_m[rows],
        drives.heading_deg[rows],
        tuple(drives.site[row] for row in rows),
        tuple(drives.group[row] for row in rows),
    )
    return parked_cars(fabric.lots, fabric.kerbs, clear, calibrated)

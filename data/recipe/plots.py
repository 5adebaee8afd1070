"""Plots along the streets: houses, driveways, and places along the kerb."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from data.recipe.carparks import Bays
from data.recipe.curves import Points, frame, heading_deg, left_of, length_m, rectangle
from data.recipe.parameters import stream
from data.recipe.skeleton import Street

PAVEMENT_M = 2.0
CAR_LENGTH_M, CAR_WIDTH_M = 4.4, 1.8
PITCH_M = {"houses": 9.0, "terrace": 7.0, "ribbon": 34.0}
DEPTH_M = {"houses": 9.0, "terrace": 11.0, "ribbon": 11.0}
GARDEN_M = {"houses": 6.2, "terrace": 0.6, "ribbon": 14.0}
_TRIMS_M = (0.0, 0.1, 0.2, 0.3, 0.4)
_TOUCH_M2 = 0.02


@dataclass(frozen=True)
class Building:
    """A building's footprint, what it is, and its height in metres."""

    outline: shapely.Polygon
    kind: str
    height_m: float


@dataclass(frozen=True)
class Plot:
    """A piece of frontage: the point of the kerb in its middle, and the ways along and inwards."""

    street: Street
    side: float
    kerb: Points
    along: Points

    @property
    def inward(self) -> Points:
        """The unit vector from the kerb onto the plot."""
        return self.side * left_of(self.along)

    def at(self, along_m: float, inward_m: float) -> Points:
        """Return a place of the plot, by metres along the street and inwards from the kerb."""
        return self.kerb + along_m * self.along + inward_m * self.inward


def plots(streets: list[Street]) -> list[Plot]:
    """Return the plots on both sides of every street that has a frontage."""
    found = []
    for street in streets:
        if street.frontage == "none":
            continue
        pitch = PITCH_M[street.frontage]
        for side in (1.0, -1.0):
            for at in np.arange(pitch, length_m(street.points) - pitch / 2, pitch):
                place, along = frame(street.points, float(at))
                kerb = place + side * left_of(along) * street.width_m / 2
                found.append(Plot(street, side, kerb, along))
    return found


def build_houses(
    frontage: list[Plot], taken: shapely.Geometry, building_land: shapely.Geometry
) -> tuple[list[Building], list[Plot]]:
    """Return the houses that find room, and the plots that they stand on.

    Semi-detached houses share a wall: every second plot is drawn towards the one before it.
    """
    rng = stream("houses")
    shapely.prepare(taken)
    shapely.prepare(building_land)
    outlines = [_outline(plot, number) for number, plot in enumerate(frontage)]
    tree = shapely.STRtree(outlines)
    kept: dict[int, shapely.Polygon] = {}
    for number, outline in enumerate(outlines):
        if taken.intersects(outline) or not building_land.contains(outline):
            continue
        near = [n for n in tree.query(outline).tolist() if n in kept]
        core = _outline(frontage[number], number, _TRIMS_M[-1])
        if not any(core.intersects(outlines[n]) for n in near):
            kept[number] = _apart_from([kept[n] for n in near], frontage[number], number)
    houses = [
        Building(
            kept[n],
            "terrace" if frontage[n].street.frontage == "terrace" else "house",
            float(rng.normal(9.0 if frontage[n].street.frontage == "terrace" else 7.0, 0.6)),
        )
        for n in sorted(kept)
    ]
    return houses, [frontage[n] for n in sorted(kept)]


def _apart_from(neighbours: list[shapely.Polygon], plot: Plot, number: int) -> shapely.Polygon:
    """Return the plot's house, drawn in until it only touches its neighbours.

    Where a street bends, the rears of the houses on its inner side would run into each other.
    """
    houses = [_outline(plot, number, trim_m) for trim_m in _TRIMS_M]
    for house in houses:
        if all(house.intersection(other).area < _TOUCH_M2 for other in neighbours):
            return house
    return houses[-1]


def _outline(plot: Plot, number: int, trim_m: float = 0.0) -> shapely.Polygon:
    """Return the outline of a house, less ``trim_m`` at each of its walls."""
    kind = plot.street.frontage
    pitch, depth = PITCH_M[kind], DEPTH_M[kind]
    width = pitch if kind == "terrace" else min(pitch - 1.8, 14.0)
    pull = 0.9 * (1 if number % 2 else -1) if kind == "houses" else 0.0
    centre = plot.at(pull, PAVEMENT_M + GARDEN_M[kind] + depth / 2)
    return shapely.Polygon(rectangle(centre, plot.along, width - 2 * trim_m, depth - 2 * trim_m))


def driveways(built: list[Plot]) -> Bays:
    """Return the places for one or two cars in front of each house, nose to the wall."""
    rows = []
    for number, plot in enumerate(built):
        if plot.street.frontage == "terrace":
            continue
        outer = 2.6 if number % 2 else -2.6
        for shift in (outer, outer - np.sign(outer) * 2.6):
            place = plot.at(shift, PAVEMENT_M + 2.9)
            heading = heading_deg(plot.inward)
            rows.append((place[0], place[1], heading, "off_street", plot.street.name))
    return Bays.gather(rows)


def kerb_places(streets: list[Street]) -> Bays:
    """Return the places along the kerbs, clear of the carriageway; parallel to the street."""
    rows = []
    for street in streets:
        if street.frontage == "none":
            continue
        beside = 1.2 if street.frontage == "terrace" else 0.95
        pitch = 6.0 if street.frontage == "terrace" else 9.0
        for side in (1.0, -1.0):
            for at in np.arange(pitch / 2, length_m(street.points) - pitch / 2, pitch):
                place, along = frame(street.points, float(at))
                place = place + side * left_of(along) * (street.width_m / 2 + beside)
                rows.append((place[0], place[1], heading_deg(along), "on_street", street.name))
    return Bays.gather(rows)


def footprints(places: Bays) -> list[shapely.Polygon]:
    """Return the rectangle of a car on each place."""
    angle = np.radians(places.heading_deg)
    ahead = np.column_stack([np.sin(angle), np.cos(angle)])
    return [
        shapely.Polygon(rectangle(np.array([x, y]), way, CAR_LENGTH_M, CAR_WIDTH_M))
        for x, y, way in zip(places.x_m, places.y_m, ahead, strict=True)
    ]


def free_places(places: Bays, blocked: shapely.Geometry) -> Bays:
    """Return the places whose cars touch neither ``blocked`` nor an earlier place's car."""
    cars = footprints(places)
    shapely.prepare(blocked)
    tree = shapely.STRtree([car.buffer(0.15) for car in cars])
    kept: list[int] = []
    chosen: set[int] = set()
    for number, car in enumerate(cars):
        if blocked.intersects(car):
            continue
        if not chosen.intersection(tree.query(car, predicate="intersects").tolist()):
            chosen.add(number)
            kept.append(number)
    rows = [
        (places.x_m[n], places.y_m[n], places.heading_deg[n], places.site[n], places.group[n])
        for n in kept
    ]
    return Bays.gather(rows)

"""Anchors in SUMO's additional files: as points, or as cars parked beside the street."""

from __future__ import annotations

from xml.sax.saxutils import quoteattr

import numpy as np
import shapely

from covertool.model import Anchors, Floats
from covertool.traffic.edges import Edge, Network

ANCHORS_AS = ("points", "parked")
PARKED = "anchor."
"""What the ids of parked cars begin with in SUMO."""
_HALF_AREA_M = 2.5
_CAR_M = (5.0, 1.8)


def anchor_points(anchors: Anchors, network: Network) -> list[str]:
    """Return one POI for each anchor, which SUMO draws and its traffic never meets."""
    x, y = network.projection.to_net(anchors.x_m, anchors.y_m)
    return [
        f"<poi id={quoteattr(PARKED + str(name))} type={quoteattr(str(origin))} "
        f'color="0,0,0" layer="10" x="{east:.3f}" y="{north:.3f}"/>'
        for name, origin, east, north in zip(anchors.id, anchors.origin, x, y, strict=True)
    ]


def parked_cars(anchors: Anchors, network: Network, begin_s: float) -> tuple[list[str], list[str]]:
    """Return parking areas of one space each, and the vehicles that stand in them from the start.

    Each car stands at its anchor's place, parallel to the nearest street. SUMO turns a space by
    180 degrees minus the heading. Such cars change the traffic: they are an opt-in.
    """
    names = list(network.edges)
    tree = shapely.STRtree([shapely.LineString(network.edges[name].shape) for name in names])
    places = np.asarray(shapely.points(anchors.x_m, anchors.y_m), dtype=object)
    areas, cars = [], []
    for name, place, nearest in zip(anchors.id, places, tree.nearest(places), strict=True):
        id_ = quoteattr(PARKED + str(name))
        edge = network.edges[names[int(nearest)]]
        areas.append(_parking_area(id_, edge, tree.geometries[nearest], place, network))
        cars.append(
            f'<vehicle id={id_} type="parked" depart="{begin_s:.2f}" departPos="stop" '
            'insertionChecks="none">'
            f'<route edges={quoteattr(edge.id)}/><stop parkingArea={id_} duration="1000000"/>'
            "</vehicle>"
        )
    return areas, cars


def _parking_area(
    id_: str, edge: Edge, line: shapely.LineString, place: shapely.Point, network: Network
) -> str:
    """Return the parking area of one space in which a car stands at a place beside an edge."""
    along_m = float(line.project(place))
    heading = _heading(line, along_m)
    # SUMO puts the front bumper on the space; the anchor is the middle of the car.
    front_m = shapely.get_coordinates(place)[0] + heading * _CAR_M[0] / 2
    x, y = network.projection.to_net(front_m[:1], front_m[1:])
    at_m = along_m * edge.length_m / float(line.length)
    start_m = min(max(at_m - _HALF_AREA_M, 0.0), max(edge.length_m - 2 * _HALF_AREA_M, 0.0))
    end_m = min(start_m + 2 * _HALF_AREA_M, edge.length_m)
    angle = (180.0 - float(np.degrees(np.arctan2(*heading)))) % 360.0
    return (
        f'<parkingArea id={id_} lane="{edge.id}_{edge.lanes[0]}" startPos="{start_m:.2f}" '
        f'endPos="{end_m:.2f}" roadsideCapacity="0"><space x="{x[0]:.3f}" y="{y[0]:.3f}" '
        f'length="{_CAR_M[0]}" width="{_CAR_M[1]}" angle="{angle:.2f}"/></parkingArea>'
    )


def parked_type() -> str:
    """Return the vehicle type of parked cars."""
    return f'<vType id="parked" vClass="passenger" length="{_CAR_M[0]}" width="{_CAR_M[1]}"/>'


def _heading(line: shapely.LineString, along: float) -> Floats:
    """Return the direction (east, north) of a line at a place, one metre long."""
    at = min(along, float(line.length) - 0.1)
    ends = shapely.get_coordinates([line.interpolate(at), line.interpolate(at + 0.1)])
    step: Floats = (ends[1] - ends[0]) / float(np.hypot(*(ends[1] - ends[0])))
    return step

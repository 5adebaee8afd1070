"""The town as the layers of a study, in EPSG:2157."""

from __future__ import annotations

from itertools import pairwise

import geopandas as gpd
import numpy as np
import shapely
from pyproj import CRS

from covertool.model import Anchors, TransitArea, Vehicles
from data.recipe.carparks import Bays
from data.recipe.curves import distances, length_m
from data.recipe.parameters import CRS_CODE, ORIGIN_M, stream
from data.recipe.plots import CAR_WIDTH_M
from data.recipe.skeleton import Street
from data.recipe.town import Fabric

ITM = CRS.from_epsg(CRS_CODE)
_MAIN_KINDS = ("main", "arterial", "regional", "collector")
_FREE_FLOW_KMH = {"main": 30.0, "arterial": 50.0, "regional": 50.0, "collector": 45.0}
_SEGMENT_M = 220.0


def placed(geometry: shapely.Geometry) -> shapely.Geometry:
    """Return a geometry of the drawing at its place in EPSG:2157, on the centimetre grid."""
    moved = shapely.transform(geometry, lambda xy: np.round(xy + np.array(ORIGIN_M), 2))
    return moved if moved.is_valid else shapely.make_valid(moved)


def transit_area(fabric: Fabric) -> TransitArea:
    """Return the transit area of the town."""
    whole = shapely.union_all(placed(fabric.transit))
    parts = [part for part in shapely.get_parts(whole) if part.geom_type == "Polygon"]
    return TransitArea(shapely.MultiPolygon(parts), ITM)


def anchors(cars: Bays) -> Anchors:
    """Return the parked cars as anchors without a radius of their own."""
    x, y = np.round(cars.x_m + ORIGIN_M[0], 2), np.round(cars.y_m + ORIGIN_M[1], 2)
    return Anchors.from_points(x, y, ITM)


def vehicles(cars: Bays) -> Vehicles:
    """Return the parked cars as vehicles with size and heading; their score is 1."""
    rng = stream("car sizes")
    count = len(cars)
    points = anchors(cars)
    nothing = np.full(count, None, dtype=object)
    unseen = np.full(count, np.nan)
    return Vehicles(
        id=points.id,
        x_m=points.x_m,
        y_m=points.y_m,
        heading_deg=np.round(np.mod(cars.heading_deg, 180.0), 2),
        length_m=np.round(np.clip(rng.normal(4.3, 0.3, count), 3.5, 4.9), 2),
        width_m=np.round(np.clip(rng.normal(CAR_WIDTH_M, 0.07, count), 1.6, 2.0), 2),
        score=np.ones(count),
        site=np.array(cars.site, dtype=object),
        parked=np.full(count, True, dtype=object),
        image=nothing,
        image_x_px=unseen,
        image_y_px=unseen,
        crs=ITM,
    )


def streets(fabric: Fabric) -> gpd.GeoDataFrame:
    """Return the centre lines with name, class and carriageway width."""
    return gpd.GeoDataFrame(
        {
            "name": [street.name for street in fabric.streets],
            "kind": [street.kind for street in fabric.streets],
            "width_m": [street.width_m for street in fabric.streets],
        },
        geometry=[placed(street.line) for street in fabric.streets],
        crs=ITM,
    )


def buildings(fabric: Fabric) -> gpd.GeoDataFrame:
    """Return the buildings with their kind and height."""
    return gpd.GeoDataFrame(
        {
            "kind": [building.kind for building in fabric.buildings],
            "height_m": [round(building.height_m, 1) for building in fabric.buildings],
        },
        geometry=[placed(building.outline) for building in fabric.buildings],
        crs=ITM,
    )


def segments(fabric: Fabric) -> gpd.GeoDataFrame:
    """Return the main streets cut into directed segments, both ways, of about 220 m."""
    rows = []
    for street in fabric.streets:
        if street.kind in _MAIN_KINDS:
            rows += _segments_of(street)
    frame = gpd.GeoDataFrame(rows, geometry="geometry", crs=ITM)
    frame.insert(0, "segment_id", [f"S{number + 1:03d}" for number in range(len(frame))])
    return frame


def _segments_of(street: Street) -> list[dict[str, object]]:
    pieces = max(round(length_m(street.points) / _SEGMENT_M), 1)
    along = distances(street.points)
    cuts = np.searchsorted(along, np.linspace(0.0, along[-1], pieces + 1))
    cuts[-1] = len(street.points) - 1
    rows: list[dict[str, object]] = []
    for first, last in pairwise(cuts):
        line = placed(shapely.LineString(street.points[first : last + 1]))
        for geometry in (line, line.reverse()):
            rows.append(
                {
                    "name": street.name,
                    "kind": street.kind,
                    "length_m": round(float(geometry.length), 2),
                    "lanes": 1,
                    "free_flow_kmh": _FREE_FLOW_KMH[street.kind],
                    "geometry": geometry,
                }
            )
    return rows

"""Zones and areas of interest cut the transit area, not the anchors."""

import math

import numpy as np
import pytest
import shapely
from pyproj import CRS

from covertool.coverage.clip import clipped
from covertool.coverage.zones import clip_transit, zone_levels
from covertool.errors import GeometryError
from covertool.gis.zones import zones_by_name
from covertool.model import Anchors, TransitArea

ITM = CRS(2157)
ROAD = TransitArea(shapely.MultiPolygon([shapely.box(0, 0, 100, 100)]), ITM)
HALVES = {
    "east": np.array([shapely.box(50, 0, 100, 100)], dtype=object),
    "west": np.array([shapely.box(0, 0, 50, 100)], dtype=object),
}


def test_a_disc_on_the_border_of_two_zones_is_half_in_each():
    car = Anchors.from_points([50.0], [50.0], ITM)
    for zone in zone_levels(car, ROAD, HALVES, [20.0]):
        assert zone.coverage.areas_m2[1] == pytest.approx(math.pi * 200)
        assert zone.transit_area_m2 == pytest.approx(5000)


def test_an_anchor_outside_a_zone_reaches_in():
    car = Anchors.from_points([45.0], [50.0], ITM)
    east = zone_levels(car, ROAD, {"east": HALVES["east"]}, [10.0])[0]
    segment = 100 * math.acos(0.5) - 5 * math.sqrt(75)
    assert east.coverage.areas_m2[1] == pytest.approx(segment)
    assert east.coverage.anchors == 1


def test_a_zone_without_transit_area_has_no_fractions():
    car = Anchors.from_points([50.0], [50.0], ITM)
    far = {"sea": np.array([shapely.box(500, 500, 600, 600)], dtype=object)}
    (zone,) = zone_levels(car, ROAD, far, [10.0])
    assert zone.transit_area_m2 == 0
    assert all(math.isnan(share) for share in zone.coverage.fractions)


def test_rows_of_one_name_are_one_zone():
    shapes = np.array([shapely.box(i, 0, i + 1, 1) for i in range(3)], dtype=object)
    zones = zones_by_name(shapes, ["b", "a", "b"])
    assert {name: len(rows) for name, rows in zones.items()} == {"a": 1, "b": 2}


def test_numbered_zones_come_in_the_order_of_their_numbers():
    shapes = np.array([shapely.box(i, 0, i + 1, 1) for i in range(4)], dtype=object)
    assert list(zones_by_name(shapes, ["10", "sea", "9", "1"])) == ["1", "9", "10", "sea"]


def test_an_area_of_interest_elsewhere_is_told():
    with pytest.raises(GeometryError, match="area of interest"):
        clip_transit(ROAD, np.array([shapely.box(500, 500, 600, 600)], dtype=object))


def test_clipping_keeps_areas_and_drops_lines_that_only_touch():
    region = shapely.box(100, 0, 200, 100)
    assert clipped(ROAD.polygons, region).is_empty
    half = clipped(ROAD.polygons, shapely.box(-10, -10, 50, 200))
    assert half.area == pytest.approx(5000)
    assert half.is_valid

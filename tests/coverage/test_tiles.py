"""Tiles add up to the whole, whatever their size."""

from dataclasses import dataclass

import numpy as np
import pytest
import shapely
from pyproj import CRS

from covertool.coverage import coverage_levels
from covertool.coverage.tile_plan import ANCHORS_IN_TILE, plan_tiles, tile_size_m
from covertool.coverage.tiled import tiled_levels
from covertool.coverage.tiles import plan_job
from covertool.errors import ColumnError, CrsError
from covertool.model import Anchors, TransitArea

ITM = CRS(2157)


@dataclass(frozen=True)
class HeldAnchors:
    anchors: Anchors

    @property
    def crs(self):
        return self.anchors.crs

    @property
    def bounds(self):
        x, y = self.anchors.x_m, self.anchors.y_m
        return (x.min(), y.min(), x.max(), y.max())

    def read(self, bounds=None):
        x0, y0, x1, y1 = bounds or self.bounds
        x, y = self.anchors.x_m, self.anchors.y_m
        return self.anchors.take((x >= x0) & (x <= x1) & (y >= y0) & (y <= y1))


@dataclass(frozen=True)
class HeldTransit:
    transit: TransitArea

    @property
    def crs(self):
        return self.transit.crs

    @property
    def bounds(self):
        return self.transit.polygons.bounds

    def read(self, bounds=None):
        return self.transit


def town(seed=0, count=600):
    rng = np.random.default_rng(seed)
    x, y = 693_000 + rng.uniform(-200, 1200, count), 737_000 + rng.uniform(0, 800, count)
    lines = [
        shapely.LineString([(693_000, 737_000 + a), (694_000, 737_000 + b)])
        for a, b in rng.uniform(0, 800, (8, 2))
    ]
    roads = shapely.get_parts(shapely.union_all(shapely.buffer(lines, 5.0)))
    origin = np.where(rng.random(count) < 0.1, "queue", "parked").astype(object)
    anchors = Anchors.from_points(x, y, ITM)
    anchors = Anchors(**{**anchors.columns(), "origin": origin}, crs=ITM)
    return anchors, TransitArea(shapely.MultiPolygon(roads.tolist()), ITM)


def own_radii(anchors):
    radius = np.random.default_rng(9).uniform(5, 60, len(anchors))
    return Anchors(**{**anchors.columns(), "radius_m": radius}, crs=anchors.crs)


@pytest.mark.parametrize("tile_m", [90.0, 333.0, 5000.0])
def test_tiles_give_the_fractions_of_the_whole(tile_m):
    anchors, transit = town()
    anchors = own_radii(anchors)
    radii = [15.0, "B", None]
    whole = coverage_levels(anchors, transit, radii)
    job = plan_job(
        HeldAnchors(anchors), HeldTransit(transit), radii,
        anchors_count=len(anchors), largest_own_m=60.0, tile_m=tile_m,
    )  # fmt: skip
    tiled = tiled_levels(job)
    assert tiled.anchors == whole.anchors
    assert tiled.transit_area_m2 == pytest.approx(whole.transit_area_m2, rel=1e-12)
    assert len(tiled.results) == len(whole.results) == 9
    for one, other in zip(whole.results, tiled.results, strict=True):
        assert other.fractions == pytest.approx(one.fractions, abs=1e-12)
        assert (other.radius_m, other.device_class) == (one.radius_m, one.device_class)
        assert (other.origin, other.anchors) == (one.origin, one.anchors)


def test_an_anchor_in_the_next_tile_is_heard():
    transit = TransitArea(shapely.MultiPolygon([shapely.box(0, 0, 100, 10)]), ITM)
    anchors = Anchors.from_points([100.0 - 1e-9, 105.0], [5.0, 5.0], ITM)
    job = plan_job(HeldAnchors(anchors), HeldTransit(transit), [20.0], anchors_count=2, tile_m=50.0)
    (whole,) = coverage_levels(anchors, transit, [20.0]).results
    (tiled,) = tiled_levels(job).results
    assert tiled.areas_m2 == pytest.approx(whole.areas_m2, abs=1e-9)


def test_an_anchor_on_a_corner_of_four_tiles_is_counted_once():
    transit = TransitArea(shapely.MultiPolygon([shapely.box(0, 0, 20, 20)]), ITM)
    anchors = Anchors.from_points([10.0], [10.0], ITM)
    job = plan_job(HeldAnchors(anchors), HeldTransit(transit), [3.0], anchors_count=1, tile_m=10.0)
    assert len(job.plan) == 9
    assert tiled_levels(job).anchors == 1


def test_tiles_cover_the_bounds_and_do_not_overlap():
    plan = plan_tiles((0.0, 0.0, 100.0, 30.0), 40.0)
    squares = [shapely.box(*plan.square(tile)) for tile in range(len(plan))]
    assert shapely.union_all(squares).area == pytest.approx(sum(s.area for s in squares))
    assert shapely.union_all(squares).covers(shapely.box(0, 0, 100, 30))


@pytest.mark.parametrize("share", [1, 1.2, 1.5, 1.7, 2.3, 5, 10, 47, 50, 51])
@pytest.mark.parametrize("height", [1.0, 0.3])
def test_a_tile_holds_a_bounded_number_of_anchors_and_none_is_a_sliver(share, height):
    bounds = (0.0, 0.0, 1e5, height * 1e5)
    side = tile_size_m(bounds, int(share * ANCHORS_IN_TILE), 15.0)
    held = share * ANCHORS_IN_TILE * side**2 / (height * 1e10)
    assert held <= 1.25**2 * ANCHORS_IN_TILE or share == 1
    columns = plan_tiles(bounds, side).columns
    assert columns * side == pytest.approx(1e5)


def test_a_tile_is_not_mostly_halo():
    assert tile_size_m((0.0, 0.0, 1e3, 1e3), 10**9, 1000.0) == 2000.0


def test_own_radii_that_are_missing_are_told():
    anchors, transit = town()
    job = plan_job(HeldAnchors(anchors), HeldTransit(transit), [None], anchors_count=600)
    with pytest.raises(ColumnError):
        tiled_levels(job)


def test_two_crss_are_refused():
    anchors, transit = town()
    other = TransitArea(transit.polygons, CRS(32629))
    with pytest.raises(CrsError, match="convert"):
        plan_job(HeldAnchors(anchors), HeldTransit(other), [15.0], anchors_count=600)

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import CRS

from covertool.coverage import level_areas, level_regions
from covertool.errors import OptionError
from covertool.model import Anchors, TransitArea

ITM = CRS(2157)
STREETS = shapely.union_all(
    [shapely.box(20 * i, 0, 20 * i + 8, 200) for i in range(10)]
    + [shapely.box(0, 20 * i, 200, 20 * i + 8) for i in range(10)]
)


def regions(x, y, radius, polygons=STREETS, **options):
    transit = TransitArea(shapely.MultiPolygon(shapely.get_parts(polygons).tolist()), ITM)
    return level_regions(Anchors.from_points(x, y, ITM), transit, radius, **options)


def check(x, y, radius, polygons=STREETS, tolerance_m=0.01):
    found = regions(x, y, radius, polygons, chord_tolerance_m=tolerance_m)
    exact = level_areas(x, y, radius, polygons)
    allowed = tolerance_m * (sum(exact.boundary_m) + 1e-6)
    for level, region in found.items():
        assert region.is_valid
        assert abs(region.area - exact.areas_m2[level]) <= allowed
        assert shapely.difference(region, polygons).area <= 1e-6
    for one, other in [(1, 2), (1, 3), (2, 3)]:
        assert shapely.intersection(found[one], found[other]).area <= 1e-3 * allowed
    return found


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("radius", [4.0, 15.0, 40.0])
def test_regions_are_valid_disjoint_and_as_large_as_the_exact_areas(radius, seed):
    x, y = np.random.default_rng(seed).uniform(-10, 210, (2, 150))
    check(x, y, radius)


@pytest.mark.parametrize("tolerance_m", [0.001, 0.1, 1.0])
def test_a_coarser_tolerance_gives_fewer_vertices_and_the_same_area(tolerance_m):
    x, y = np.random.default_rng(7).uniform(0, 200, (2, 60))
    check(x, y, 15.0, tolerance_m=tolerance_m)


@pytest.mark.parametrize("radius", [5.0, 10.0, 7.07])
def test_a_lattice_with_exact_ties_gives_valid_regions(radius):
    x, y = (a.ravel() * 10.0 for a in np.meshgrid(np.arange(12), np.arange(12)))
    check(x, y, radius, shapely.box(-8.5, -9.5, 111.5, 93.5))


def test_snapped_and_repeated_anchors_give_valid_regions():
    x, y = np.round(np.random.default_rng(3).uniform(0, 200, (2, 400)) / 5) * 5
    check(x, y, 15.0)


places = st.lists(
    st.tuples(
        st.floats(0, 200).map(lambda v: round(v, 2)), st.floats(0, 200).map(lambda v: round(v, 2))
    ),
    min_size=1,
    max_size=30,
)


@settings(max_examples=30, deadline=None)
@given(places, st.sampled_from([4.0, 8.0, 20.0, 55.5]))
def test_any_anchors_give_valid_regions_of_the_exact_area(at, radius):
    check(*np.transpose(at), radius)


def test_a_ring_of_discs_leaves_a_hole():
    turn = 2 * math.pi * np.arange(12) / 12
    x, y = 40 * np.cos(turn), 40 * np.sin(turn)
    found = check(x, y, 14.0, shapely.box(-80, -80, 80, 80))
    covered = shapely.union_all(list(found.values()))
    assert len(covered.interiors) == 1


def test_a_place_knows_how_many_anchors_hear_it():
    x, y = np.random.default_rng(11).uniform(0, 200, (2, 120))
    found = regions(x, y, 20.0)
    places = np.random.default_rng(12).uniform(0, 200, (4000, 2))
    distance = np.hypot(places[:, :1] - x, places[:, 1:] - y)
    sure = (np.abs(distance - 20.0) > 0.05).all(axis=1)
    sure &= shapely.distance(STREETS.boundary, shapely.points(places)) > 0.01
    inside = shapely.contains_xy(STREETS, places)
    depth = np.minimum((distance < 20.0).sum(axis=1), 3)
    for level, region in found.items():
        held = shapely.contains_xy(region, places)
        assert np.array_equal(held[sure], (inside & (depth == level))[sure])


def test_nothing_to_cover_gives_empty_regions():
    assert all(r.is_empty for r in regions([], [], 15.0).values())
    assert all(r.is_empty for r in regions([0.0], [0.0], 15.0, shapely.MultiPolygon()).values())


def test_a_tolerance_that_is_not_positive_is_refused():
    with pytest.raises(OptionError, match="tolerance"):
        regions([0.0], [0.0], 15.0, chord_tolerance_m=0.0)

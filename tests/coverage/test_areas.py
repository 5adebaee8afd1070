"""The engine against the slow reference, against polygons, and against itself when moved."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from covertool.coverage import level_areas
from covertool.coverage.areas import CLOSURE_LIMIT_M, add_boundaries
from covertool.errors import ComputationError

from .reference import reference_level_areas

SHAPE = shapely.MultiPolygon(
    [
        shapely.Polygon([(0, 0), (40, 5), (35, 40), (10, 30)], [[(10, 10), (20, 10), (20, 20)]]),
        shapely.Polygon([(40, 5), (60, 0), (50, 20)]),
    ]
)


def random_discs(seed, n, snap=0.0, radii=(2.0, 12.0)):
    random = np.random.default_rng(seed)
    x, y = random.uniform(-5, 60, n), random.uniform(-5, 45, n)
    if snap:
        x, y = np.round(x / snap) * snap, np.round(y / snap) * snap
    return x, y, random.uniform(*radii, n), random.integers(1, 4, n)


def agree(x, y, radius, weights, polygons=SHAPE, absolute=1e-9):
    found = level_areas(x, y, radius, polygons, weights=weights)
    areas, lengths = reference_level_areas(x, y, radius, polygons, weights)
    assert found.areas_m2 == pytest.approx(areas, rel=1e-11, abs=absolute)
    assert found.boundary_m == pytest.approx(lengths, rel=1e-9, abs=1e-5)
    assert found.closure_m < 1e-9


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("n", [1, 4, 16, 60])
def test_random_discs_agree_with_the_reference(n, seed):
    agree(*random_discs(seed, n))


@pytest.mark.parametrize("radius", [0.5, 3.0, 10.0, 35.0, 90.0])
def test_discs_of_one_radius_agree_with_the_reference(radius):
    x, y, _, _ = random_discs(3, 80)
    agree(x, y, np.full(80, radius), np.ones(80))


@pytest.mark.parametrize("snap", [0.25, 0.5, 1.0, 5.0])
@pytest.mark.parametrize("radius", [5.0, 7.5, 10.0])
def test_snapped_coordinates_agree_with_the_reference(radius, snap):
    x, y, _, _ = random_discs(9, 70, snap)
    block = shapely.box(0, 0, 50, 40).difference(shapely.box(10, 10, 20, 20))
    agree(x, y, np.full(70, radius), np.ones(70), block, absolute=1e-7)


@pytest.mark.parametrize("shift", [1e-3, 1e-6, 1e-9, 1e-12])
def test_near_duplicates_agree_with_the_reference(shift):
    random = np.random.default_rng(4)
    x, y, radius, weights = random_discs(4, 20)
    x = np.concatenate([x, x + shift * random.normal(size=20)])
    y = np.concatenate([y, y + shift * random.normal(size=20)])
    agree(x, y, np.tile(radius, 2), np.tile(weights, 2), absolute=1e-7)


@pytest.mark.parametrize("origin", [(7e5, 7.5e5), (-1e7, 1e7)])
def test_snapped_and_nearly_equal_discs_far_from_the_origin_agree_with_the_reference(origin):
    # Steps of a quarter metre and of 1e-6 m survive the rounding of such coordinates.
    random = np.random.default_rng(14)
    x, y, radius, weights = random_discs(14, 30, 0.25)
    x = np.concatenate([x, x + 1e-6 * random.normal(size=30)]) + origin[0]
    y = np.concatenate([y, y + 1e-6 * random.normal(size=30)]) + origin[1]
    radius = np.tile(np.round(radius * 2) / 2, 2)
    moved = shapely.transform(SHAPE, lambda p: p + np.array(origin))
    agree(x, y, radius, np.tile(weights, 2), moved, absolute=1e-6)


@pytest.mark.parametrize("radius", [5.0, 7.5, 30.0])
def test_edges_on_the_lines_of_a_lattice_of_discs_agree_with_the_reference(radius):
    # Every vertex lies on several circles or on the line between two centres.
    x, y = (a.ravel() * 5.0 for a in np.meshgrid(np.arange(9), np.arange(9)))
    comb = shapely.union_all([shapely.box(10 * i, 0, 10 * i + 5, 40) for i in range(4)])
    agree(x, y, np.full(81, radius), np.ones(81), comb, absolute=1e-7)


def test_five_thousand_near_duplicates_are_one_place_of_level_3():
    random = np.random.default_rng(6)
    x, y = 1e-6 * random.normal(size=(2, 5000))
    found = level_areas(x, y, 10.0, shapely.box(-20, -20, 20, 20))
    assert found.areas_m2[3] == pytest.approx(math.pi * 100, rel=1e-5)
    assert found.closure_m < 1e-9


def test_discs_of_many_sizes_agree_with_the_reference():
    x, y, _, weights = random_discs(8, 60)
    agree(x, y, np.geomspace(0.05, 90, 60), weights)


@pytest.mark.parametrize("seed", range(6))
def test_random_discs_agree_with_polygons_of_1024_sides(seed):
    x, y, radius, _ = random_discs(100 + seed, 12)
    turn = 2 * np.pi * np.arange(1024) / 1024
    # A polygon of the disc's own area.
    size = radius * np.sqrt(2 * np.pi / (1024 * np.sin(2 * np.pi / 1024)))
    discs = [
        shapely.Polygon(np.column_stack([a + s * np.cos(turn), b + s * np.sin(turn)]))
        for a, b, s in zip(x, y, size, strict=True)
    ]
    lines = shapely.union_all([shapely.boundary(g) for g in [*discs, SHAPE]])
    expected = np.zeros(4)
    for face in shapely.polygonize([lines]).geoms:
        inner = face.point_on_surface()
        if SHAPE.contains(inner):
            expected[min(3, sum(disc.contains(inner) for disc in discs))] += face.area
    found = level_areas(x, y, radius, SHAPE).areas_m2
    assert found == pytest.approx(expected, rel=1e-4, abs=0.02)


points = st.lists(
    st.tuples(
        st.floats(-10, 70).map(lambda v: round(v, 3)),
        st.floats(-10, 50).map(lambda v: round(v, 3)),
        st.floats(0.1, 40).map(lambda v: round(v, 2)),
    ),
    min_size=1,
    max_size=25,
)


@settings(max_examples=60, deadline=None)
@given(points, st.randoms(use_true_random=False))
def test_the_order_of_anchors_does_not_matter(discs, random):
    shuffled = list(discs)
    random.shuffle(shuffled)
    one, other = (level_areas(*np.transpose(d), SHAPE).areas_m2 for d in (discs, shuffled))
    assert one == pytest.approx(other, rel=1e-11, abs=1e-8)


@settings(max_examples=60, deadline=None)
@given(points, st.floats(-1e6, 1e6), st.floats(-1e6, 1e6))
def test_a_move_changes_no_area(discs, east, north):
    east, north = round(east, 2), round(north, 2)
    x, y, r = np.transpose(discs)
    moved = shapely.transform(SHAPE, lambda p: p + np.array([east, north]))
    one = level_areas(x, y, r, SHAPE).areas_m2
    assert level_areas(x + east, y + north, r, moved).areas_m2 == pytest.approx(one, abs=1e-6)


@settings(max_examples=60, deadline=None)
@given(points, st.floats(0, 2 * math.pi))
def test_a_turn_changes_no_area(discs, angle):
    x, y, r = np.transpose(discs)
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    turned = shapely.transform(SHAPE, lambda p: p @ turn)
    x2, y2 = (np.column_stack([x, y]) @ turn).T
    one = level_areas(x, y, r, SHAPE).areas_m2
    assert level_areas(x2, y2, r, turned).areas_m2 == pytest.approx(one, abs=1e-6)


@settings(max_examples=60, deadline=None)
@given(points, st.floats(0.01, 5))
def test_larger_radii_and_more_anchors_never_cover_less(discs, more):
    x, y, r = np.transpose(discs)
    small, large = level_areas(x, y, r, SHAPE), level_areas(x, y, r + more, SHAPE)
    fewer = level_areas(x[1:], y[1:], r[1:], SHAPE)
    for level in (1, 2, 3):
        at_least = sum(small.areas_m2[level:])
        assert sum(large.areas_m2[level:]) >= at_least - 1e-8
        assert sum(fewer.areas_m2[level:]) <= at_least + 1e-8


@settings(max_examples=40, deadline=None)
@given(points)
def test_any_discs_agree_with_the_reference(discs):
    x, y, r = np.transpose(discs)
    agree(x, y, r, np.ones(x.size), absolute=1e-7)


def test_the_closure_residual_speaks_when_polygons_overlap():
    overlapping = shapely.MultiPolygon([shapely.box(0, 0, 10, 10), shapely.box(5, 5, 15, 15)])
    with pytest.raises(ComputationError, match="stay open by"):
        level_areas([7.5, 3.0], [7.5, 2.0], 8.0, overlapping)


def test_the_closure_residual_speaks_when_one_boundary_piece_is_lost_or_moved():
    sums = np.zeros((3, 4))
    square = [(0, 0, 4, 0), (4, 0, 4, 4), (4, 4, 0, 4), (0, 4, 0, 0)]
    rows = np.array([[*edge, 0.0, 0.0, 1.0, -1.0] for edge in square], dtype=float)
    add_boundaries(rows, sums)
    assert sums[0].tolist() == [16.0, 0.0, 0.0, 0.0]
    for broken in (rows[:3], rows + 1e-3 * (np.arange(4) == 2)[:, None] * np.eye(8)[3]):
        sums = np.zeros((3, 4))
        add_boundaries(np.ascontiguousarray(broken), sums)
        assert np.hypot(*sums[0, 2:]) > CLOSURE_LIMIT_M

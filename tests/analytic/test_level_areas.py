"""Areas whose answer can be worked out by hand."""

import itertools
import math

import numpy as np
import pytest
import shapely
from numba import config
from pyproj import CRS

from covertool.coverage import LevelAreas, coverage_levels, level_areas
from covertool.coverage.areas import add_boundaries
from covertool.errors import ColumnError, ComputationError, CrsError, GeometryError, OptionError
from covertool.model import Anchors, TransitArea

WIDE = shapely.box(-100, -90, 110, 95)
ORIGINS = [(0.0, 0.0), (7e5, 7.5e5), (-1e7, 1e7)]


def areas(x, y, radius, polygons=WIDE, **options):
    found = level_areas(x, y, radius, polygons, **options)
    assert found.closure_m < 1e-9
    assert sum(found.areas_m2) == pytest.approx(polygons.area, rel=1e-11)
    assert min(found.areas_m2) >= 0.0
    return found.areas_m2


def lens(d, r):
    return 2 * r * r * math.acos(d / (2 * r)) - d / 2 * math.sqrt(4 * r * r - d * d)


@pytest.mark.parametrize("radius", [1e-3, 0.7, 15.0, 88.0])
def test_a_disc_has_area_pi_r_squared(radius):
    assert areas([0.3], [0.1], radius)[1] == pytest.approx(math.pi * radius**2, rel=1e-12)


def test_a_disc_on_a_transit_edge_counts_half_and_on_a_corner_a_quarter():
    square = shapely.box(0, 0, 40, 40)
    assert areas([20.0], [0.0], 15.0, square)[1] == pytest.approx(math.pi * 225 / 2, rel=1e-12)
    assert areas([40.0], [40.0], 15.0, square)[1] == pytest.approx(math.pi * 225 / 4, rel=1e-12)


@pytest.mark.parametrize("d", [1e-6, 0.5, 10.0, 29.0, 30 - 1e-6])
def test_two_discs_share_a_lens(d):
    levels = areas([0.0, d], [0.0, 0.0], 15.0)
    assert levels[2] == pytest.approx(lens(d, 15.0), rel=1e-9, abs=1e-9)
    assert levels[1] + 2 * levels[2] == pytest.approx(2 * math.pi * 225, rel=1e-12)


def test_three_discs_on_a_triangle_share_a_reuleaux_triangle():
    x, y = [0.0, 10.0, 5.0], [0.0, 0.0, 10 * math.sqrt(3) / 2]
    expected = (math.pi - math.sqrt(3)) / 2 * 100
    assert areas(x, y, 10.0)[3] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("n", [2, 3, 7, 12])
def test_discs_in_line_overlap_their_neighbours_and_no_others(n):
    # A distance of 1.2 radii: next neighbours overlap, the ones after do not.
    levels = areas(6.0 * np.arange(n), np.zeros(n), 5.0)
    assert levels[2] == pytest.approx((n - 1) * lens(6.0, 5.0), rel=1e-12)
    assert levels[3] == 0
    assert levels[1] == pytest.approx(n * math.pi * 25 - 2 * (n - 1) * lens(6.0, 5.0), rel=1e-12)


@pytest.mark.parametrize(("n", "level"), [(1, 1), (2, 2), (3, 3), (5000, 3)])
def test_identical_discs_count_as_many(n, level):
    levels = areas(np.full(n, 1.7), np.full(n, 2.9), 10.0)
    assert levels[level] == pytest.approx(math.pi * 100, rel=1e-12)
    assert sum(levels[1:]) == pytest.approx(math.pi * 100, rel=1e-12)


@pytest.mark.parametrize("weight", [1, 2, 3, 9])
def test_a_weight_counts_as_so_many_anchors(weight):
    levels = areas([0.0, 12.0], [0.0, 0.0], 10.0, weights=[weight, 1])
    shared, alone = lens(12.0, 10.0), math.pi * 100 - lens(12.0, 10.0)
    expected = np.zeros(4)
    for level, area in [(weight, alone), (1, alone), (weight + 1, shared)]:
        expected[min(level, 3)] += area
    assert levels[1:] == pytest.approx(expected[1:], rel=1e-12)


@pytest.mark.parametrize("turn", [0.0, 0.3, math.pi / 4, 2.0])
def test_two_discs_that_touch_from_outside_share_no_area(turn):
    levels = areas([0, 20 * math.cos(turn)], [0, 20 * math.sin(turn)], [12.0, 8.0])
    assert levels[2] == pytest.approx(0, abs=1e-10)
    assert levels[1] == pytest.approx(math.pi * (144 + 64), rel=1e-12)


@pytest.mark.parametrize("turn", [0.0, 0.3, math.pi / 4, 2.0])
def test_a_disc_that_touches_a_larger_one_from_inside_lies_in_it(turn):
    levels = areas([0, 4 * math.cos(turn)], [0, 4 * math.sin(turn)], [12.0, 8.0])
    assert levels[2] == pytest.approx(math.pi * 64, rel=1e-11)
    assert levels[1] == pytest.approx(math.pi * (144 - 64), rel=1e-11)


def test_concentric_discs_are_rings():
    levels = areas([1.0] * 4, [2.0] * 4, [10.0, 8.0, 5.0, 3.0])
    assert levels[1:] == pytest.approx([math.pi * 36, math.pi * 39, math.pi * 25], rel=1e-12)


def test_the_inscribed_circle_leaves_the_corners_of_the_square():
    assert areas([5.0], [5.0], 5.0, shapely.box(0, 0, 10, 10))[0] == pytest.approx(
        100 - 25 * math.pi, rel=1e-12
    )


@pytest.mark.parametrize("sides", [4, 6, 7, 64])
def test_the_circumscribed_circle_covers_all_of_a_polygon(sides):
    turn = 2 * math.pi * np.arange(sides) / sides + 0.1
    polygon = shapely.Polygon(np.column_stack([7 * np.cos(turn), 7 * np.sin(turn)]))
    assert areas([0.0], [0.0], 7.0, polygon)[0] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("sides", [3, 4, 6, 7, 64, 2000])
def test_the_inscribed_circle_of_a_polygon_lies_in_it(sides):
    turn = 2 * math.pi * np.arange(sides) / sides + 0.1
    outer = 7 / math.cos(math.pi / sides)
    polygon = shapely.Polygon(np.column_stack([outer * np.cos(turn), outer * np.sin(turn)]))
    assert areas([0.0], [0.0], 7.0, polygon)[1] == pytest.approx(49 * math.pi, rel=1e-11)


def test_a_cell_may_hold_more_edges_than_the_working_space_first_does():
    # A far square keeps the cells wide, so that the polygon lies in a few of them.
    turn = 2 * np.pi * np.arange(8000) / 8000
    polygon = shapely.Polygon(0.5 * np.column_stack([np.cos(turn), np.sin(turn)]))
    far = shapely.box(1000, 1000, 1001, 1001)
    # The circle through the middles of the polygon's sides.
    radius = 0.5 * math.cos(math.pi / 8000)
    levels = areas([0.0], [0.0], radius, shapely.MultiPolygon([polygon, far]))
    assert levels[1] == pytest.approx(math.pi * radius**2, rel=1e-9)
    assert levels[0] == pytest.approx(far.area + polygon.area - math.pi * radius**2, abs=1e-9)


def rosette(n):
    """Return the areas of Levels 0 to 3 of n circles of 10 m through one point, in WIDE.

    In the direction phi off its centre a disc reaches 20 cos(phi) metres from that point; at
    least k discs hear what the k-th nearest in direction reaches.
    """

    def sector(phi):  # the integral of (20 cos phi)^2 / 2
        return 100.0 * (phi + 0.5 * math.sin(2 * phi))

    steps = [sector(k * math.pi / n) for k in range(4)]
    at_least = [WIDE.area, *(2 * n * (steps[k] - steps[k - 1]) for k in (1, 2, 3)), 0.0]
    return [at_least[k] - at_least[k + 1] for k in range(4)]


def centres_of_rosette(n):
    turn = 2 * np.pi * np.arange(n) / n
    return 10 * np.cos(turn) + 1.0, 10 * np.sin(turn) - 2.0


@pytest.mark.parametrize("n", [6, 7, 60])
def test_many_circles_may_meet_in_one_point(n):
    assert areas(*centres_of_rosette(n), 10.0) == pytest.approx(rosette(n), abs=1e-8)


@pytest.mark.skipif(bool(config.DISABLE_JIT), reason="takes minutes where nothing is compiled")
def test_a_cell_may_hold_more_circles_than_the_working_space_first_does():
    assert areas(*centres_of_rosette(2100), 10.0) == pytest.approx(rosette(2100), abs=1e-8)


def test_a_cell_may_hold_more_crossings_than_the_working_space_first_does():
    ends = [-90.0, *np.linspace(-2.5, -1.5, 41), 95.0]
    strips = [shapely.box(-100, low, 110, high) for low, high in itertools.pairwise(ends)]
    cut = areas(*centres_of_rosette(60), 10.0, shapely.MultiPolygon(strips))
    assert cut == pytest.approx(rosette(60), abs=1e-8)


def test_a_disc_in_a_hole_of_the_transit_area_covers_nothing():
    ring = shapely.box(-50, -50, 50, 50).difference(shapely.box(-20, -20, 20, 20))
    assert areas([0.0], [0.0], 15.0, ring)[1:] == (0, 0, 0)
    assert areas([0.0], [0.0], 20.0, ring)[1:] == pytest.approx((0, 0, 0), abs=1e-10)
    corners = 4 * (math.acos(20 / 25) * 625 - 20 * 15)
    assert areas([0.0], [0.0], 25.0, ring)[1] == pytest.approx(corners, rel=1e-12)


def test_a_transit_area_cut_in_halves_has_the_levels_of_the_whole():
    random = np.random.default_rng(5)
    x, y = random.uniform(-60, 60, (2, 40))
    left, right = shapely.box(-50, -40, 3.3, 40), shapely.box(3.3, -40, 50, 40)
    whole = areas(x, y, 14.0, shapely.box(-50, -40, 50, 40))
    parts = np.add(areas(x, y, 14.0, left), areas(x, y, 14.0, right))
    assert parts == pytest.approx(whole, rel=1e-11)


def test_four_quarter_discs_at_the_corners_of_a_unit_square():
    # r = 1: Level 4 is the rounded square 1 - sqrt 3 + pi / 3 in the middle.
    x, y = [0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0]
    all_four = 1 - math.sqrt(3) + math.pi / 3
    exactly_two = 4 * (1 - math.sqrt(3) / 4 - math.pi / 6)
    levels = areas(x, y, 1.0, shapely.box(0, 0, 1, 1))
    assert levels[2] == pytest.approx(exactly_two, rel=1e-12)
    assert levels[3] == pytest.approx(1 - exactly_two, rel=1e-12)
    assert levels[3] > all_four
    half = areas(x, y, 0.5, shapely.box(0, 0, 1, 1))
    assert half == pytest.approx((1 - math.pi / 4, math.pi / 4, 0, 0), abs=1e-12)


@pytest.mark.parametrize("origin", ORIGINS)
@pytest.mark.parametrize("radius", [10.0, 7.07, 5 * math.sqrt(2), 5.0])
def test_a_lattice_with_exact_ties_is_its_cell_many_times(radius, origin):
    # One 10 m cell in the middle of the lattice, by the inclusion of its four corners alone.
    at = np.arange(-6.0, 7.0) * 10
    x, y = (a.ravel() for a in np.meshgrid(at, at))
    block = shapely.box(origin[0] - 20, origin[1] - 20, origin[0] + 20, origin[1] + 20)
    levels = np.array(areas(x + origin[0], y + origin[1], radius, block)) / 16
    pairs = lens(10.0, radius)
    if radius <= 5 * math.sqrt(2):
        # Discs overlap only their four neighbours, and two lenses meet in at most a point.
        expected = [100 - math.pi * radius**2 + 2 * pairs, math.pi * radius**2 - 4 * pairs]
        assert levels == pytest.approx([*expected, 2 * pairs, 0], rel=1e-9, abs=1e-7)
    else:
        exactly_two = 4 * (1 - math.sqrt(3) / 4 - math.pi / 6) * 100
        assert levels == pytest.approx([0, 0, exactly_two, 100 - exactly_two], abs=1e-7)


@pytest.mark.parametrize("origin", ORIGINS)
def test_far_from_the_origin_of_the_crs_a_disc_is_as_exact(origin):
    x, y = origin
    square = shapely.box(x - 50, y - 50, x + 50, y + 50)
    levels = areas([x, x + 12.0], [y, y], 15.0, square)
    assert levels[2] == pytest.approx(lens(12.0, 15.0), rel=1e-11)


def test_slopes_are_the_lengths_of_the_arcs():
    found = level_areas([0.0, 12.0], [0.0, 0.0], 15.0, WIDE)
    inner = 2 * 15 * 2 * math.acos(6 / 15)
    outer = 2 * 2 * math.pi * 15 - inner
    assert found.boundary_m == pytest.approx((outer, inner, 0), rel=1e-12)


def test_a_field_at_random_follows_the_poisson_law():
    # Depth over a point is Poisson of mean density * pi r^2; means over many discs come near it.
    random = np.random.default_rng(20)
    side, radius, n = 1000.0, 15.0, 2000
    x, y = random.uniform(-50, side + 50, (2, int(n * (1 + 100 / side) ** 2)))
    fractions = np.array(areas(x, y, radius, shapely.box(0, 0, side, side))) / side**2
    mean = n / side**2 * math.pi * radius**2
    none, one = math.exp(-mean), mean * math.exp(-mean)
    expected = [none, one, one * mean / 2, 1 - none - one - one * mean / 2]
    assert fractions == pytest.approx(expected, abs=0.012)


def test_no_anchors_leave_everything_at_level_0():
    assert level_areas([], [], 15.0, WIDE) == LevelAreas((WIDE.area, 0, 0, 0), (0, 0, 0), 0)


def test_nowhere_to_drive_has_no_boundary():
    nowhere = level_areas([0.0], [0.0], 15.0, shapely.MultiPolygon())
    assert nowhere == LevelAreas((0, 0, 0, 0), (0, 0, 0), 0)


def test_a_chord_and_an_arc_that_do_not_close_are_told_by_level_and_direction():
    """A chord of level 1 from (1, 2) to (4, 6); a quarter of a circle of 5 m of levels 2 and 3."""
    rows, sums = np.zeros((2, 8)), np.zeros((3, 4))
    rows[0, :7] = 1.0, 2.0, 4.0, 6.0, 0.0, 0.0, 1.0
    rows[1, :7] = 5.0, 0.0, 0.0, 5.0, 5.0, 1.0, 3.0
    add_boundaries(rows, sums)
    quarter = [25 * math.pi / 4, 5 * math.pi / 2, -5.0, 5.0]
    np.testing.assert_allclose(sums, [[-1.0, 0.0, 3.0, 4.0], quarter, quarter], atol=1e-12)


def test_an_empty_transit_area_has_no_areas_and_no_fractions():
    nothing = TransitArea(shapely.MultiPolygon(), CRS(2157))
    report = coverage_levels(Anchors.from_points([0.0], [0.0], CRS(2157)), nothing, [15.0])
    assert report.results[0].areas_m2 == (0, 0, 0, 0)
    assert all(math.isnan(f) for f in report.results[0].fractions)


@pytest.mark.parametrize(("overlap_m", "is_told"), [(0.1, True), (1e-5, True), (1e-8, False)])
def test_polygons_that_overlap_leave_boundaries_open_which_is_told_above_a_micrometre(
    overlap_m, is_told
):
    overlapping = shapely.MultiPolygon(
        [shapely.box(0, 0, 50, 40), shapely.box(50 - overlap_m, 0, 90, 40)]
    )
    discs = [48.0, 50.0, 53.0], [20.0, 22.0, 21.0], 7.0
    if is_told:
        with pytest.raises(ComputationError, match="stay open"):
            level_areas(*discs, overlapping)
    else:
        assert 0.0 < level_areas(*discs, overlapping).closure_m < 1e-6


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_coordinates_that_are_not_finite_are_refused(bad):
    with pytest.raises(GeometryError, match="row 2"):
        level_areas([0.0, bad], [0.0, 0.0], 15.0, WIDE)


@pytest.mark.parametrize("radius", [0.0, -1.0, math.nan, math.inf])
def test_radii_that_are_not_positive_are_refused(radius):
    with pytest.raises(GeometryError, match="above 0 m"):
        level_areas([0.0], [0.0], radius, WIDE)
    with pytest.raises(OptionError):
        coverage_levels(_anchors(), _transit(), [radius])


def test_overlapping_transit_polygons_are_refused_or_closed():
    with pytest.raises(GeometryError):
        TransitArea(
            shapely.MultiPolygon([shapely.box(0, 0, 2, 2), shapely.box(1, 1, 3, 3)]), CRS(2157)
        )


def _anchors(**columns):
    base = Anchors.from_points([0.0, 30.0, 60.0], [0.0, 0.0, 0.0], CRS(2157))
    values = {name: np.array(column, dtype=object) for name, column in columns.items()}
    if "radius_m" in values:
        values["radius_m"] = values["radius_m"].astype(float)
    return Anchors(**{**base.columns(), **values}, crs=base.crs)


def _transit():
    return TransitArea(shapely.MultiPolygon([shapely.box(-200, -200, 300, 200)]), CRS(2157))


def test_a_class_is_reported_by_its_name_and_radius():
    result = coverage_levels(_anchors(), _transit(), ["A"]).results[0]
    assert (result.device_class, result.radius_m) == ("A", 15.0)
    assert result.areas_m2[1] == pytest.approx(3 * math.pi * 225, rel=1e-12)


def test_own_radii_and_classes_may_be_mixed():
    anchors = _anchors(radius_m=[5.0, np.nan, np.nan], device_class=[None, "A", "a"])
    result = coverage_levels(anchors, _transit(), [None]).results[0]
    assert (result.device_class, result.radius_m) == (None, None)
    covered = result.areas_m2[1] + 2 * result.areas_m2[2]
    assert covered == pytest.approx(math.pi * (25 + 2 * 225), rel=1e-12)


def test_own_radii_that_agree_are_reported_as_one():
    same = _anchors(device_class=["B", "B", "B"])
    result = coverage_levels(same, _transit(), [None]).results[0]
    assert (result.device_class, result.radius_m) == ("B", 100.0)


def test_an_anchor_without_a_radius_of_its_own_is_named():
    with pytest.raises(ColumnError, match="anchor 2"):
        coverage_levels(_anchors(radius_m=[5.0, np.nan, 5.0]), _transit(), [None])


def test_several_origins_are_reported_together_and_apart():
    anchors = _anchors(origin=["parked", "queue", "queue"])
    results = coverage_levels(anchors, _transit(), [10.0]).results
    assert [(r.origin, r.anchors) for r in results] == [(None, 3), ("parked", 1), ("queue", 2)]
    assert results[0].areas_m2[1] == pytest.approx(
        results[1].areas_m2[1] + results[2].areas_m2[1], rel=1e-12
    )


def test_anchors_and_transit_area_in_different_systems_are_refused():
    with pytest.raises(CrsError):
        coverage_levels(Anchors.from_points([0.0], [0.0], CRS(32629)), _transit(), [10.0])

"""Shapes on their way to the page move by no more than is told."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from covertool.report.page.shapes import (
    MapFrame,
    choose_tolerance,
    draw_areas,
    draw_lines,
    draw_marks,
    simplified,
)

ROUNDING_M = 0.05 * np.sqrt(2) + 1e-9
FRAME = MapFrame.around((0.0, 0.0, 500.0, 400.0))


def back(xs: list, ys: list) -> np.ndarray:
    return np.column_stack([xs, ys]) / 10 + (FRAME.x0_m, FRAME.y0_m)


def wavy(seed: int, count: int) -> shapely.Polygon:
    rng = np.random.default_rng(seed)
    turn = np.linspace(0, 2 * np.pi, count, endpoint=False)
    reach = 80 + 20 * np.cumsum(rng.normal(size=count)) / np.sqrt(count)
    ring = np.column_stack([250 + reach * np.cos(turn), 200 + reach * np.sin(turn)])
    hole = shapely.Point(250, 200).buffer(10)
    return shapely.make_valid(shapely.Polygon(ring)).difference(hole)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), tolerance_m=st.sampled_from([0.25, 0.5, 2.0, 10.0]))
def test_no_boundary_moves_further_than_the_tolerance_and_the_rounding(seed, tolerance_m):
    areas = np.array([wavy(seed, 60)], dtype=object)
    drawn = draw_areas(areas, FRAME, tolerance_m)
    edge = shapely.boundary(shapely.union_all(simplified(areas, 0.0)[0]))
    for part_x, part_y in zip(drawn.x, drawn.y, strict=True):
        for ring_x, ring_y in zip(part_x[0], part_y[0], strict=True):
            away = shapely.distance(edge, shapely.points(back(ring_x, ring_y)))
            assert away.max() <= tolerance_m + ROUNDING_M


def test_a_hole_stays_a_hole():
    ring = shapely.box(10, 10, 90, 90).difference(shapely.box(30, 30, 60, 60))
    drawn = draw_areas(np.array([ring], dtype=object), FRAME, 0.25)
    outer, inner = (back(x, y) for x, y in zip(drawn.x[0][0], drawn.y[0][0], strict=True))
    assert shapely.Polygon(outer, [inner]).equals(ring)


def test_each_part_knows_the_row_it_came_from():
    two = shapely.MultiPolygon([shapely.box(0, 0, 9, 9), shapely.box(20, 0, 29, 9)])
    areas = np.array([shapely.box(50, 50, 60, 60), two], dtype=object)
    assert draw_areas(areas, FRAME, 0.25).row.tolist() == [0, 1, 1]
    lines = np.array([shapely.LineString([(0, 0), (50, 0)])] * 3, dtype=object)
    assert draw_lines(lines, FRAME, 0.25).row.tolist() == [0, 1, 2]


def test_the_tolerance_rises_until_all_fits():
    circle = np.array([shapely.Point(250, 200).buffer(150, quad_segs=5000)], dtype=object)
    fine = choose_tolerance([circle], budget=200)
    coarse = choose_tolerance([circle], budget=20)
    assert fine < coarse
    for budget, tolerance_m in ((200, fine), (20, coarse)):
        assert shapely.get_num_coordinates(simplified(circle, tolerance_m)[0]).sum() <= budget


@pytest.mark.parametrize("budget", [10, 100])
def test_of_thinned_marks_each_is_a_true_place_and_none_is_far_from_a_drawn_one(budget):
    rng = np.random.default_rng(2)
    x, y = 400 * rng.random((2, 3000))
    drawn, cell_m = draw_marks(x, y, FRAME, budget)
    assert len(drawn.x) <= budget
    places = back(drawn.x, drawn.y)
    assert np.abs(places - np.column_stack([x, y])[drawn.row]).max() <= 0.05 + 1e-9
    away = np.hypot(x[:, None] - places[:, 0], y[:, None] - places[:, 1]).min(axis=1)
    assert away.max() <= cell_m * np.sqrt(2) + ROUNDING_M


def test_marks_that_fit_are_all_drawn():
    assert draw_marks(np.array([1.0, 1.0]), np.array([2.0, 2.0]), FRAME)[1] == 0.0

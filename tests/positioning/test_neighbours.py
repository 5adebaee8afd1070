"""Selection: priority, then nearest, three at most; agreement with brute force and a KD-tree."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial import KDTree

from covertool.positioning.grid import ANCHOR, BLIND, PSEUDO_ANCHOR, build_grid
from covertool.positioning.neighbours import (
    anchor_codes,
    list_candidates,
    select_all,
    select_gdop,
    select_nearest,
    select_ranked,
)
from covertool.positioning.noise import ANCHOR_BIT


def _grids(cars, priority, anchors, radius):
    cars, anchors = np.reshape(cars, (-1, 2)).astype(float), np.reshape(anchors, (-1, 2))
    priority = np.asarray(priority, dtype=np.int64)
    moving = build_grid(cars[:, 0], cars[:, 1], np.arange(len(cars)), priority, radius)
    ones = np.full(len(anchors), ANCHOR)
    x, y = anchors[:, 0].astype(float), anchors[:, 1].astype(float)
    return cars[:, 0], cars[:, 1], moving, build_grid(x, y, anchor_codes(len(x)), ones, radius)


def _brute_force(cars, priority, anchors, radius, most=3):
    points = np.concatenate([cars, anchors])
    rank = np.concatenate([priority, np.full(len(anchors), ANCHOR)])
    code = np.concatenate([np.arange(len(cars)), anchor_codes(len(anchors))])
    chosen = []
    for i, car in enumerate(cars):
        d2 = ((points - car) ** 2).sum(axis=1)
        near = [k for k in range(len(points)) if d2[k] <= radius**2 and k != i]
        near.sort(key=lambda k: (rank[k], d2[k], code[k]))
        chosen.append([int(code[k]) for k in near[:most]])
    return chosen


def _chosen(selection):
    return [row[row >= 0].tolist() for row in selection.neighbour]


@settings(max_examples=40, deadline=None)
@example(seed=248, cars=17, anchors=51, radius=63.0)  # two as far, along other axes
@given(
    seed=st.integers(0, 10_000),
    cars=st.integers(1, 40),
    anchors=st.integers(0, 60),
    radius=st.floats(1.0, 80.0),
)
def test_grid_selection_equals_brute_force(seed, cars, anchors, radius):
    rng = np.random.default_rng(seed)
    car, anchor = rng.integers(0, 100, (cars, 2)), rng.integers(0, 100, (anchors, 2))
    priority = rng.integers(1, 4, cars)
    x, y, moving, parked = _grids(car, priority, anchor, radius)
    expected = _brute_force(car, priority, anchor, radius)
    assert _chosen(select_nearest(moving, parked, radius)) == expected
    listed = list_candidates(x, y, moving, parked, radius)
    everyone = _brute_force(car, priority, anchor, radius, most=1000)
    assert _chosen(select_all(listed)) == everyone
    assert _chosen(select_ranked(listed, listed.dx**2 + listed.dy**2)) == expected


def test_a_far_anchor_comes_before_a_near_pseudo_anchor_and_that_before_a_blind_car():
    cars = [[0, 0], [1, 0], [2, 0], [3, 0]]
    rank = [BLIND, BLIND, PSEUDO_ANCHOR, BLIND]
    *_, moving, parked = _grids(cars, rank, [[0, 9]], 10.0)
    assert _chosen(select_nearest(moving, parked, 10.0))[0] == [ANCHOR_BIT, 2, 1]


def test_the_edge_of_the_zone_belongs_to_it():
    *_, moving, parked = _grids([[0, 0]], [BLIND], [[9, 12], [15.000001, 0]], 15.0)
    assert select_nearest(moving, parked, 15.0).filled.tolist() == [1]


def test_of_more_than_three_anchors_the_nearest_three_are_used():
    *_, moving, parked = _grids([[0, 0]], [BLIND], [[4, 0], [1, 0], [3, 0], [2, 0]], 15.0)
    nearest = select_nearest(moving, parked, 15.0)
    assert (nearest.neighbour[0] & ~ANCHOR_BIT).tolist() == [1, 3, 2]
    assert nearest.anchors.tolist() == [3]


@pytest.mark.parametrize("far", [[1e6, 0], [-1e6, 0], [0, 1e6], [0, -1e6], [1e6, 1e6]])
def test_a_car_far_from_every_anchor_hears_none(far):
    x, y, moving, parked = _grids([far], [BLIND], [[0, 0], [40, 40], [80, 80]], 15.0)
    assert select_nearest(moving, parked, 15.0).filled.tolist() == [0]
    assert list_candidates(x, y, moving, parked, 15.0).code.size == 0


def test_gdop_prefers_a_wide_geometry_to_three_anchors_in_a_row():
    anchors = [[5, 0], [6, 0], [7, 0], [-4, 7], [-4, -7]]
    x, y, moving, parked = _grids([[0, 0]], [BLIND], anchors, 15.0)
    listed = list_candidates(x, y, moving, parked, 15.0)
    assert set((select_gdop(listed).neighbour[0] & ~ANCHOR_BIT).tolist()) == {0, 3, 4}


def test_gdop_keeps_a_lone_anchor_and_fills_up_by_geometry():
    cars = [[0, 0], [0, 6], [1, 5], [0, 7], [9, 0]]
    x, y, moving, parked = _grids(cars, [BLIND] * 5, [[0, -5]], 10.0)
    chosen = _chosen(select_gdop(list_candidates(x, y, moving, parked, 10.0)))[0]
    assert ANCHOR_BIT in chosen
    assert 4 in chosen


@pytest.mark.parametrize("radius", [15.0, 100.0])
def test_counts_in_the_zone_agree_with_a_kd_tree(radius):
    rng = np.random.default_rng(3)
    car, anchor = rng.uniform(0, 1000, (300, 2)), rng.uniform(0, 1000, (2000, 2))
    x, y, moving, parked = _grids(car, np.full(300, BLIND), anchor, radius)
    listed = list_candidates(x, y, moving, parked, radius)
    tree = KDTree(np.concatenate([car, anchor]))
    expected = [len(near) - 1 for near in tree.query_ball_point(car, radius)]
    assert np.diff(listed.start).tolist() == expected


def test_a_zone_without_width_holds_what_is_at_the_same_place():
    *_, moving, parked = _grids([[5, 5], [5, 5], [6, 5]], [BLIND] * 3, [[5, 5]], 0.0)
    chosen = _chosen(select_nearest(moving, parked, 0.0))
    assert chosen == [[ANCHOR_BIT, 1], [ANCHOR_BIT, 0], []]


def test_a_crowd_at_one_place_is_heard_by_number():
    """Many more points in one cell than are looked at together."""
    *_, moving, parked = _grids([[0, 0]] * 700, [BLIND] * 700, np.zeros((500, 2)), 15.0)
    assert _chosen(select_nearest(moving, parked, 15.0))[699] == [ANCHOR_BIT + k for k in range(3)]
    *_, none = _grids([[0, 0]], [BLIND], [], 15.0)
    assert _chosen(select_nearest(moving, none, 15.0))[1] == [0, 2, 3]


@pytest.mark.parametrize("radius", [3.0, 20.0, 40.0, 90.0])
def test_selection_among_points_far_apart_equals_brute_force_up_to_the_rim(radius):
    """From cells wider than a zone to zones wider than cells; cars also outside of all anchors."""
    rng = np.random.default_rng(8)
    anchor = rng.integers(0, 600, (150, 2))
    beside = anchor[:20] + np.array([3, 0])
    car = np.concatenate([rng.integers(-40, 640, (80, 2)), beside, [[600, 600]]])
    priority = rng.integers(1, 4, len(car))
    *_, moving, parked = _grids(car, priority, anchor, radius)
    chosen = _chosen(select_nearest(moving, parked, radius))
    assert chosen == _brute_force(car, priority, anchor, radius)

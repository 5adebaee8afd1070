"""Doubles are told from neighbours in the better detection's own frame."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from covertool.extract.detectors.nms import oriented_nms


def kept(x, y, heading, score, length=4.4, width=1.8):
    x, y, score = (np.asarray(v, dtype=float) for v in (x, y, score))
    same = np.ones_like(x)
    return oriented_nms(x, y, heading * same, length * same, width * same, score).tolist()


def test_neighbours_in_perpendicular_bays_both_stay():
    assert kept([0, 2.3], [0, 0], 0.0, [0.9, 0.8]) == [True, True]


def test_the_same_offset_ahead_is_a_double():
    assert kept([0, 2.3], [0, 0], 90.0, [0.9, 0.8]) == [True, False]


def test_cars_bumper_to_bumper_both_stay():
    assert kept([0, 4.6], [0, 0], 90.0, [0.9, 0.8]) == [True, True]


def test_neighbours_in_diagonal_bays_both_stay():
    # Bays at 45 degrees, 2.4 m apart across: 3.39 m apart along the kerb.
    assert kept([0, 2.4 * np.sqrt(2)], [0, 0], 45.0, [0.9, 0.8]) == [True, True]


def test_a_bus_swallows_what_lies_on_its_roof():
    assert kept([0, 4.5], [0, 0], 90.0, [0.9, 0.8], length=12.0, width=2.5) == [True, False]


def test_of_equal_scores_the_first_stays():
    assert kept([0, 0.1], [0, 0], 0.0, [0.5, 0.5]) == [True, False]


def test_nothing_in_gives_nothing_out():
    assert kept([], [], 0.0, []) == []


@settings(deadline=None)  # the first call loads what it needs
@given(
    st.lists(st.tuples(st.floats(0, 30), st.floats(0, 30)), min_size=2, max_size=25),
    st.floats(0, 180),
    st.floats(0, 360),
    st.integers(0, 10**6),
)
def test_turning_the_whole_scene_changes_nothing(places, heading, turn, seed):
    places = np.round(np.array(places), 1) + 0.037  # no distance exactly on a threshold
    score = np.random.default_rng(seed).permutation(len(places)) / 100
    angle = np.radians(turn)
    rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    turned = places @ rotation.T
    heading = np.round(heading) + 0.31
    before = kept(*places.T, heading, score)
    assert before == kept(*turned.T, heading + turn, score)
    assert before[int(np.argmax(score))]


@settings(deadline=None)  # the first call loads what it needs
@given(
    st.lists(st.tuples(st.floats(0, 20), st.floats(0, 20)), min_size=2, max_size=40),
    st.integers(0, 10**6),
)
def test_no_two_that_stay_share_a_body_and_all_that_fall_have_a_better_one_near(places, seed):
    x, y = np.array(places).T
    score = np.random.default_rng(seed).permutation(len(places)) / 100
    stays = np.array(kept(x, y, 0.0, score))
    dx, dy = np.abs(x[:, None] - x), np.abs(y[:, None] - y)
    inside = (dy < 2.4) & (dx < 1.25)
    better = score[None, :] > score[:, None]
    assert not (inside & better & stays[:, None] & stays[None, :]).any()
    assert (inside & better & stays[None, :])[~stays].any(axis=1).all()

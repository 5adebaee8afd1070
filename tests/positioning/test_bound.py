"""The posterior Cramér-Rao bound: closed forms, a linear filter, and gtsam's marginals."""

import logging
import math

import numpy as np
import pytest

from covertool.positioning.bound import MOST_CARS, JointBound, crlb_m, pdop, place_information
from covertool.positioning.cases import Scenario
from covertool.positioning.ekf import Ekf
from covertool.positioning.experiment import position_errors
from covertool.positioning.hearing import Hearing, Step, steps_of
from covertool.positioning.inverse import inverse
from covertool.positioning.neighbours import Selection, anchor_codes
from covertool.positioning.options import PositioningOptions
from covertool.positioning.ranging import RangeModel

from .scenes import filtering, nowhere, straight

NOBODY = np.zeros((0, 2))


def step(time, position, neighbour, *, new=False):
    position, neighbour = np.asarray(position, float), np.asarray(neighbour, dtype=np.int64)
    n = len(position)
    filled = (neighbour >= 0).sum(axis=1)
    chosen = Selection(neighbour, filled, np.zeros(n, np.int64))
    zero = np.zeros(n, np.int64)
    return Step(
        time,
        np.arange(n),
        position,
        np.zeros((n, 2)),
        np.full(n, new),
        zero,
        np.zeros(n, bool),
        chosen,
    )


@pytest.mark.parametrize("n", [1, 7, 8, 9, 40])
def test_the_inverse_is_that_of_lapack_and_keeps_clusters_apart(n):
    rng = np.random.default_rng(n)
    a = rng.normal(size=(n, n))
    a = a @ a.T + np.eye(n)
    np.testing.assert_allclose(inverse(a), np.linalg.inv(a), rtol=1e-9, atol=1e-9)
    both = np.zeros((2 * n, 2 * n))
    both[::2, ::2], both[1::2, 1::2] = a, 2 * a  # two clusters whose rows alternate
    found = inverse(both)
    assert (found[::2, 1::2] == 0.0).all()
    np.testing.assert_allclose(found[::2, ::2], 2 * found[1::2, 1::2], rtol=1e-9, atol=1e-9)


def bound_of(cars, *, gps_m=6.0, correlation=0.0, odometry_m=0.5, anchors=NOBODY, sigma_m=0.2):
    model = RangeModel(sigma_m)
    return JointBound(cars, gps_m, correlation, odometry_m, anchors, np.zeros(len(anchors)), model)


def test_two_cars_that_range_share_their_fixes_along_the_line_of_sight():
    bound = bound_of(2, sigma_m=0.5)
    bound.follow([step(0, [[0, 0], [30, 0]], [[1], [0]], new=True)])
    g, w = 1 / 36.0, 2 / 0.25  # information of a fix, and of the two ranges, one each way
    along = (g + w) / (g * (g + 2 * w))
    assert bound.squared_m2 == pytest.approx(along + 36.0, rel=1e-4)


def test_gps_alone_and_gps_with_odometry_have_the_bounds_of_linear_filters():
    q, r = 0.25, 36.0
    steady = q / 2 + math.sqrt(q * q / 4 + q * r) - q
    trace = steps_of(straight(cars=2, steps=200))
    for odometry_m, expected in ((None, 72.0), (0.5, 2 * steady)):
        bound = bound_of(2, odometry_m=odometry_m)
        last = 0.0
        for one in Hearing(trace, NOBODY, None, PositioningOptions()):
            before = bound.squared_m2.copy()
            bound.follow([one])
            last = bound.squared_m2 - before
        assert last == pytest.approx(expected, rel=1e-3)


def test_where_ranges_are_straight_covariance_error_and_bound_of_the_ekf_coincide():
    anchors = 1e7 * np.array([[1.0, 0.0], [0.0, 1.0], [-0.6, 0.8]])
    trace = straight(cars=40, steps=30, spacing_m=1.0)
    options = {"velocity": "current", "sharing": "truth", "halted": False}
    run = filtering(
        trace,
        Ekf(sigma_q=0.0),
        anchors=anchors,
        radius_m=2e7,
        sigma_m=2.0,
        runs=50,
        **options,
    )
    far = bound_of(40, gps_m=1e6, anchors=anchors, sigma_m=2.0)
    squared = []
    for one, state in run.states():
        before = far.squared_m2.copy()
        far.follow([one])
        truth = np.tile(one.position, (50, 1))
        squared.append(((state.position - truth) ** 2).sum(axis=1).mean())
    last = far.squared_m2 - before
    trace_of_p = state.covariance[:, 0] + state.covariance[:, 2]
    assert trace_of_p == pytest.approx(last[0], rel=1e-3)
    assert np.mean(squared[10:]) == pytest.approx(last[0], rel=4 / math.sqrt(2000))


def test_a_correlated_gps_error_cannot_be_averaged_away():
    def final(correlation):
        bound = bound_of(1, correlation=correlation)
        for t in range(300):
            bound.follow([step(t, [[0, 0]], [[-1]], new=t == 0)])
        return bound.squared_m2[0] / 300

    white, correlated, constant = final(0.0), final(0.99), final(0.999999)
    assert white < correlated < constant
    assert constant == pytest.approx(72.0, rel=1e-2)


def test_a_car_that_leaves_keeps_the_others_information():
    pair = [[0, 0], [30, 0]]
    bound = bound_of(2, odometry_m=0.0)
    bound.follow([step(0, pair, [[1], [0]], new=True)])
    both = bound.squared_m2[0]
    alone = step(1, pair[:1], [[-1]])
    bound.follow([alone])
    known = bound.squared_m2[0] - both
    across = 1 / (1 / 36 + 1 / 36)
    along = 1 / (1 / (both - 36.0) + 1 / 36)
    assert known == pytest.approx(along + across, rel=1e-3)


def test_the_joint_bound_equals_the_marginals_of_gtsam():
    gtsam = pytest.importorskip("gtsam")
    rng = np.random.default_rng(4)
    way = rng.uniform(0, 60, (3, 2)) + np.cumsum(rng.normal(3, 1, (6, 3, 2)), axis=0)
    anchors = rng.uniform(0, 80, (2, 2))
    code = anchor_codes(2)
    neighbour = np.array([[1, code[0], -1], [2, -1, -1], [0, 1, code[1]]])
    bound = bound_of(3, anchors=anchors, sigma_m=0.7)
    graph, truth = gtsam.NonlinearFactorGraph(), gtsam.Values()
    noise = gtsam.noiseModel.Isotropic.Sigma
    for a in range(2):
        truth.insert(1000 + a, gtsam.Point2(*anchors[a]))
        graph.add(gtsam.PriorFactorPoint2(1000 + a, gtsam.Point2(*anchors[a]), noise(2, 1e-6)))
    for t, place in enumerate(way):
        before = bound.squared_m2.copy()
        bound.follow([step(t, place, neighbour, new=t == 0)])
        for i in range(3):
            key = 10 * t + i
            truth.insert(key, gtsam.Point2(*place[i]))
            graph.add(gtsam.PriorFactorPoint2(key, gtsam.Point2(*place[i]), noise(2, 6.0)))
            if t:
                moved = gtsam.Point2(*(place[i] - way[t - 1][i]))
                graph.add(gtsam.BetweenFactorPoint2(key - 10, key, moved, noise(2, 0.5)))
            for other in neighbour[i][neighbour[i] >= 0]:
                far = 1000 + other - code[0] if other >= code[0] else 10 * t + other
                d = np.linalg.norm(
                    place[i] - (truth.atPoint2(far) if far >= 1000 else place[other])
                )
                graph.add(gtsam.RangeFactor2(key, int(far), d, noise(1, 0.7)))
    marginals = gtsam.Marginals(graph, truth)
    expected = [np.trace(marginals.marginalCovariance(10 * 5 + i)) for i in range(3)]
    assert bound.squared_m2 - before == pytest.approx(expected, rel=1e-4)


def test_a_missing_bound_of_too_many_cars_is_null_with_a_warning(caplog):
    logging.getLogger("covertool").propagate = True  # the command line may have cut it
    trace = straight(cars=MOST_CARS + 1, steps=1)
    small = {"arms": ("gps",), "runs": 1}
    report = position_errors([Scenario(trace, nowhere())], **small)
    assert report.results[0].bound_rmse_m is None
    assert report.results[0].rmse_over_bound is None
    assert f"{MOST_CARS + 1} cars" in caplog.text


def test_crlb_is_the_ranging_noise_times_pdop_and_infinite_on_one_line():
    x, y = np.array([10.0, -3.0, 4.0]), np.array([2.0, 8.0, -9.0])
    assert crlb_m(0, 0, x, y, 0.7) == pytest.approx(0.7 * pdop(0, 0, x, y))
    by_hand = np.linalg.inv(place_information(0, 0, x, y, 0.7)).trace() ** 0.5
    assert crlb_m(0, 0, x, y, 0.7) == pytest.approx(by_hand)
    assert math.isinf(crlb_m(0, 0, np.array([1.0, 5.0]), np.array([0.0, 0.0]), 0.2))
    assert math.isinf(pdop(0, 0, np.array([]), np.array([])))


@pytest.mark.parametrize("n", [3, 4, 8])
def test_pdop_of_anchors_in_a_regular_polygon_is_two_over_root_n(n):
    angle = 2 * np.pi * np.arange(n) / n
    assert pdop(0, 0, 9 * np.cos(angle), 9 * np.sin(angle)) == pytest.approx(2 / math.sqrt(n))

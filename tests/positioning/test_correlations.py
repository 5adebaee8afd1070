"""What cars have in common: the blocks of pairs against one dense matrix of all cars."""

import numpy as np
import pytest

from covertool.positioning.correlations import FORGOTTEN, LANES, Correlations, pair_of, pass_on
from covertool.positioning.estimators import Measurements, State
from covertool.positioning.second_order import SecondOrder

SIGMA_M, FIX_M2, ODOMETRY_M2 = 0.5, 36.0, 0.25


def blocks_of(filter_, n, run=0):
    """(n, n, 2, 2) correlations of one run; the seats of these tests are the cars' numbers."""
    out = np.zeros((n, n, 2, 2))
    block = filter_._common.block[run // LANES].reshape(-1, 4, LANES)[:, :, run % LANES]
    for j in range(n):
        for i in range(j):
            out[i, j] = block[pair_of(i, j)].reshape(2, 2)
            out[j, i] = out[i, j].T
    return out


def heard(car, truth, gps, pairs, rng):
    """Both cars of each pair measure their distance, except in pairs marked one way."""
    most = max((sum(i in pair[:2] for pair in pairs) for i in range(len(car))), default=1)
    neighbour = np.full((len(car), most), -1, np.int64)
    count = np.zeros(len(car), np.int64)
    ranges = np.zeros((len(car), most))
    for i, j, both in pairs:
        for one, other in ((i, j), (j, i)) if both else ((j, i),):
            d = np.linalg.norm(truth[one] - truth[other])
            neighbour[one, count[one]] = other
            ranges[one, count[one]] = d + SIGMA_M * rng.normal()
            count[one] += 1
    zero = np.zeros((len(car), most))
    return Measurements(
        1.0, (1, 0), 0, 1, 0, np.asarray(car), zero[:, :2], gps, FIX_M2, count, neighbour, ranges,
        zero + SIGMA_M**2, zero, zero, np.zeros((len(car), most, 3)),
    )  # fmt: skip


def dense_step(x, joint, measured, truth, pairs):
    """One step with numpy: fixes of all cars, then each pair corrects its two cars alone."""
    n = len(x)
    h = np.eye(2 * n)
    gain = joint @ h.T @ np.linalg.inv(h @ joint @ h.T + FIX_M2 * h)
    x = x + (gain @ (measured.gps - x).ravel()).reshape(n, 2) if n else x
    joint = joint - gain @ joint
    for i, j, both in pairs:
        found = []
        for one, other in ((i, j), (j, i)) if both else ((j, i),):
            found.append(measured.range_m[one, list(measured.neighbour[one]).index(other)])
        delta = x[i] - x[j]
        d = np.linalg.norm(delta)
        row = np.zeros(2 * n)
        row[2 * i : 2 * i + 2], row[2 * j : 2 * j + 2] = delta / d, -delta / d
        s = row @ joint @ row + SIGMA_M**2 / len(found)
        common = joint @ row
        gain = common / s
        keep = np.zeros(2 * n, bool)
        keep[[2 * i, 2 * i + 1, 2 * j, 2 * j + 1]] = True
        gain[~keep] = 0.0
        x = x + (gain * (np.mean(found) - d)).reshape(n, 2)
        a = np.eye(2 * n) - np.outer(gain, row)
        joint = a @ joint @ a.T + np.outer(gain, gain) * SIGMA_M**2 / len(found)
    return x, joint


def test_blocks_of_pairs_equal_one_dense_matrix_in_which_each_range_corrects_its_two_cars():
    """Cars tens of kilometres apart: their ranges are straight, and the filter is linear."""
    rng = np.random.default_rng(3)
    truth = rng.uniform(-1, 1, (5, 2)) * 5e4
    # GPS in the filter goes car by car; without correlations before, that is the joint update
    filter_, pairs = SecondOrder(5), [(0, 3, True), (1, 2, True), (2, 4, True), (1, 3, False)]
    gps = truth + 6 * rng.normal(size=(5, 2))
    measured = heard(range(5), truth, gps, pairs, rng)
    state = filter_.update(filter_.start(gps, FIX_M2), measured)
    x, joint = dense_step(gps, 1e8 * np.eye(10), measured, truth, pairs)
    expected = joint.reshape(5, 2, 5, 2).transpose(0, 2, 1, 3)
    np.testing.assert_allclose(state.position, x, atol=1e-3)
    for i in range(5):
        own = expected[i, i][[0, 0, 1], [0, 1, 1]]
        np.testing.assert_allclose(state.covariance[i], own, atol=1e-2)
        expected[i, i] = 0.0
    np.testing.assert_allclose(blocks_of(filter_, 5), expected, atol=1e-2)
    assert np.abs(expected[0, 1]).max() > 0.5  # these two never ranged


def test_a_car_that_left_takes_its_correlations_with_it_and_its_seat_is_clean():
    rng = np.random.default_rng(4)
    truth = np.array([[0.0, 0.0], [4000.0, 0.0], [0.0, 4000.0]])
    filter_, pair = SecondOrder(3), [(0, 1, True)]
    state = filter_.update(filter_.start(truth, FIX_M2), heard([5, 7, 9], truth, truth, pair, rng))
    assert np.abs(blocks_of(filter_, 3)[0, 1]).max() > 1.0
    fewer = State(state.position[1:], state.covariance[1:])
    filter_.update(fewer, heard([7, 9], truth[1:], truth[1:], [], rng))
    back = filter_.start(truth[:1], FIX_M2)
    three = State(
        np.concatenate([back.position, state.position[1:]]),
        np.concatenate([back.covariance, state.covariance[1:]]),
    )
    filter_.update(three, heard([6, 7, 9], truth, truth, [], rng))  # car 6 sits where 5 sat
    assert np.abs(blocks_of(filter_, 3)).max() == 0.0


@pytest.mark.parametrize(("correlation", "linked"), [(0.5, 1), (1.1 * FORGOTTEN, 1), (1e-4, 0)])
def test_cars_part_when_they_have_nearly_nothing_in_common(correlation, linked):
    common = Correlations(1)
    seats = common.seat(np.arange(2), np.zeros(2, bool))
    common.block[0, 0, 3] = correlation * 2.0 * 5.0  # xx of run 3
    common.linked[0, 0] = 1
    unchanged = np.repeat([[1.0, 0.0, 0.0, 1.0]], 2, axis=0).repeat(LANES, axis=1)
    variance = np.repeat([[4.0], [25.0]], LANES, axis=1)
    pass_on(common.block[0], common.linked[0], seats, unchanged, variance)
    assert common.linked[0, 0] == linked
    assert (common.block[0, 0, 3] != 0.0) == bool(linked)

"""The extended Kalman filter's correction, worked out by hand and against information."""

import math

import numpy as np
import pytest

from covertool.positioning.ekf import LEAST_VARIANCE_M2, Ekf
from covertool.positioning.estimators import Measurements, State, isotropic


def heard(anchors, ranges, variance=1.0, shared=None, count=None):
    anchors = np.array(anchors, dtype=float)[None]
    most = anchors.shape[1]
    return Measurements(
        step_s=1.0,
        key=(1, 0),
        first_run=0,
        runs=1,
        time=0,
        car=np.arange(1),
        velocity=np.zeros((1, 2)),
        gps=np.zeros((1, 2)),
        gps_variance_m2=36.0,
        count=np.array([most if count is None else count]),
        neighbour=np.zeros((1, most), np.int64),
        range_m=np.array([ranges], dtype=float),
        range_variance_m2=np.full((1, most), float(variance)),
        x=anchors[..., 0].copy(),
        y=anchors[..., 1].copy(),
        shared=np.zeros((1, most, 3)) if shared is None else np.array([shared], dtype=float),
    )


def at(x, y, pxx=4.0, pxy=0.0, pyy=4.0):
    return State(np.array([[x, y]], dtype=float), np.array([[pxx, pxy, pyy]], dtype=float))


def test_an_ekf_range_along_x_is_a_scalar_kalman_filter():
    # Variance 4 before, 1 of the range: gain 4/5, and y learns nothing.
    found = Ekf().update(at(10, 0), heard([(0, 0)], [12.0]))
    assert found.position[0] == pytest.approx([10 + 2 * 0.8, 0])
    assert found.covariance[0] == pytest.approx([0.8, 0, 4.0])


def test_an_ekf_without_ranges_stays_the_prediction():
    found = Ekf().update(at(10, 3, 5.0, 1.5, 2.0), heard([(0, 0)], [99.0], count=0))
    assert found.position[0] == pytest.approx([10, 3])
    assert found.covariance[0] == pytest.approx([5.0, 1.5, 2.0])


def test_an_ekf_takes_only_as_many_ranges_as_it_counts():
    two = heard([(0, 0), (10, 9)], [12.0, 50.0], count=1)
    assert Ekf().update(at(10, 0), two).position[0] == pytest.approx([11.6, 0])


def test_the_ekf_moves_y_through_the_correlation_with_x():
    # Gain of y is pxy / (pxx + R) = 2/5.
    found = Ekf().update(at(10, 0, 4.0, 2.0, 4.0), heard([(0, 0)], [12.0]))
    assert found.position[0] == pytest.approx([11.6, 0.8])
    assert found.covariance[0] == pytest.approx([0.8, 0.4, 4 - 2 * 2 / 5])


def test_the_ekf_widens_a_range_by_the_neighbour_s_own_variance_along_the_line():
    # Direction (3, 4)/5: u'Pu = 0.36 * 2 + 2 * 0.48 * 1 + 0.64 * 3 = 3.6.
    slanted = heard([(0, 0)], [5.0 + 1.0], variance=0.4, shared=[(2.0, 1.0, 3.0)])
    gain = 4 / (4 + 0.4 + 3.6)
    assert Ekf().update(at(3, 4), slanted).position[0] == pytest.approx(
        [3 + 0.6 * gain, 4 + 0.8 * gain]
    )


def test_the_literal_ekf_leaves_the_neighbour_s_variance_out():
    slanted = heard([(0, 0)], [5.0 + 1.0], variance=1.0, shared=[(2.0, 1.0, 3.0)])
    found = Ekf(literal=True).update(at(3, 4), slanted)
    assert found.position[0] == pytest.approx([3 + 0.6 * 0.8, 4 + 0.8 * 0.8])


def test_an_exact_range_counts_as_a_tenth_of_a_millimetre_in_the_ekf():
    assert math.sqrt(LEAST_VARIANCE_M2) == pytest.approx(1e-4)
    found = Ekf().update(at(10, 0), heard([(0, 0)], [12.0], variance=0.0))
    assert found.position[0, 0] == pytest.approx(12.0, abs=1e-7)
    assert found.covariance[0, 0] == pytest.approx(LEAST_VARIANCE_M2, rel=1e-6)


def test_an_ekf_that_stands_on_its_neighbour_stays_finite_and_where_it_is():
    found = Ekf().update(at(7, 7), heard([(7, 7)], [3.0]))
    assert found.position[0] == pytest.approx([7, 7])
    assert found.covariance[0] == pytest.approx([4.0, 0.0, 4.0])


def test_the_ekf_tells_a_neighbour_a_micrometre_away_from_one_at_its_place():
    found = Ekf().update(at(1e-6, 0), heard([(0, 0)], [2.0]))
    assert found.position[0] == pytest.approx([2 * 0.8, 0], abs=1e-5)


def test_the_ekf_carries_on_by_the_velocity_and_adds_both_noises():
    # (0.5 s * 0.6 m/s)^2 + 3^2.
    ekf = Ekf(sigma_q=3.0, sigma_gamma=0.6)
    found = ekf.predict(at(1, 2, 3.0, 0.5, 5.0), np.array([[4.0, -6.0]]), 0.5)
    assert found.position[0] == pytest.approx([3, -1])
    assert found.covariance[0] == pytest.approx([3 + 9.09, 0.5, 5 + 9.09])


def test_the_ekf_defaults_are_two_metres_and_half_a_metre_a_second_and_not_literal():
    ekf = Ekf()
    assert (ekf.sigma_q, ekf.sigma_gamma, ekf.literal) == (2.0, 0.5, False)
    assert (ekf.name, ekf.uses_gps, ekf.gives_covariance) == ("ekf", False, True)


def test_the_ekf_starts_at_a_copy_of_the_fix_with_its_variance():
    fix = np.array([[1.0, 2.0]])
    state = Ekf().start(fix, 36.0)
    fix[:] = 0
    assert state.position[0] == pytest.approx([1, 2])
    assert state.covariance[0] == pytest.approx([36, 0, 36])
    assert Ekf().start(fix, 0.0).covariance[0] == pytest.approx(isotropic(1, LEAST_VARIANCE_M2)[0])

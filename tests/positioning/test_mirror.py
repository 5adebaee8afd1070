"""The other side of a row of parked cars: its probability, and what is reported meanwhile."""

import math

import numpy as np
import pytest

from covertool.positioning.cases import Scenario
from covertool.positioning.circle import two_sides
from covertool.positioning.experiment import position_errors
from covertool.positioning.mirror import join, part, settle, weigh_gps, weigh_range

from .circuit import circuit

KERB_M = 3.5


@pytest.mark.parametrize("lateral_m", [0.5, 1.0, -2.0])
def test_a_range_to_one_anchor_leaves_both_sides_with_the_odds_of_the_prior(lateral_m):
    """Known along the street to 5 cm, across it by a normal: both sides are at +-h."""
    along_m, spread_m2 = 6.0, 1.7**2
    measured_m = math.hypot(along_m, KERB_M)
    one, two = two_sides(along_m, lateral_m, 0.05**2, 0.0, spread_m2, measured_m, 0.02**2)
    odds = math.exp(-2.0 * abs(lateral_m) * KERB_M / spread_m2)
    assert one[0] + two[0] == pytest.approx(1.0)
    assert two[0] == pytest.approx(odds / (1.0 + odds), rel=0.15)
    side = math.copysign(KERB_M, lateral_m)
    np.testing.assert_allclose(one[1:3], [along_m, side], atol=0.15)
    np.testing.assert_allclose(two[1:3], [along_m, -side], atol=0.15)


def test_there_is_no_other_side_where_the_prior_reaches_one_only():
    for lateral_m, spread_m2 in ((3.5, 0.3**2), (60.0, 4.0)):
        measured_m = math.hypot(6.0, lateral_m)
        _, two = two_sides(6.0, lateral_m, 0.05**2, 0.0, spread_m2, measured_m, 0.02**2)
        assert two[0] == 0.0


def _open(share=0.2):
    x, p = np.array([10.0, -3.5]), np.array([0.5, 0.2, 0.8])
    return x, p, np.eye(2), np.array([share, 10.0, 3.5])


def test_mean_and_covariance_of_both_sides_are_those_of_the_mixture_and_can_be_undone():
    x, p, _, other = _open()
    join(x, p, other)
    np.testing.assert_allclose(x, [10.0, 0.8 * -3.5 + 0.2 * 3.5])
    np.testing.assert_allclose(p, [0.5, 0.2, 0.8 + 0.2 * 0.8 * 7.0**2])
    part(x, p, other)
    for found, before in zip((x, p, other), (_open()[k] for k in (0, 1, 3)), strict=True):
        np.testing.assert_allclose(found, before, atol=1e-12)


@pytest.mark.parametrize("fix", [(10.0, -6.0), (11.0, 1.0), (8.0, 9.0)])
def test_a_fix_weighs_the_sides_by_bayes_and_the_likelier_one_leads(fix):
    x, p, a, other = _open()
    fix, r = np.array(fix), 36.0
    here = np.array([[0.5, 0.2], [0.2, 0.8]])
    there = here * [[1, -1], [-1, 1]]  # mirrored in the street
    density = []
    for place, spread, share in ((x, here, 0.8), (other[1:], there, 0.2)):
        miss = fix - place
        level = miss @ np.linalg.inv(spread + r * np.eye(2)) @ miss
        density.append(share * math.exp(-0.5 * level))
    expected = density[1] / sum(density)
    corrected = other[1:] + there @ np.linalg.inv(there + r * np.eye(2)) @ (fix - other[1:])
    weigh_gps(x, p, a, other, fix, r)
    assert other[0] == pytest.approx(min(expected, 1.0 - expected))
    if expected < 0.5:
        np.testing.assert_allclose(other[1:], corrected)
        assert (a == np.eye(2)).all()
    else:
        np.testing.assert_allclose(x, [10.0, 3.5])
        np.testing.assert_allclose(p, [0.5, -0.2, 0.8], atol=1e-12)
        np.testing.assert_allclose(a, [[1, 0], [0, -1]], atol=1e-12)


def test_an_anchor_across_the_street_ends_the_doubt():
    x, p, a, other = _open(share=0.4)
    weigh_range(x, p, a, other, (13.0, -8.0, 0.0), math.hypot(3.0, 11.5), 0.2**2)
    np.testing.assert_allclose(x, [10.0, 3.5], atol=1e-9)
    settle(x, p, other)
    assert other[0] == 0.0


def test_two_near_sides_become_one_place():
    x, p, _, other = _open()
    other[1:] = 10.5, -3.0
    settle(x, p, other)
    assert other[0] == 0.0
    np.testing.assert_allclose(x, [10.1, -3.4])


def test_where_cars_are_parked_at_one_kerb_the_filter_is_as_sure_as_it_may_be():
    trace, anchors = circuit(both_sides=False)
    report = position_errors(
        [Scenario(trace, anchors)],
        arms=("proposed",),
        estimators=("second_order",),
        sigmas_m=(0.2, 4.0),
        radii_m=(15.0,),
        runs=40,
    )
    for result, most in zip(report.results, (1.40, 1.10), strict=True):
        assert result.rmse_over_bound <= most
        assert 0.8 <= result.nees / 2 <= 1.5

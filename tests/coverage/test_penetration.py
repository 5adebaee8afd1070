"""Expected levels against draws of equipped cars, counted by the exact engine."""

import numpy as np
import pytest
import shapely
from pyproj import CRS
from scipy.stats import binom

from covertool.coverage import level_areas
from covertool.coverage.penetration import level_chances, penetration
from covertool.errors import OptionError
from covertool.model import Anchors, TransitArea

ITM = CRS(2157)


@pytest.mark.parametrize("share", [0.0, 0.05, 0.5, 1.0])
def test_the_chances_are_binomial(share):
    n = np.arange(40)
    one = [binom.pmf(k, n, share) for k in range(3)]
    expected = np.column_stack([*one, 1 - np.sum(one, axis=0)])
    assert level_chances(40, share) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(("radius_m", "share"), [(15.0, 0.5), (40.0, 0.1)])
def test_expected_levels_agree_with_thinning_draws_within_three_standard_errors(radius_m, share):
    rng = np.random.default_rng(11)
    x, y = rng.uniform(0, 400, (2, 400))
    roads = shapely.MultiPolygon([shapely.box(0, 100, 400, 110), shapely.box(0, 250, 400, 262)])
    (point,) = penetration(
        Anchors.from_points(x, y, ITM), TransitArea(roads, ITM), [radius_m], [share]
    )
    draws = []
    for _ in range(200):
        kept = rng.random(x.size) < share
        draws.append(np.array(level_areas(x[kept], y[kept], radius_m, roads).areas_m2))
    fractions = np.array(draws) / roads.area
    error = np.hypot(fractions.std(axis=0, ddof=1) / np.sqrt(len(draws)), point.se)
    assert np.all(np.abs(fractions.mean(axis=0) - point.expected) < 3 * error)


def test_all_cars_equipped_is_the_exact_coverage():
    rng = np.random.default_rng(3)
    x, y = rng.uniform(0, 300, (2, 200))
    road = shapely.MultiPolygon([shapely.box(0, 100, 300, 200)])
    (point,) = penetration(Anchors.from_points(x, y, ITM), TransitArea(road, ITM), ["A"], [1.0])
    exact = np.array(level_areas(x, y, 15.0, road).areas_m2) / road.area
    assert point.expected == pytest.approx(exact, abs=1e-4)
    assert (point.device_class, point.radius_m) == ("A", 15.0)


@pytest.mark.parametrize("share", [-0.1, 1.1, float("nan")])
def test_a_share_outside_0_to_1_is_refused(share):
    road = TransitArea(shapely.MultiPolygon([shapely.box(0, 0, 1, 1)]), ITM)
    with pytest.raises(OptionError):
        penetration(Anchors.from_points([0.0], [0.0], ITM), road, [15.0], [share])

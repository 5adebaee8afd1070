import math

import numpy as np
import pytest
import shapely
from pyproj import CRS

from covertool.coverage import coverage_levels
from covertool.coverage.curve import coverage_curve, parse_radii
from covertool.errors import OptionError
from covertool.model import Anchors, TransitArea

TRANSIT = TransitArea(shapely.MultiPolygon([shapely.box(0, 0, 120, 80)]), CRS(2157))


def field(n=40):
    x, y = np.random.default_rng(2).uniform([-10, -10], [130, 90], (n, 2)).T
    return Anchors.from_points(x, y, CRS(2157))


def test_the_curve_is_exact_at_its_nodes():
    anchors, radii = field(), [3.0, 9.0, 27.0]
    curve = coverage_curve(anchors, TRANSIT, radii)
    for at, radius in enumerate(radii):
        exact = coverage_levels(anchors, TRANSIT, [radius]).results[0].fractions
        assert curve.fractions[at] == pytest.approx(exact, abs=1e-14)


def test_slopes_are_the_derivatives_of_the_fractions():
    anchors, step = field(), 1e-5
    for radius in (4.0, 11.0, 23.0):
        below, here, above = (
            coverage_curve(anchors, TRANSIT, [r]) for r in (radius - step, radius, radius + step)
        )
        difference = (above.fractions - below.fractions) / (2 * step)
        assert here.slopes == pytest.approx(difference, abs=1e-7)
        assert here.slopes.sum() == pytest.approx(0, abs=1e-14)


def test_a_lone_disc_grows_by_its_circumference():
    curve = coverage_curve(Anchors.from_points([60.0], [40.0], CRS(2157)), TRANSIT, [10.0])
    assert curve.slopes[0, 1] * TRANSIT.area_m2 == pytest.approx(20 * math.pi, rel=1e-12)


def test_a_curve_names_its_radii_with_both_ends():
    assert parse_radii("5:200:40").tolist() == np.linspace(5, 200, 40).tolist()


@pytest.mark.parametrize(
    "text", ["", "5", "5:200", "5:200:1", "0:9:3", "9:5:3", "a:b:c", "5:inf:3"]
)
def test_a_curve_that_makes_no_sense_is_refused(text):
    with pytest.raises(OptionError, match="5:200:40"):
        parse_radii(text)


def test_the_table_has_a_row_for_each_radius_and_level():
    frame = coverage_curve(field(5), TRANSIT, [5.0, 6.0]).to_frame()
    assert frame.shape == (8, 4)
    assert frame.groupby("radius_m").fraction.sum().to_numpy() == pytest.approx([1, 1])

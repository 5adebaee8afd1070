import numpy as np
import pytest
import shapely
from pyproj import CRS

from covertool.errors import GeometryError
from covertool.model import Anchors, CoverageReport, RadiusCoverage, TransitArea, Vehicles

ITM = CRS(2157)


def one_car(heading_deg: float) -> Vehicles:
    number, text = (lambda v: np.array([v], dtype=float)), (lambda v: np.array([v], dtype=object))
    return Vehicles(
        text("1"), number(10), number(20), number(heading_deg), number(4), number(2), number(1),
        text(None), text(None), text(None), number(0), number(0), ITM,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("heading_deg", "bounds"), [(0, (9, 18, 11, 22)), (90, (8, 19, 12, 21)), (180, (9, 18, 11, 22))]
)
def test_heading_zero_points_north_and_ninety_east(heading_deg, bounds):
    assert one_car(heading_deg).footprints()[0].bounds == pytest.approx(bounds)


def test_heading_turns_clockwise():
    length_axis = shapely.LineString([(10 - 1, 20 - 1), (10 + 1, 20 + 1)])
    assert one_car(45).footprints()[0].covers(length_axis)
    assert not one_car(-45).footprints()[0].covers(length_axis)


def test_columns_of_different_length_are_refused():
    anchors = Anchors.from_points([0, 1], [0, 1], ITM)
    with pytest.raises(GeometryError, match="columns differ in length"):
        Anchors(
            anchors.id[:1], anchors.x_m, anchors.y_m, anchors.radius_m, anchors.device_class,
            anchors.sigma_m, anchors.origin, ITM,
        )  # fmt: skip


def test_chosen_rows_keep_every_column():
    anchors = Anchors.from_points([0, 1, 2], [5, 6, 7], ITM).take([2, 0])
    assert list(anchors.id) == ["3", "1"]
    assert list(anchors.y_m) == [7, 5]


def test_anchors_of_different_crs_are_not_joined():
    with pytest.raises(GeometryError, match="different CRS"):
        Anchors.concatenate(
            [Anchors.from_points([0], [0], ITM), Anchors.from_points([0], [0], CRS(32629))]
        )


def test_a_bow_tie_is_no_transit_area():
    bow_tie = shapely.MultiPolygon([shapely.Polygon([(0, 0), (1, 1), (1, 0), (0, 1)])])
    with pytest.raises(GeometryError, match="not valid"):
        TransitArea(bow_tie, ITM)


def test_fractions_of_nothing_are_undefined_and_not_zero():
    coverage = RadiusCoverage(15.0, "A", None, 0, (0.0, 0.0, 0.0, 0.0), 0.0)
    assert all(np.isnan(coverage.fractions))


def test_a_report_has_one_row_for_each_radius_and_level():
    areas = (4.0, 3.0, 2.0, 1.0)
    report = CoverageReport(10.0, 5, (RadiusCoverage(15.0, "A", None, 5, areas, 0.0),))
    frame = report.to_frame()
    assert list(frame.level) == [0, 1, 2, 3]
    assert list(frame.fraction) == pytest.approx([0.4, 0.3, 0.2, 0.1])

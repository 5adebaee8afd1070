import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyproj import CRS, Geod

from covertool import crs
from covertool.errors import CrsError


def test_an_unknown_code_is_refused_with_a_mend():
    with pytest.raises(CrsError, match="EPSG:999999") as caught:
        crs.parse("EPSG:999999")
    assert "EPSG:2157" in caught.value.mend


@pytest.mark.parametrize(
    ("code", "works"),
    [
        (2157, True),  # Irish Transverse Mercator
        (29903, True),  # Irish Grid
        (32632, True),  # UTM
        (2154, True),  # Lambert-93
        (3857, False),  # metres of the web's Mercator are not ground metres
        (4326, False),  # degrees
        (3035, False),  # equal area: discs become ellipses
        (2263, False),  # feet
        (31468, True),  # declared north first; GIS files hold x first all the same
        (2048, False),  # west and south
    ],
)
def test_only_conformal_metres_east_and_north_are_computed_in(code, works):
    assert crs.is_working(CRS(code)) is works


def test_the_image_plane_is_computed_in_and_never_transformed():
    assert crs.is_working(crs.IMAGE_PLANE)
    with pytest.raises(CrsError) as caught:
        crs.transform(np.zeros(1), np.zeros(1), crs.IMAGE_PLANE, crs.WGS84)
    assert "--origin" in caught.value.mend


@given(st.floats(-179.9, 179.9), st.floats(-79.9, 83.9))
def test_a_place_lies_within_three_degrees_of_its_utm_meridian(lon, lat):
    utm = crs.utm(lon, lat)
    zone = utm.to_epsg() % 100
    assert abs(lon - (zone * 6 - 183)) <= 3 + 1e-9
    assert utm.to_epsg() // 100 == (326 if lat >= 0 else 327)


def test_coordinates_off_the_earth_are_refused():
    with pytest.raises(CrsError, match="do not lie on Earth"):
        crs.working_crs(CRS(4326), (694000.0, 737000.0, 695000.0, 738000.0))


@pytest.mark.parametrize(("code", "lon", "lat"), [(2157, -6.59, 53.38), (32635, 24.9, 60.2)])
def test_the_scale_factor_is_map_metres_over_geodesic_metres(code, lon, lat):
    projected = CRS(code)
    lons, lats, _ = Geod(ellps="GRS80").fwd([lon, lon], [lat, lat], [0, 90], [100, 100])
    x, y = crs.transform(np.array([lon, *lons]), np.array([lat, *lats]), crs.WGS84, projected)
    expected = np.hypot(x[1:] - x[0], y[1:] - y[0]) / 100
    assert crs.scale_factor(projected, x[0], y[0]) == pytest.approx(expected, abs=2e-6)


def test_a_north_first_crs_is_read_x_before_y():
    x, y = crs.transform(np.array([11.57]), np.array([48.14]), crs.WGS84, CRS(31468))
    assert 4.4e6 < x[0] < 4.6e6  # the easting with its zone prefix comes first
    assert 5.3e6 < y[0] < 5.4e6


def test_the_unit_of_degrees_is_not_a_length():
    assert math.isnan(crs.unit_m(crs.WGS84))

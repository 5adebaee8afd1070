"""The side on which cars drive, from roads whose sense is known by construction."""

import geopandas as gpd
import numpy as np
import pytest
import shapely

from covertool.traffic.driving_side import side_of_roads


def roads(lines, tags, lon=20.0, lat=-5.0):
    """Return invented roads near a place; by default in the middle of Africa (right)."""
    from covertool.crs import utm

    frame = gpd.GeoDataFrame({"tags": tags}, geometry=list(lines), crs=utm(lon, lat))
    x, y = gpd.GeoSeries([shapely.Point(lon, lat)], crs=4326).to_crs(frame.crs)[0].coords[0]
    return frame.set_geometry(frame.translate(x, y))


def ring(clockwise, at=0.0):
    turn = np.linspace(0, 2 * np.pi, 25) * (-1 if clockwise else 1)
    return shapely.LineString(np.column_stack([at + 15 * np.cos(turn), 15 * np.sin(turn)]))


@pytest.mark.parametrize(("clockwise", "side"), [(True, "left"), (False, "right")])
def test_roundabouts_turn_clockwise_where_cars_drive_on_the_left(clockwise, side):
    lines = [ring(clockwise, 100.0 * k) for k in range(4)]
    assert side_of_roads(roads(lines, [{"junction": "roundabout"}] * 4), "x") == side


@pytest.mark.parametrize("side", ["left", "right"])
def test_on_a_dual_carriageway_the_others_come_on_the_far_side(side):
    # East-bound at y = 0; the west-bound carriageway lies north of it when driving on the left ...
    # the driver's right hand is south: driving left puts oncoming cars on the right, the south.
    other_y = -12.0 if side == "left" else 12.0
    lines = [
        shapely.LineString([(0, 0), (200, 0)]),
        shapely.LineString([(200, other_y), (0, other_y)]),
    ]
    tags = [{"oneway": "yes", "name": "Long Road"}] * 2
    assert side_of_roads(roads(lines, tags), "x") == side
    backwards = [
        {"oneway": "-1", "name": "Long Road"},
        {"oneway": "-1", "name": "Long Road"},
    ]
    reversed_lines = [shapely.LineString(list(line.coords)[::-1]) for line in lines]
    assert side_of_roads(roads(reversed_lines, backwards), "x") == side


def test_tags_count_more_than_the_shape_of_roads():
    lines = [ring(clockwise=False, at=100.0 * k) for k in range(4)]
    tags = [{"junction": "roundabout", "driving_side": "left"}] * 4
    assert side_of_roads(roads(lines, tags), "x") == "left"
    tags = [{"junction": "roundabout", "maxspeed:type": "IE:urban"}] * 4
    assert side_of_roads(roads(lines, tags), "x") == "left"


@pytest.mark.parametrize(("lon", "lat", "side"), [(-8.0, 53.0, "left"), (9.7, 50.9, "right")])
def test_roads_that_tell_nothing_leave_it_to_the_place_with_a_warning(lon, lat, side, caplog):
    found = side_of_roads(roads([shapely.LineString([(0, 0), (9, 9)])], [{}], lon, lat), "x")
    assert found == side
    assert f"the {side} is assumed" in caplog.text

"""SUMO edge data and Dublin's TRIPS."""

import io
from datetime import UTC, datetime

import geopandas as gpd
import numpy as np
import pytest

from covertool.congestion.clock import zone
from covertool.congestion.feeds import trips
from covertool.congestion.feeds.protocol import FeedOptions, Site
from covertool.errors import ColumnError, CovertoolError
from tests.congestion.feedtools import read, statuses
from tests.congestion.town import SHARED

needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="shared data is not here")
SEVEN = datetime(2014, 6, 16, 7, tzinfo=UTC)


def meandata(edges, begin=0.0, end=900.0):
    return f'<meandata><interval begin="{begin}" end="{end}" id="x">{edges}</interval></meandata>'


def test_sumo_speed_relative_gives_the_status_and_the_interval_the_time():
    edges = '<edge id="a" sampledSeconds="60" speed="2.0" speedRelative="0.144"/>'
    seen = read("sumo", meandata(edges, 900, 1800), time=SEVEN)
    assert (seen.status[0], seen.speed_mps[0]) == ("very_slow", 2.0)
    assert seen.time[0] == np.datetime64("2014-06-16T07:15", "us")
    assert np.datetime64("2014-06-16T07:29:59", "us") < seen.until[0]
    assert seen.until[0] < np.datetime64("2014-06-16T07:30", "us")


def test_an_edge_that_no_car_used_is_free_and_inner_edges_are_left_out():
    edges = '<edge id="a" sampledSeconds="0.00"/><edge id=":j_0" sampledSeconds="9" speed="1"/>'
    assert statuses(read("sumo", meandata(edges), time=SEVEN)) == {"a": "free"}


def test_lanes_are_averaged_by_the_seconds_that_cars_spent_there():
    lanes = (
        '<edge id="a"><lane id="a_0" sampledSeconds="30" speed="4" speedRelative="0.2"/>'
        '<lane id="a_1" sampledSeconds="10" speed="8" speedRelative="0.6"/>'
        '<lane id="a_2" sampledSeconds="0"/></edge>'
    )
    seen = read("sumo", meandata(lanes), time=SEVEN)
    assert (seen.speed_mps[0], seen.relative_speed[0]) == (pytest.approx(5), pytest.approx(0.3))


def test_a_free_flow_speed_replaces_a_missing_relative_one():
    edges = '<edge id="a" sampledSeconds="60" speed="5.0"/>'
    assert read("sumo", meandata(edges), time=SEVEN).status[0] == "unknown"
    assert read("sumo", meandata(edges), time=SEVEN, free_speed_mps=10.0).status[0] == "slow"


def test_sumo_needs_to_know_when_second_zero_was():
    with pytest.raises(ColumnError, match="--time"):
        read("sumo", meandata('<edge id="a"/>'))


@pytest.fixture(scope="module")
def links():
    if not SHARED.is_dir():
        pytest.skip("shared data is not here")
    with (SHARED / "dublin_trips_routes.csv").open("rb") as stream:
        return trips.network(stream, FeedOptions())


def test_the_real_trips_network_lies_where_its_published_links_lie(links):
    net = gpd.read_file(SHARED / "dublin_trips_net.gpkg").set_index("segment_id")
    mine = links.set_index("segment_id").geometry.reindex(net.index)
    assert mine.notna().all()
    assert net.geometry.hausdorff_distance(mine).max() < 0.01


@needs_shared
def test_links_without_coordinates_are_counted(caplog):
    with (SHARED / "dublin_trips_routes.csv").open("rb") as stream:
        found = trips.network(stream, FeedOptions())
    assert "14 links without a line" in caplog.text
    assert found["segment_id"].is_unique
    with (SHARED / "dublin_trips_junctions.csv").open("rb") as stream:
        assert len(trips.junctions(stream, FeedOptions())) == 717


def test_travel_times_become_speeds_over_the_length_of_the_link():
    text = (
        "Route,Link,Direction,STT,TCS1,TCS2,Time\n"
        "1,1,1,36,10,11,2014-06-16 13:00:00\n1,1,2,300,11,10,2014-06-16 13:00:00\n"
    )
    places = {i: Site(i, length_m=500.0) for i in ("trips_10_11", "trips_11_10")}
    seen = read("trips", text, sites=places, free_speed_mps=50 / 3.6, tz=zone("Europe/Dublin"))
    # 500 m in 36 s are 50 km/h; in 300 s an eighth of that.
    assert statuses(seen) == {"trips_10_11": "free", "trips_11_10": "very_slow"}
    assert seen.time[0] == np.datetime64("2014-06-16T12:00", "us")


def test_travel_times_in_naive_local_time_need_a_zone():
    text = "STT,TCS1,TCS2,Time\n36,10,11,2014-06-16 13:00:00\n"
    with pytest.raises(ColumnError, match="--tz"):
        read("trips", text, free_speed_mps=13.9)


@pytest.mark.parametrize(
    "text", ["", "a,b\n1,2\n", "STT,TCS1,TCS2\n36,10,11\n", "TCS1,TCS2\n10,11\n"]
)
def test_a_trips_table_at_fault_is_told(text):
    with pytest.raises(CovertoolError):
        read("trips", text, free_speed_mps=13.9)


def test_a_network_without_lines_is_told():
    with pytest.raises(ColumnError, match="WKT"):
        trips.network(io.BytesIO(b"TCS1,TCS2\n1,2\n"), FeedOptions())

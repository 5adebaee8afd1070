import geopandas as gpd
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from covertool.congestion.fill import QUEUE_SHARE, queue_share
from covertool.congestion.queues import QueueOptions, cars_in_queue, queue_anchors
from covertool.congestion.streets import streets
from covertool.errors import OptionError
from tests.congestion.town import network


def words(*given_):
    return np.array(given_, dtype=object)


def east(length_m, lanes=1, both=False):
    line = shapely.LineString([(0, 0), (length_m, 0)])
    lines = [line, line.reverse()] if both else [line]
    ids = ["there", "back"][: len(lines)]
    columns = {"segment_id": ids, "lanes": lanes}
    return streets(gpd.GeoDataFrame(columns, geometry=lines, crs=2157))


def test_the_first_car_stands_a_metre_before_the_line_and_the_next_seven_and_a_half_behind():
    cars, where = queue_anchors(east(100), words("slow"), np.array([30.0]))
    # Front at 99 m, centre 2.5 m behind it.
    assert cars.x_m.tolist() == pytest.approx([96.5, 89.0, 81.5, 74.0])
    assert cars.y_m.tolist() == pytest.approx([0.0] * 4)
    assert where.tolist() == ["there"] * 4
    assert set(cars.origin) == {"queue"}


@given(st.integers(0, 200))
def test_n_cars_need_seven_and_a_half_n_less_one_and_a_half_metres(n):
    needed = 7.5 * n - 1.5
    assert cars_in_queue(needed) == n
    assert cars_in_queue(needed - 0.01) == max(n - 1, 0)


@settings(max_examples=30, deadline=None)
@given(st.floats(1, 400), st.floats(0, 2000), st.integers(1, 4))
def test_no_queue_is_longer_than_its_segment(length_m, queue_m, lanes):
    cars, _ = queue_anchors(east(length_m, lanes), words("free"), np.array([queue_m]))
    assert len(cars) <= lanes * cars_in_queue(length_m)
    assert len(cars) == 0 or (cars.x_m.min() >= 2.5 - 1e-6 and cars.x_m.max() <= length_m)


def test_each_lane_has_its_own_queue_about_the_line_of_a_one_way_street():
    cars, _ = queue_anchors(east(100, lanes=2), words("slow"), np.array([6.0]))
    assert sorted(cars.y_m) == pytest.approx([-1.625, 1.625])


@pytest.mark.parametrize(("drive", "side"), [("left", 1.625), ("right", -1.625)])
def test_cars_of_a_two_way_street_stand_on_the_side_they_drive(drive, side):
    network_ = east(100, both=True)
    options = QueueOptions(drive=drive)
    cars, where = queue_anchors(network_, words("slow", "slow"), np.array([6.0, 6.0]), options)
    place = dict(zip(where, zip(cars.x_m, cars.y_m, strict=True), strict=True))
    assert place["there"] == (pytest.approx(96.5), pytest.approx(side))
    assert place["back"] == (pytest.approx(3.5), pytest.approx(-side))


def test_a_stationary_street_is_full_and_a_free_or_closed_one_is_empty():
    net = streets(network({"a": 76.0, "b": 76.0, "c": 76.0}))
    cars, where = queue_anchors(net, words("stationary", "free", "closed"), np.full(3, np.nan))
    assert set(where) == {"a"}
    assert len(cars) == 10


def test_on_average_queues_fill_the_share_of_their_status():
    net = streets(network({f"s{i}": 137.0 for i in range(400)}))
    options = QueueOptions(seed=7)
    for status in ("slow", "very_slow"):
        cars, _ = queue_anchors(net, words(*[status] * 400), np.full(400, np.nan), options)
        filled = len(cars) * 7.5 / (400 * 137.0)
        # Rounding at random has an SD of at most half a car a street.
        assert filled == pytest.approx(QUEUE_SHARE[status], abs=4 * 0.5 * 7.5 / 137 / 20)


def test_the_same_seed_gives_the_same_cars_and_another_seed_others():
    net = streets(network({f"s{i}": 100.0 for i in range(50)}))
    given_ = (net, words(*["slow"] * 50), np.full(50, np.nan))
    one, two, other = (queue_anchors(*given_, QueueOptions(seed=s))[0] for s in (1, 1, 2))
    assert one.id.tolist() == two.id.tolist()
    assert one.id.tolist() != other.id.tolist()


def test_ids_are_unique_even_where_a_segment_has_several_pieces():
    lines = shapely.MultiLineString([[(0, 0), (50, 0)], [(0, 9), (50, 9)]])
    net = streets(gpd.GeoDataFrame({"segment_id": ["a"]}, geometry=[lines], crs=2157))
    cars, _ = queue_anchors(net, words("slow", "slow"), np.array([20.0, 20.0]))
    assert len(set(cars.id)) == len(cars) == 4


def test_cars_follow_a_bend():
    bend = shapely.LineString([(0, 0), (0, 50), (50, 50)])
    net = streets(gpd.GeoDataFrame({"segment_id": ["a"]}, geometry=[bend], crs=2157))
    cars, _ = queue_anchors(net, words("slow"), np.array([73.5]))
    on_line = shapely.distance(bend, shapely.points(cars.x_m, cars.y_m))
    assert len(cars) == 10
    assert on_line.max() < 0.5


def test_a_stop_line_before_the_end_moves_the_queue_back():
    cars, _ = queue_anchors(
        east(100), words("slow"), np.array([6.0]), QueueOptions(stop_line_m=8.0)
    )
    assert cars.x_m.tolist() == pytest.approx([88.5])


def test_the_share_follows_the_law_of_little():
    # 600 cars/h at half of 50 km/h: each loses 0.072 s a metre, so 0.012 cars stand on a metre.
    assert queue_share(0.5) == pytest.approx(7.5 * (600 / 3600) * (3.6 / 50))
    assert queue_share(1.0) == 0.0
    assert queue_share(0.01) == queue_share(0.0) == 1.0


@pytest.mark.parametrize(
    "wrong", [{"drive": "middle"}, {"lane_width_m": 0.0}, {"stop_line_m": -1.0}]
)
def test_options_out_of_range_are_refused(wrong):
    with pytest.raises(OptionError):
        QueueOptions(**wrong)

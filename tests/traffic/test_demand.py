"""Who drives where: the paper's two scenarios and a user's routes, checked against the net."""

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely

from covertool.errors import FileError, GeometryError, OptionError
from covertool.model import Anchors
from covertool.traffic.circuit import closed_circuit, length_m, through_roads
from covertool.traffic.demand import campus_demand, town_demand, user_routes
from covertool.traffic.network import network_from_streets
from covertool.traffic.vicinity import anchors_along
from tests.traffic.towns import ORIGIN_M, ladder, needs_sumo


def assert_drivable(network, trips):
    for trip in trips:
        for edge, following in zip(trip.edges, trip.edges[1:], strict=False):
            assert following in network.successors[edge]
        if trip.place is not None:
            lane, at_m = trip.place
            edge = network.edges[trip.edges[0]]
            assert lane in edge.lanes
            assert 5 <= at_m <= edge.length_m


def test_the_town_has_200_cars_at_the_start_and_95_that_enter_every_4_s(town):
    demand = town_demand(town, seed=3)
    departs = np.array([trip.depart_s for trip in demand.trips])
    assert len(departs) == 295
    assert np.sum(departs == 0) == 200
    np.testing.assert_array_equal(departs[200:], 4.0 * np.arange(1, 96))
    assert len({trip.vehicle for trip in demand.trips}) == 295
    assert_drivable(town, demand.trips)


def test_cars_stay_on_the_through_roads_and_start_apart(town):
    demand = town_demand(town, seed=3, started=120)
    kinds = {town.edges[edge].kind for trip in demand.trips for edge in trip.edges}
    assert kinds == {"main", "regional", "collector"}
    places = {}
    for trip in demand.trips:
        if trip.place is not None:
            places.setdefault((trip.edges[0], trip.place[0]), []).append(trip.place[1])
    gaps = [np.diff(np.sort(found)).min() for found in places.values() if len(found) > 1]
    assert min(gaps) >= 8


def test_the_start_is_spread_by_length_not_by_edge(town):
    edges = through_roads(town)
    counts = dict.fromkeys(edges, 0)
    for seed in range(30):
        for trip in town_demand(town, seed=seed, started=60, entering=1).trips[:60]:
            counts[trip.edges[0]] += 1
    lengths_m = np.array([town.edges[edge].length_m - 5 for edge in edges])
    expected = 1800 * lengths_m / lengths_m.sum()
    chi2 = float(np.sum((np.array(list(counts.values())) - expected) ** 2 / expected))
    # Cars that keep apart are spread a little more evenly than chance; 99.9 % of chi squared.
    from scipy.stats import chi2 as distribution

    assert chi2 < distribution.ppf(0.999, len(edges) - 1)


def test_the_same_seed_gives_the_same_demand_and_another_does_not(town):
    assert town_demand(town, seed=4) == town_demand(town, seed=4)
    assert town_demand(town, seed=4).trips != town_demand(town, seed=5).trips


def test_the_campus_is_a_dozen_cars_on_one_ring_that_nobody_finishes(town):
    demand = campus_demand(town, seed=2)
    assert len(demand.trips) == 12
    assert_drivable(town, demand.trips)
    ring = demand.circuit
    assert town.edges[ring[-1]].to_junction == town.edges[ring[0]].from_junction
    junctions = [town.edges[edge].from_junction for edge in ring]
    assert len(set(junctions)) == len(junctions)
    for trip in demand.trips:
        assert set(trip.edges) == set(ring)
        assert length_m(town, trip.edges) > 300 * 50 / 3.6 * 1.2


@needs_sumo
def test_the_ring_is_the_one_nearest_to_the_length_asked_for(tmp_path):
    # Two blocks of their own, 800 m and 1200 m round, on one street; junctions take some metres.
    streets = ladder(columns=2)
    wide = ladder(columns=2, block_m=300.0).translate(600.0, 0.0)
    link = shapely.LineString(ORIGIN_M + np.array([[200.0, 0.0], [600.0, 0.0]]))
    rows = {"name": "s", "kind": "main", "width_m": 7.0}
    more = gpd.GeoDataFrame(rows, geometry=[*wide, link], index=range(5), crs=streets.crs)
    network = network_from_streets(pd.concat([streets, more], ignore_index=True), tmp_path)
    for target_m, outline_m in ((700, 800), (1500, 1200)):
        found_m = length_m(network, closed_circuit(network, target_m=target_m))
        assert outline_m - 80 < found_m < outline_m


def test_a_town_with_too_little_room_says_how_many_cars_start(town, caplog):
    one = max(town.edges.values(), key=lambda edge: edge.length_m).id
    demand = campus_demand(town, circuit=[one], cars=100)
    assert 8 < len(demand.trips) < 30
    assert "have room for" in caplog.text


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"seed": -1}, "seed"),
        ({"horizon_s": 0}, "horizon"),
        ({"horizon_s": float("nan")}, "horizon"),
        ({"circuit": ["nowhere"]}, "nowhere"),
        ({"circuit": []}, "none given"),
    ],
)
def test_numbers_and_edges_out_of_range_are_refused(town, options, told):
    with pytest.raises(OptionError, match=told):
        town_demand(town, **options)
    with pytest.raises(OptionError, match=told):
        campus_demand(town, **options)


def test_a_circuit_that_falls_apart_is_refused(town):
    with pytest.raises(GeometryError, match="only weakly connected"):
        town_demand(town, circuit=["0.0", "1.0"], started=5)


@needs_sumo
def test_a_net_in_many_parts_is_no_town(tmp_path):
    parts = [ladder(columns=3).translate(1000.0 * k, 0.0) for k in range(3)]
    rows = {"name": "s", "kind": "main", "width_m": 7.0}
    streets = gpd.GeoDataFrame(rows, geometry=[line for part in parts for line in part],
                               index=range(15), crs="EPSG:2157")  # fmt: skip
    network = network_from_streets(streets, tmp_path)
    with pytest.raises(GeometryError, match=r"only weakly connected: cars .* on 33%"):
        town_demand(network)


def test_a_users_routes_name_their_edges_types_and_first_start(town, tmp_path):
    path = tmp_path / "mine.rou.xml"
    path.write_text(
        '<routes><vType id="b" vClass="bus"/><vType id="c" length="4.2"/>'
        '<vehicle id="x" type="c" depart="100"><route edges="0.0 0.1"/></vehicle>'
        '<flow id="f" begin="00:02:00" end="200" period="9" from="0.0" to="1.1" via="0.1"/>'
        "</routes>"
    )
    demand = user_routes(path, town, horizon_s=60)
    assert set(demand.circuit) == {"0.0", "0.1", "1.1"}
    assert demand.begin_s == 100
    assert demand.user.length_of_type_m == {"b": 12.0, "c": 4.2}


@pytest.mark.parametrize(
    ("text", "error", "told"),
    [
        ("<routes/>", GeometryError, "no vehicle"),
        ('<routes><trip id="t" depart="0" from="0.0" to="far"/></routes>', GeometryError, "far"),
        ('<routes><vehicle id="t" depart="soon"/></routes>', FileError, "'soon'"),
        ('<routes><vehicle id="t" depart="0">', FileError, "ends early"),
        ('<!DOCTYPE r [<!ENTITY a "b">]><routes>&a;</routes>', FileError, "DOCTYPE"),
    ],
)
def test_routes_that_cannot_be_used_are_refused(town, tmp_path, text, error, told):
    path = tmp_path / "bad.rou.xml"
    path.write_text(text)
    with pytest.raises(error, match=told):
        user_routes(path, town, horizon_s=60)


def test_only_anchors_near_the_edges_are_taken_and_faults_show_both_boxes(town):
    x, y = town.edges["0.0"].shape[0]
    near = Anchors.from_points([x + 9, x + 9, x + 5000], [y + 14, y + 16.5, y], town.crs)
    assert anchors_along(near, town, ["0.0"]).id.tolist() == ["1"]
    assert anchors_along(near, town, ["0.0"], distance_m=17).id.tolist() == ["1", "2"]
    with pytest.raises(GeometryError, match=r"outside the net\n.*anchors x .* net x 69"):
        anchors_along(near.take([2]), town, ["0.0"])
    with pytest.raises(GeometryError, match="no anchor stands within 2 m"):
        anchors_along(near, town, ["0.0"], distance_m=2)

"""Nets: what we read of them against what SUMO's own programs know, and what is refused."""

import gzip
import shutil

import numpy as np
import pytest
import shapely

from covertool.errors import ColumnError, CrsError, FileError, GeometryError, OptionError
from covertool.traffic.circuit import length_m
from covertool.traffic.graph import StreetGraph, largest_component
from covertool.traffic.network import network_from_osm, network_from_streets, read_network
from covertool.traffic.sumo import find_sumo
from tests.traffic.towns import SHARED, ladder, needs_sumo, tool


@needs_sumo
def test_a_grid_has_the_edges_and_turns_that_its_shape_demands(tmp_path):
    tool(
        "netgenerate", tmp_path, "--grid", "--grid.number=3", "--grid.length=150", "-o", "g.net.xml"
    )
    network = read_network(tmp_path / "g.net.xml", net_crs="EPSG:2157")
    assert len(network.edges) == 2 * 12
    assert not network.left_hand
    # A street is left by each street of its junction, and by turning round.
    arms = {"A1": 3, "B1": 4}
    for edge in network.edges.values():
        if edge.to_junction in arms:
            assert len(network.successors[edge.id]) == arms[edge.to_junction]
    assert set(largest_component(network)) == set(network.edges)


@needs_sumo
def test_a_packed_net_is_the_same_net(town, tmp_path):
    packed = tmp_path / "t.net.xml.gz"
    packed.write_bytes(gzip.compress(town.path.read_bytes()))
    again = read_network(packed)
    assert list(again.edges) == list(town.edges)
    assert again.successors == town.successors


@needs_sumo
def test_a_cut_net_is_refused(town, tmp_path):
    cut = tmp_path / "cut.net.xml"
    content = town.path.read_bytes()
    cut.write_bytes(content[: len(content) * 2 // 3])
    with pytest.raises(FileError, match="ends early"):
        read_network(cut)
    packed = tmp_path / "cut.net.xml.gz"
    packed.write_bytes(gzip.compress(content)[:-2000])
    with pytest.raises(FileError, match="ends early"):
        read_network(packed)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('<!DOCTYPE net [<!ENTITY a "aaaa">]><net><edge id="&a;"/></net>', "DOCTYPE"),
        ("<routes/>", "no SUMO net"),
        ("<net><location netOffset='0,0' projParameter='!'/></net>", "no street"),
        ("not xml", "damaged"),
    ],
)
def test_what_is_no_net_is_refused(tmp_path, text, told):
    path = tmp_path / "x.net.xml"
    path.write_text(text)
    with pytest.raises((FileError, GeometryError), match=told):
        read_network(path, net_crs="EPSG:2157")


@needs_sumo
def test_in_ireland_the_lanes_lie_left_of_the_middle_line(town):
    assert town.left_hand
    streets = [shapely.LineString(line.coords) for line in ladder().geometry]
    for edge in town.edges.values():
        lane = shapely.LineString(edge.shape)
        middle = lane.interpolate(0.5, normalized=True)
        ahead = lane.interpolate(lane.length / 2 + 1)
        street = min(streets, key=middle.distance)
        on_street = street.interpolate(street.project(middle))
        along = np.array([ahead.x - middle.x, ahead.y - middle.y])
        aside = np.array([middle.x - on_street.x, middle.y - on_street.y])
        # Left of the direction of travel: the cross product is positive. Half a lane of 3.5 m.
        assert along[0] * aside[1] - along[1] * aside[0] == pytest.approx(1.75, abs=0.05)


@needs_sumo
def test_only_where_three_through_roads_meet_there_are_lights(town):
    # Of four rungs three are collectors, one is residential; corners have two arms only.
    assert town.signals == 4


@needs_sumo
def test_a_street_that_stops_at_the_kerb_of_another_still_joins_it(tmp_path):
    streets = ladder()
    # Back to the kerb by 3 m: half of the width of 7 m reaches it.
    line = streets.geometry[3]
    (x0, y0), (x1, y1) = line.coords
    streets.loc[3, "geometry"] = shapely.LineString([(x0, y0 + 3), (x1, y1)])
    network = network_from_streets(streets, tmp_path)
    assert set(largest_component(network)) == set(network.edges)
    assert len(network.edges) == len(network_from_streets(ladder(), tmp_path).edges)


@needs_sumo
def test_streets_without_their_columns_or_crs_are_refused(tmp_path):
    with pytest.raises(ColumnError, match="width_m"):
        network_from_streets(ladder().drop(columns="width_m"), tmp_path)
    with pytest.raises(CrsError, match="EPSG:4326"):
        network_from_streets(ladder().to_crs(4326), tmp_path)
    with pytest.raises(GeometryError, match="no simple lines"):
        network_from_streets(ladder().assign(kind="aisle"), tmp_path)


@needs_sumo
def test_the_fastest_route_is_the_one_that_sumos_router_finds(town, tmp_path):
    graph = StreetGraph.of(town)
    rng = np.random.default_rng(3)
    pairs = [
        tuple(int(k) for k in rng.choice(len(graph.names), 2, replace=False)) for _ in range(8)
    ]
    trips = "".join(
        f'<trip id="t{k}" depart="{k}" from="{graph.names[a]}" to="{graph.names[b]}"/>'
        for k, (a, b) in enumerate(pairs)
    )
    (tmp_path / "t.xml").write_text(f"<routes>{trips}</routes>")
    tool("duarouter", tmp_path, "-n", str(town.path), "--route-files", "t.xml", "-o", "r.xml",
         "--weights.random-factor", "1")  # fmt: skip
    import xml.etree.ElementTree as ET

    routes = [route.get("edges").split() for route in ET.parse(tmp_path / "r.xml").iter("route")]
    for ours, theirs in zip(graph.routes(pairs), routes, strict=True):
        names = [graph.names[k] for k in ours]
        assert names[0] == theirs[0]
        assert names[-1] == theirs[-1]
        # U-turns cost more with us, and lanes inside junctions cost nothing.
        assert length_m(town, names) <= 1.1 * length_m(town, theirs) + 1


@needs_sumo
@pytest.mark.skipif(not SHARED.is_dir(), reason="the real extracts are not here")
@pytest.mark.parametrize(
    ("extract", "left", "code", "least_km"),
    [
        pytest.param("bad_hersfeld.osm.gz", False, 32632, 150, marks=pytest.mark.slow),
        ("dublin_centre.osm", True, 2157, 2),
    ],
)
def test_real_towns_become_strongly_connected_nets(tmp_path, extract, left, code, least_km):
    network = network_from_osm(SHARED / extract, tmp_path)
    assert network.left_hand == left
    assert network.crs.to_epsg() == code
    assert network.signals > 0
    assert set(largest_component(network)) == set(network.edges)
    assert length_m(network, network.edges) > 1000 * least_km


@pytest.mark.skipif(not SHARED.is_dir(), reason="the real extracts are not here")
def test_an_extract_that_is_cut_off_or_a_pbf_is_refused(tmp_path):
    cut = tmp_path / "cut.osm"
    cut.write_bytes((SHARED / "dublin_centre.osm").read_bytes()[:200_000])
    with pytest.raises(FileError, match="cut off"):
        network_from_osm(cut, tmp_path)
    with pytest.raises(FileError, match="not as PBF"):
        network_from_osm(SHARED / "helsinki.osm.pbf", tmp_path)
    with pytest.raises(OptionError, match="middle"):
        network_from_osm(SHARED / "dublin_centre.osm", tmp_path, driving_side="middle")


@needs_sumo
def test_the_net_in_the_sumo_wheel_is_read_whole(tmp_path):
    net = find_sumo().home / "tools/game/DRT/osm.net.xml"
    shutil.copy(net, tmp_path / "osm.net.xml")
    network = read_network(tmp_path / "osm.net.xml")
    assert network.crs.to_epsg() == 32633
    assert length_m(network, network.edges) > 10_000

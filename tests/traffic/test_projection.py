"""Our coordinates against SUMO's own: points that its programs place by longitude and latitude."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from covertool import crs as crs_door
from covertool.errors import CrsError, GeometryError
from covertool.traffic.network import read_network
from tests.traffic.towns import needs_sumo, tool

PLACES = {"a": (-6.60, 53.38), "b": (-6.58, 53.39), "c": (-6.571, 53.372)}
NODES = "".join(f'<node id="{k}" x="{x}" y="{y}"/>' for k, (x, y) in PLACES.items())
EDGES = "".join(
    f'<edge id="{a}{b}" from="{a}" to="{b}"/>' for a, b in ("ab", "ba", "bc", "cb", "ca", "ac")
)
IRISH_GRID = (
    "+proj=tmerc +lat_0=53.5 +lon_0=-8 +k=1.000035 +x_0=200000 +y_0=250000 +ellps=mod_airy "
    "+towgs84=482.5,-130.6,564.6,-1.042,-0.214,-0.631,8.15 +units=m +no_defs"
)


@pytest.fixture
def triangle(tmp_path):
    """Return a maker of a net of three streets in a projection, with POIs placed by SUMO."""
    (tmp_path / "n.nod.xml").write_text(f"<nodes>{NODES}</nodes>")
    (tmp_path / "e.edg.xml").write_text(f"<edges>{EDGES}</edges>")

    def make(*options):
        tool("netconvert", tmp_path, "-n", "n.nod.xml", "-e", "e.edg.xml", *options,
             "-o", "t.net.xml", "--precision", "4")  # fmt: skip
        return tmp_path / "t.net.xml"

    return make


@needs_sumo
@pytest.mark.parametrize(
    "projection",
    ["EPSG:32629", "+proj=utm +zone=29 +datum=WGS84", "EPSG:2157", "EPSG:29903", IRISH_GRID],
)
def test_a_poi_that_sumo_places_by_lon_lat_lies_where_we_say(triangle, projection):
    net = triangle("--proj", projection)
    rng = np.random.default_rng(5)
    lon, lat = rng.uniform(-6.6, -6.571, 20), rng.uniform(53.372, 53.39, 20)
    pois = "".join(
        f'<poi id="{k}" lon="{x}" lat="{y}"/>'
        for k, (x, y) in enumerate(zip(lon, lat, strict=True))
    )
    (net.parent / "p.xml").write_text(f"<additional>{pois}</additional>")
    tool("polyconvert", net.parent, "-n", net.name, "--xml-files", "p.xml", "-o", "placed.xml",
         "--precision", "4")  # fmt: skip
    theirs = {
        int(poi.get("id")): (float(poi.get("x")), float(poi.get("y")))
        for poi in ET.parse(net.parent / "placed.xml").iter("poi")
    }
    network = read_network(net)
    x_m, y_m = crs_door.transform(lon, lat, crs_door.WGS84, network.crs)
    ours = np.column_stack(network.projection.to_net(x_m, y_m))
    gaps = [np.hypot(*(ours[k] - theirs[k])) for k in range(20)]
    assert max(gaps) < 0.05


@needs_sumo
def test_the_way_into_the_net_and_back_keeps_two_millimetres(triangle):
    place = read_network(triangle("--proj", IRISH_GRID)).projection
    x, y = np.array([10.0, 1500.0]), np.array([0.0, 900.0])
    back = place.to_net(*place.to_crs(x, y))
    np.testing.assert_allclose(np.array(back), np.array([x, y]), atol=2e-3)


@needs_sumo
def test_a_net_in_irish_tm_shares_the_crs_of_irish_data(triangle):
    assert read_network(triangle("--proj", "EPSG:2157")).crs == crs_door.IRISH_TM
    string = "+proj=tmerc +lat_0=53.5 +lon_0=-8 +k=0.99982 +x_0=600000 +y_0=750000 +ellps=GRS80"
    assert read_network(triangle("--proj", string)).crs == crs_door.IRISH_TM


@needs_sumo
def test_lon_lat_taken_for_metres_is_refused(triangle):
    with pytest.raises(GeometryError, match="degrees were taken for metres"):
        read_network(triangle(), net_crs="EPSG:2157")


@needs_sumo
def test_a_net_without_a_projection_asks_for_it(tmp_path):
    tool("netgenerate", tmp_path, "--grid", "-o", "g.net.xml")
    net = tmp_path / "g.net.xml"
    with pytest.raises(CrsError, match="no projection"):
        read_network(net)
    assert read_network(net, net_crs="EPSG:2157").crs == crs_door.IRISH_TM


@needs_sumo
def test_a_crs_beside_the_nets_own_is_a_conflict(triangle):
    net = triangle("--proj", "EPSG:2157")
    with pytest.raises(CrsError, match="EPSG:2157, and --net-crs says EPSG:32629"):
        read_network(net, net_crs="EPSG:32629")


@needs_sumo
@pytest.mark.parametrize("code", ["EPSG:31468", "EPSG:2193"])
def test_systems_that_run_north_first_are_refused(tmp_path, code):
    tool("netgenerate", tmp_path, "--grid", "-o", "g.net.xml")
    with pytest.raises(CrsError, match="north and east"):
        read_network(tmp_path / "g.net.xml", net_crs=code)


@needs_sumo
@pytest.mark.parametrize("code", ["EPSG:4326", "EPSG:2263"])
def test_a_net_that_is_not_in_metres_is_refused(tmp_path, code):
    tool("netgenerate", tmp_path, "--grid", "-o", "g.net.xml")
    with pytest.raises(CrsError, match="not in metres"):
        read_network(tmp_path / "g.net.xml", net_crs=code)

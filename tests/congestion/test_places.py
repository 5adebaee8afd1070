"""Junctions, and lines joined to the network."""

from datetime import date, time

import geopandas as gpd
import numpy as np
import pytest
import shapely
from pyproj import CRS

from covertool import crs
from covertool.congestion.clock import zone
from covertool.congestion.freeflow import with_free_flow
from covertool.congestion.junctions import junction_shares, junctions
from covertool.congestion.matching import match_lines
from covertool.congestion.moment import states_at
from covertool.congestion.options import OccupancyOptions
from covertool.congestion.sensitivity import sensitivity
from covertool.congestion.streets import streets
from covertool.errors import OptionError
from covertool.model import Observations
from tests.congestion.town import network, seen

OPTIONS = OccupancyOptions(zone("UTC"), windows={"noon": time(12)}, min_coverage=0.0)
ORIGIN = (715_000.0, 734_000.0)


def cross(*ends, both=True):
    """Return streets from the origin to each end, in both directions."""
    lines = {}
    for name, end in ends:
        line = shapely.LineString([ORIGIN, np.add(ORIGIN, end)])
        lines[f"{name}_out"] = line
        if both:
            lines[f"{name}_in"] = line.reverse()
    return gpd.GeoDataFrame({"segment_id": list(lines)}, geometry=list(lines.values()), crs=2157)


THREE = (("east", (200, 0)), ("north", (0, 200)), ("west", (-200, 0)))


def test_three_streets_make_a_junction_and_two_make_a_bend():
    assert junctions(streets(cross(*THREE))).tolist() == [list(ORIGIN)]
    assert len(junctions(streets(cross(*THREE[:2])))) == 0


def test_shares_near_a_junction_are_those_of_the_geometry():
    net = streets(cross(*THREE, both=False))
    noon = "2014-06-16T12:00"
    rows = seen(*((f"{name}_out", noon, "free") for name in ("north", "west")),
                ("east_out", noon, "slow"))  # fmt: skip
    near, wide = junction_shares(rows, net, OPTIONS)
    # Every street has 25 (50) of its 200 m within reach.
    assert near.all_share == pytest.approx(25 / 200, rel=0.01)
    assert near.occupied_share == pytest.approx(25 / 200, rel=0.01)
    assert wide.all_share == pytest.approx(50 / 200, rel=0.01)
    assert "within 25 m of a junction" in near.text()


def test_a_short_jam_at_a_junction_has_a_larger_share_than_the_streets():
    town = cross(*THREE, ("south", (0, -30)), both=False)
    noon = "2014-06-16T12:00"
    rows = seen(*((f"{name}_out", noon, "free") for name in ("north", "west", "east")),
                ("south_out", noon, "slow"))  # fmt: skip
    near = junction_shares(rows, streets(town), OPTIONS)[0]
    assert near.occupied_share == pytest.approx(25 / 30, rel=0.01)
    assert near.all_share == pytest.approx(100 / 630, rel=0.01)


def test_without_occupied_length_there_is_no_share():
    rows = seen(("east_out", "2014-06-16T12:00", "free"))
    share = junction_shares(rows, streets(cross(*THREE)), OPTIONS)[0]
    assert share.occupied_share is None
    assert ": - %" in share.text()


def jam(*points):
    """Return one observed line through points given in metres from the origin."""
    x, y = np.add(ORIGIN, np.array(points, dtype=float)).T
    line = np.empty(1, dtype=object)
    line[0] = shapely.LineString(np.column_stack(crs.transform(x, y, CRS(2157), crs.WGS84)))
    return Observations.from_columns(["jam"], ["2014-06-16T12:00"], ["slow"], line=line)


def test_a_line_is_joined_to_the_direction_along_which_it_runs():
    net = streets(cross(*THREE))
    assert match_lines(jam((0, 3), (200, 3)), net).segment_id.tolist() == ["east_out"]
    assert match_lines(jam((200, 3), (0, 3)), net).segment_id.tolist() == ["east_in"]


def test_a_line_through_a_junction_joins_both_streets_and_not_the_crossing_one():
    net = streets(cross(*THREE))
    joined = match_lines(jam((-200, 2), (200, 2)), net)
    assert sorted(joined.segment_id) == ["east_out", "west_in"]
    assert joined.status.tolist() == ["slow", "slow"]


def test_less_than_half_of_a_street_is_not_joined_and_is_told(caplog):
    net = streets(cross(*THREE))
    assert len(match_lines(jam((0, 0), (80, 0)), net)) == 0
    assert "1 of 1 observed lines match no segment" in caplog.text


def test_an_observation_without_a_line_keeps_its_segment():
    net = streets(cross(*THREE))
    kept = match_lines(seen(("north_in", "2014-06-16T12:00", "free")), net)
    assert kept.segment_id.tolist() == ["north_in"]


def test_the_state_of_a_moment_is_that_of_each_piece():
    net = streets(network({"a": 100, "b": 100}))
    rows = seen(("b", "2014-06-16T12:00", "slow"), ("a", "2014-06-17T12:00", "free"))
    status, _, on, window = states_at(rows, net, OPTIONS)
    assert dict(zip(net.segment_id, status, strict=True)) == {"a": "unknown", "b": "slow"}
    assert (on, window) == (date(2014, 6, 16), "noon")


@pytest.mark.parametrize("wrong", [{"day": date(2014, 7, 1)}, {"window": "midnight"}])
def test_a_day_or_window_that_is_not_there_is_refused(wrong):
    net = streets(network({"a": 100}))
    with pytest.raises(OptionError):
        states_at(seen(("a", "2014-06-16T12:00", "slow")), net, OPTIONS, **wrong)


def test_sensitivity_shows_that_the_profile_decides():
    net = streets(network({"a": 100, "b": 100}))
    rows = Observations.from_columns(
        ["a", "b"], ["2014-06-16T12:00"] * 2, ["slow", "slow"], relative_speed=[0.70, 0.12]
    )
    found = {
        (v.profile, len(v.occupied)): v.table.cells[0].percent
        for v in sensitivity(rows, net, OPTIONS)
    }
    # 0.70 is slow for all but the feed profile (0.625); 0.12 stands for both of TomTom's.
    assert found["datex", 3] == found["tomtom-tile", 3] == pytest.approx(100)
    assert found["tomtom-feed", 3] == pytest.approx(50)
    assert found["datex", 1] == pytest.approx(0)
    assert found["tomtom-tile", 1] == found["tomtom-feed", 1] == pytest.approx(50)


def test_sensitivity_keeps_statuses_that_no_speed_explains():
    net = streets(network({"a": 100}))
    found = sensitivity(seen(("a", "2014-06-16T12:00", "slow")), net, OPTIONS)
    assert [(v.profile, v.table.cells[0].percent) for v in found] == [
        (None, 100.0), (None, 0.0), (None, 0.0),
    ]  # fmt: skip


def test_streets_that_cross_without_ending_meet_at_a_junction():
    x, y = ORIGIN
    lines = [
        shapely.LineString([(x - 100, y), (x + 100, y)]),
        shapely.LineString([(x, y - 100), (x, y + 100)]),
    ]
    net = streets(gpd.GeoDataFrame({"segment_id": ["a", "b"]}, geometry=lines, crs=2157))
    assert junctions(net).tolist() == [list(ORIGIN)]


def test_a_free_flow_speed_of_the_network_makes_speeds_relative():
    town = network({"a": 100, "b": 100, "c": 100}, free_flow_kmh=[72.0, 72.0, None])
    rows = Observations.from_columns(
        ["a", "b", "c"],
        ["2014-06-16T12:00"] * 3,
        ["unknown", "closed", "free"],
        speed_mps=[10.0, 5.0, 5.0],
    )
    found = with_free_flow(rows, town)
    assert found.status.tolist() == ["slow", "closed", "free"]
    assert found.relative_speed[:2].tolist() == pytest.approx([0.5, 0.25])
    assert np.isnan(found.relative_speed[2])

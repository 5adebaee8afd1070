"""DATEX II v2: the real excerpts, and invented publications for what they lack."""

import io
from datetime import datetime

import numpy as np
import pytest

from covertool.congestion.clock import zone
from covertool.congestion.feeds.protocol import FeedOptions, Site
from covertool.congestion.feeds.sites import read_sites
from covertool.congestion.status import profile_named
from covertool.errors import FileError
from tests.congestion.feedtools import read, statuses
from tests.congestion.town import SHARED

needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="shared data is not here")
XSI = 'xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"'


def publication(body, version="2/2_0"):
    return (
        f'<d2LogicalModel xmlns="http://datex2.eu/schema/{version}" {XSI}><payloadPublication>'
        f"<publicationTime>2014-06-16T12:00:00Z</publicationTime>{body}"
        "</payloadPublication></d2LogicalModel>"
    )


def site(place, values):
    return (
        f'<siteMeasurements><measurementSiteReference id="{place}"/>'
        "<measurementTimeDefault>2014-06-16T11:59:00Z</measurementTimeDefault>"
        f"<measuredValue><measuredValue><basicData>{values}</basicData></measuredValue>"
        "</measuredValue></siteMeasurements>"
    )


def status(word):
    return f"<trafficStatus><trafficStatusValue>{word}</trafficStatusValue></trafficStatus>"


def situation(record_id, version, body, kind="AbnormalTraffic"):
    return (
        f'<situation id="S{record_id}"><situationRecord xsi:type="{kind}" id="{record_id}"'
        f' version="{version}">{body}</situationRecord></situation>'
    )


def validity(start="2014-06-16T10:00:00Z", end=None, status_="active"):
    until = f"<overallEndTime>{end}</overallEndTime>" if end else ""
    return (
        f"<validity><validityStatus>{status_}</validityStatus><validityTimeSpecification>"
        f"<overallStartTime>{start}</overallStartTime>{until}"
        "</validityTimeSpecification></validity>"
    )


def abnormal(word):
    return f"<abnormalTrafficType>{word}</abnormalTrafficType>"


@needs_shared
def test_the_real_measured_data_import():
    raw = (SHARED / "bisonfute_traficolor_excerpt.xml").read_bytes()
    seen = read("datex2", raw, tz=zone("Europe/Paris"))
    assert statuses(seen) == {"M7777.B1": "free", "MA279.Z1": "very_slow"}
    assert seen.time.tolist() == [datetime(2026, 8, 31, 20, 40, 40)] * 2


@needs_shared
def test_a_real_broken_down_vehicle_tells_nothing_about_the_flow(caplog):
    assert len(read("datex2", (SHARED / "france_events.xml").read_bytes())) == 0
    assert "VehicleObstruction tells no traffic status" in caplog.text


@needs_shared
def test_the_real_site_directory_gives_lines_about_as_long_as_it_says():
    with (SHARED / "bisonfute_refDir_excerpt.csv").open("rb") as file:
        places = read_sites(file, FeedOptions())
    # Column 13 of the directory holds the length along the road: 3035 m and 834 m.
    assert places["MUM76.h1"].length_m == pytest.approx(3035, rel=0.2)
    lon, lat = places["MUM76.h1"].line.coords[0]
    assert (lon, lat) == (pytest.approx(1.2, abs=0.05), pytest.approx(49.5, abs=0.05))


def test_words_of_version_2_are_understood():
    body = "".join(site(w, status(w)) for w in ("freeFlow", "heavy", "congested", "impossible"))
    assert statuses(read("datex2", publication(body))) == {
        "freeFlow": "free", "heavy": "slow", "congested": "very_slow", "impossible": "stationary",
    }  # fmt: skip


def test_version_3_is_refused():
    with pytest.raises(FileError, match="version 3"):
        read("datex2", publication(site("a", status("heavy")), "3/d2Payload"))


def test_travel_time_over_free_flow_time_is_a_relative_speed():
    values = (
        "<travelTime><duration>200</duration></travelTime>"
        "<freeFlowTravelTime><duration>60</duration></freeFlowTravelTime>"
    )
    seen = read("datex2", publication(site("a", values)))
    assert (seen.status[0], seen.relative_speed[0]) == ("slow", pytest.approx(0.3))


def test_speeds_are_kilometres_an_hour():
    values = "<averageVehicleSpeed><speed>36</speed></averageVehicleSpeed>"
    seen = read("datex2", publication(site("a", values)), free_speed_mps=20.0)
    assert (seen.speed_mps[0], seen.relative_speed[0]) == (pytest.approx(10), pytest.approx(0.5))


def elaborated(listed, group="G", default="freeFlow"):
    data = "".join(
        "<elaboratedData><basicData><pertinentLocation>"
        f'<predefinedLocationReference id="{place}"/></pertinentLocation>{status(word)}'
        "</basicData></elaboratedData>"
        for place, word in listed.items()
    )
    settings = (
        f'<referenceSettings><predefinedNonOrderedLocationGroupReference id="{group}"/>'
        f"<trafficStatusDefault>{default}</trafficStatusDefault></referenceSettings>"
    )
    return publication(settings + data)


def test_the_default_status_holds_for_locations_not_listed():
    places = {place: Site(f"seg-{place}", groups=frozenset("G")) for place in "abc"}
    places["z"] = Site("elsewhere", groups=frozenset("H"))
    seen = read("datex2", elaborated({"a": "congested"}), sites=places)
    assert statuses(seen) == {"seg-a": "very_slow", "seg-b": "free", "seg-c": "free"}


def test_a_default_without_a_site_table_is_told(caplog):
    assert statuses(read("datex2", elaborated({"a": "heavy"}))) == {"a": "slow"}
    assert "--sites" in caplog.text


def test_a_site_table_in_datex_names_lines_and_groups():
    point = "<latitude>{}</latitude><longitude>{}</longitude>"
    table = publication(
        '<predefinedLocationContainer id="G">'
        f'<predefinedLocation id="a">{point.format(53, -6)}{point.format(54, -7)}'
        '</predefinedLocation><predefinedLocation id="b"/></predefinedLocationContainer>'
        '<measurementSiteRecord id="m"/>'
    )
    places = read_sites(io.BytesIO(table.encode()), FeedOptions())
    assert set(places) == {"a", "b", "m"}
    assert list(places["a"].line.coords) == [(-6, 53), (-7, 54)]
    assert places["b"].groups == {"G"}
    seen = read("datex2", elaborated({"a": "heavy"}), sites=places)
    assert statuses(seen) == {"a": "slow", "b": "free"}


def test_of_several_versions_the_latest_counts_in_either_order():
    old = situation("r", 9, validity() + abnormal("stationaryTraffic"))
    new = situation("r", 10, validity() + abnormal("slowTraffic"))
    for body in (old + new, new + old):
        assert statuses(read("datex2", publication(body))) == {"r": "slow"}


def test_a_situation_holds_from_its_start_to_its_end():
    body = situation("r", 1, validity(end="2014-06-16T18:00:00Z") + abnormal("queuingTraffic"))
    seen = read("datex2", publication(body))
    assert seen.status[0] == "very_slow"
    assert seen.time[0] == np.datetime64("2014-06-16T10:00", "us")
    assert seen.until[0] == np.datetime64("2014-06-16T18:00", "us")


def test_a_situation_without_an_end_holds_until_the_publication():
    seen = read("datex2", publication(situation("r", 1, validity() + abnormal("slowTraffic"))))
    assert seen.until[0] == np.datetime64("2014-06-16T12:00", "us")


def test_an_ended_situation_holds_until_the_version_that_ended_it():
    ended = (
        "<situationRecordVersionTime>2014-06-16T11:00:00Z</situationRecordVersionTime>"
        "<management><lifeCycleManagement><end>true</end></lifeCycleManagement></management>"
    )
    body = situation("r", 2, ended + validity() + abnormal("slowTraffic"))
    assert read("datex2", publication(body)).until[0] == np.datetime64("2014-06-16T11:00", "us")


def test_a_cancelled_or_suspended_situation_is_left_out(caplog):
    cancelled = "<lifeCycleManagement><cancel>true</cancel></lifeCycleManagement>"
    body = situation("r", 2, cancelled + validity() + abnormal("slowTraffic"))
    body += situation("s", 1, validity(status_="suspended") + abnormal("slowTraffic"))
    assert len(read("datex2", publication(body))) == 0
    assert "2 records left out: cancelled" in caplog.text


def test_a_closed_road_is_closed_and_a_closed_lane_is_not():
    management = "<roadOrCarriagewayOrLaneManagementType>{}</roadOrCarriagewayOrLaneManagementType>"
    kind = "RoadOrCarriagewayOrLaneManagement"
    body = situation("road", 1, validity() + management.format("roadClosed"), kind)
    body += situation("lane", 1, validity() + management.format("laneClosures"), kind)
    assert statuses(read("datex2", publication(body))) == {"road": "closed"}


def test_a_profile_of_bands_alone_leaves_the_feeds_words_alone():
    times = (
        "<travelTime><duration>100</duration></travelTime>"
        "<freeFlowTravelTime><duration>30</duration></freeFlowTravelTime>"
    )
    body = site("word", status("heavy")) + site("speed", times)
    tile = profile_named("tomtom-tile")
    # A relative speed of 0.30 is slow by DATEX II (0.25) and very slow by the tiles (0.35).
    assert statuses(read("datex2", publication(body))) == {"word": "slow", "speed": "slow"}
    assert statuses(read("datex2", publication(body), profile=tile)) == {
        "word": "slow", "speed": "very_slow",
    }  # fmt: skip

"""Waze and TomTom."""

import json
from collections import Counter
from datetime import UTC, datetime

import numpy as np
import pytest

from covertool.congestion.feeds.protocol import Limits
from covertool.errors import ColumnError, FileError
from tests.congestion.feedtools import read, statuses
from tests.congestion.town import SHARED

needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="shared data is not here")
START = 1_550_675_460_000


def jams(*given, **head):
    return json.dumps({"startTimeMillis": START, "endTimeMillis": START + 60_000, **head,
                       "jams": list(given)})  # fmt: skip


def jam(uuid, level, delay=30, **more):
    return {"uuid": uuid, "level": level, "delay": delay, **more}


@needs_shared
def test_the_real_waze_file_has_38_closures_and_nothing_stationary():
    seen = read("waze", (SHARED / "louisville_SampeData1.json").read_bytes())
    assert Counter(seen.status.tolist()) == {"closed": 38, "very_slow": 10, "slow": 2}
    assert set(seen.time.tolist()) == {datetime(2019, 2, 20, 15, 11)}
    assert all(line is not None for line in seen.line)


def test_a_delay_of_minus_one_is_a_closure_at_any_level():
    assert statuses(read("waze", jams(jam(1, 5, -1), jam(2, 3, -1), jam(3, 4)))) == {
        "1": "closed", "2": "closed", "3": "very_slow",
    }  # fmt: skip


def test_a_jam_is_seen_in_its_snapshot_and_not_when_it_began():
    seen = read("waze", jams(jam(1, 3, pubMillis=START - 30_000_000)))
    assert seen.time[0] == np.datetime64(START, "ms")
    assert seen.until[0] == np.datetime64(START + 60_000, "ms")


def test_speed_is_metres_a_second_and_speed_kmh_is_not(caplog):
    seen = read("waze", jams(jam(1, 3, speed=2.5, speedKMH=9.0), jam(2, 3, speedKMH=9.0)))
    assert seen.speed_mps.tolist() == pytest.approx([2.5, 2.5])
    read("waze", jams(jam(1, 3, speed=9.0, speedKMH=9.0)))
    assert "9 m/s and 9 km/h" in caplog.text


def test_an_unknown_level_is_refused():
    with pytest.raises(ColumnError, match="'7'"):
        read("waze", jams(jam(1, 7)))


FLOW = {"currentSpeed": 10, "freeFlowSpeed": 50, "roadClosure": False,
        "coordinates": {"coordinate": [{"latitude": 53.3, "longitude": -6.2},
                                       {"latitude": 53.4, "longitude": -6.1}]}}  # fmt: skip
NOON = datetime(2014, 6, 16, 12, tzinfo=UTC)


def flow(**more):
    return json.dumps({"flowSegmentData": {**FLOW, **more}})


@needs_shared
def test_the_real_tomtom_file_is_one_free_segment():
    raw = (SHARED / "flowSegmentData_nijmegen.json").read_bytes()
    seen = read("tomtom", raw, time=NOON)
    assert seen.status.tolist() == ["free"]
    assert seen.speed_mps[0] == pytest.approx(25 / 3.6)
    assert len(seen.line[0].coords) == 16


def test_tomtom_gives_a_relative_speed_and_needs_a_time():
    seen = read("tomtom", flow(), time=NOON)
    assert (seen.status[0], seen.relative_speed[0]) == ("very_slow", pytest.approx(0.2))
    with pytest.raises(ColumnError, match="no time"):
        read("tomtom", flow())


def test_a_closed_road_is_closed_whatever_its_speed():
    assert read("tomtom", flow(roadClosure=True), time=NOON).status[0] == "closed"


def test_miles_an_hour_are_converted_when_asked_for():
    seen = read("tomtom", flow(), time=NOON, speed_unit="mph")
    assert seen.speed_mps[0] == pytest.approx(4.4704)


@pytest.mark.parametrize("name", ["waze", "tomtom"])
@pytest.mark.parametrize(
    "text",
    ["", "{", '{"jams": [', "[1, 2]", "not json", "{}", '{"jams": 3}', "[" * 100_000,
     '{"jams": ' + "[" * 200_000, '{"jams": [3]}', '{"flowSegmentData": []}'],
)  # fmt: skip
def test_json_at_fault_is_a_file_error(name, text):
    with pytest.raises(FileError):
        read(name, text, time=NOON)


def test_json_beyond_the_cap_is_refused():
    with pytest.raises(FileError, match="larger than"):
        read("waze", jams(jam(1, 3, street="x" * 2000)), limits=Limits(text_bytes=1000))

"""Whatever is done to a feed's bytes, it is read or refused with an error that a user can mend."""

import contextlib
from datetime import UTC, datetime

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from covertool.congestion.clock import zone
from covertool.errors import CovertoolError
from tests.congestion.feedtools import read

FEEDS = {
    "csv": b"segment_id,time,status,relative_speed,queue_m\na,2014-06-16T12:00Z,slow,0.5,3\n"
    b"b,2014-06-16T12:01:00,free,,\n",
    "waze": b'{"startTimeMillis":1550675460000,"endTimeMillis":1550675520000,"jams":[{"uuid":7,'
    b'"level":3,"delay":5,"speed":1.5,"speedKMH":5.4,"line":[{"x":-85.7,"y":38.2},'
    b'{"x":-85.6,"y":38.3}]}]}',
    "tomtom": b'{"flowSegmentData":{"currentSpeed":25,"freeFlowSpeed":50,"roadClosure":false,'
    b'"coordinates":{"coordinate":[{"latitude":1,"longitude":2},{"latitude":3,"longitude":4}]}}}',
    "sumo": b'<meandata><interval begin="0.00" end="900.00"><edge id="a" sampledSeconds="60"'
    b' speed="2.0" speedRelative="0.14"/></interval></meandata>',
    "datex2": b'<d2LogicalModel xmlns="http://datex2.eu/schema/2/2_0"><payloadPublication>'
    b"<publicationTime>2014-06-16T12:00:00Z</publicationTime><siteMeasurements>"
    b'<measurementSiteReference id="M"/><trafficStatus><trafficStatusValue>heavy'
    b"</trafficStatusValue></trafficStatus></siteMeasurements><situation><situationRecord"
    b' id="r" version="2"><abnormalTrafficType>slowTraffic</abnormalTrafficType><latitude>1'
    b"</latitude><longitude>2</longitude></situationRecord></situation>"
    b"</payloadPublication></d2LogicalModel>",
    "trips": b"STT,TCS1,TCS2,Time\n36,10,11,2014-06-16 13:00:00\n",
}
OPTIONS = {
    "tz": zone("Europe/Dublin"), "time": datetime(2014, 6, 16, tzinfo=UTC), "free_speed_mps": 13.9,
}  # fmt: skip
TOKENS = (
    b'|\x00|-1|1e999|nan|null|[]|{}|"|<|</|&x;|9999999999999999999999|\xff\xfe|,|\n|true'
    b"|<!DOCTYPE a>|0001-01-01T00:00"
).split(b"|")
PUT = st.sampled_from(TOKENS) | st.binary(max_size=4)


@pytest.mark.parametrize("name", list(FEEDS))
@settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(st.tuples(st.floats(0, 1), st.integers(0, 12), PUT), min_size=1, max_size=4))
def test_a_damaged_feed_is_read_or_refused(name, cuts):
    raw = FEEDS[name]
    for place, removed, put in cuts:
        at = int(place * len(raw))
        raw = raw[:at] + put + raw[at + removed :]
    with contextlib.suppress(CovertoolError):
        read(name, raw, **OPTIONS)


@pytest.mark.parametrize("name", list(FEEDS))
def test_the_undamaged_feeds_are_read(name):
    assert len(read(name, FEEDS[name], **OPTIONS)) >= 1

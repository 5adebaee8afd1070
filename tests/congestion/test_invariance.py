"""What must not change the table, and what may change it one way only."""

from datetime import time

import geopandas as gpd
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from covertool.congestion.clock import zone
from covertool.congestion.occupancy import occupancy_table
from covertool.congestion.options import OccupancyOptions
from covertool.congestion.status import ORDERED, SCALE
from tests.congestion.town import network, seen

OPTIONS = OccupancyOptions(zone("UTC"), windows={"noon": time(12)}, min_coverage=0.3)
IDS = ("a", "b", "c", "d")

lengths = st.lists(st.floats(10, 900), min_size=4, max_size=4)
rows = st.lists(
    st.tuples(st.sampled_from(IDS), st.integers(-15, 15), st.sampled_from(SCALE)),
    min_size=1,
    max_size=25,
)


def observed(given):
    return [
        (segment, str(np.datetime64("2014-06-16T12:00") + np.timedelta64(minute, "m")), status)
        for segment, minute, status in given
    ]


def percent(observations, town, options=OPTIONS):
    found = occupancy_table(observations, town, options).cells[0]
    return found.percent, found.filled_percent, found.observed_fraction


@settings(max_examples=25, deadline=None)
@given(lengths, rows, st.floats(0.05, 0.95))
def test_splitting_a_segment_changes_nothing(sizes, given_rows, cut):
    town = network(dict(zip(IDS, sizes, strict=True)))
    whole = percent(seen(*observed(given_rows)), town)
    line = town.geometry.iloc[0]
    middle = line.interpolate(cut, normalized=True)
    start, end = (shapely.Point(line.coords[i]) for i in (0, 1))
    halves = [shapely.LineString([start, middle]), shapely.LineString([middle, end])]
    split = gpd.GeoDataFrame(
        {"segment_id": ["a1", "a2", *IDS[1:]]},
        geometry=[*halves, *town.geometry.iloc[1:]],
        crs=2157,
    )
    doubled = [
        (name, time_, status)
        for segment, time_, status in observed(given_rows)
        for name in (("a1", "a2") if segment == "a" else (segment,))
    ]
    assert percent(seen(*doubled), split) == pytest.approx(whole)


@settings(max_examples=25, deadline=None)
@given(lengths, rows, st.randoms(use_true_random=False))
def test_the_order_of_rows_changes_nothing(sizes, given_rows, random):
    town = network(dict(zip(IDS, sizes, strict=True)))
    table = observed(given_rows)
    shuffled = list(table)
    random.shuffle(shuffled)
    mixed = town.sample(frac=1, random_state=random.randint(0, 1000))
    assert percent(seen(*shuffled), mixed) == pytest.approx(percent(seen(*table), town))


@settings(max_examples=25, deadline=None)
@given(lengths, rows, st.sets(st.sampled_from(ORDERED), min_size=1))
def test_a_larger_occupied_set_never_flags_less(sizes, given_rows, chosen):
    town = network(dict(zip(IDS, sizes, strict=True)))
    observations = seen(*observed(given_rows))

    def flagged(occupied):
        options = OccupancyOptions(
            OPTIONS.tz, OPTIONS.windows, occupied=occupied, min_coverage=OPTIONS.min_coverage
        )
        return percent(observations, town, options)[0]

    small = flagged(tuple(chosen))
    for more in ORDERED:
        large = flagged((*chosen, more))
        assert (small is None) == (large is None)
        assert small is None or large >= small - 1e-9


@settings(max_examples=20, deadline=None)
@given(lengths, rows)
def test_every_percentage_lies_between_0_and_100(sizes, given_rows):
    town = network(dict(zip(IDS, sizes, strict=True)))
    flagged, filled, known = percent(seen(*observed(given_rows)), town)
    assert 0 <= known <= 1 + 1e-12
    assert flagged is None or (0 <= flagged <= 100 + 1e-9 and 0 <= filled <= 100 + 1e-9)

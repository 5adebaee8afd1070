import dataclasses
from datetime import date, time, timedelta

import geopandas as gpd
import numpy as np
import pytest
import shapely

from covertool.congestion.clock import zone
from covertool.congestion.occupancy import confidence_95, occupancy_table
from covertool.congestion.options import RUSH_HOURS, OccupancyOptions, hourly
from covertool.congestion.rounding import half_up
from covertool.errors import ColumnError, OptionError
from covertool.model import Observations
from tests.congestion.town import network, seen

NOON = {"noon": time(12)}


def options(**changes):
    given = {"tz": zone("UTC"), "windows": NOON, "min_coverage": 0.0, **changes}
    return OccupancyOptions(**given)


def cell(observations, segments, *, weight="directed", aoi=None, **changes):
    table = occupancy_table(observations, segments, options(**changes), weight=weight, aoi=aoi)
    return table.cells[0]


def test_a_cell_is_occupied_length_over_known_length():
    town = network({"a": 100, "b": 300})
    found = cell(seen(("a", "2014-06-16T12:00", "slow"), ("b", "2014-06-16T12:00", "free")), town)
    assert found.percent == pytest.approx(25.0)
    assert found.observed_fraction == 1.0


def test_a_closed_street_counts_in_neither_length_but_is_known():
    town = network({"a": 100, "b": 300, "c": 600})
    found = cell(
        seen(
            ("a", "2014-06-16T12:00", "slow"),
            ("b", "2014-06-16T12:00", "free"),
            ("c", "2014-06-16T12:00", "closed"),
        ),
        town,
    )
    assert (found.percent, found.observed_fraction) == (pytest.approx(25.0), pytest.approx(1.0))


def test_missing_is_unknown_and_not_free():
    town = network({"a": 100, "b": 300})
    only_a = seen(("a", "2014-06-16T12:00", "slow"))
    found = cell(only_a, town)
    assert (found.percent, found.observed_fraction) == (pytest.approx(100.0), 0.25)
    assert cell(only_a, town, absent_is_free=True).percent == pytest.approx(25.0)


def test_absent_is_free_needs_a_living_feed():
    town = network({"a": 100})
    morning = seen(("a", "2014-06-16T08:00", "slow"))
    assert cell(morning, town, absent_is_free=True).percent is None


def test_a_cell_observed_below_the_minimum_is_blank():
    town = network({"a": 79, "b": 21})
    only_a = seen(("a", "2014-06-16T12:00", "slow"))
    assert cell(only_a, town, min_coverage=0.8).percent is None
    assert cell(only_a, town, min_coverage=0.79).percent == pytest.approx(100.0)


def test_the_nearest_observation_counts():
    town = network({"a": 100})
    both = seen(("a", "2014-06-16T11:57", "free"), ("a", "2014-06-16T12:02", "slow"))
    assert cell(both, town).percent == pytest.approx(100.0)


def test_of_two_at_one_distance_the_earlier_counts():
    town = network({"a": 100})
    tied = seen(("a", "2014-06-16T12:03", "free"), ("a", "2014-06-16T11:57", "slow"))
    assert cell(tied, town).percent == pytest.approx(100.0)


def test_of_two_at_one_time_the_worse_counts():
    town = network({"a": 100})
    rows = [("a", "2014-06-16T12:00", "slow"), ("a", "2014-06-16T12:00", "free")]
    assert cell(seen(*rows), town).percent == cell(seen(*rows[::-1]), town).percent == 100.0


def test_the_tolerance_is_closed_at_its_end():
    town = network({"a": 100})
    at_the_end = seen(("a", "2014-06-16T12:10", "slow"))
    beyond = seen(("a", "2014-06-16T12:10:01", "slow"))
    assert cell(at_the_end, town).percent == 100.0
    assert cell(beyond, town).percent is None


def test_an_interval_that_holds_the_window_is_at_distance_zero():
    town = network({"a": 100})
    interval = Observations.from_columns(
        ["a", "a"],
        ["2014-06-16T08:00", "2014-06-16T12:01"],
        ["slow", "free"],
        until=["2014-06-16T12:00:30", "NaT"],
    )
    assert cell(interval, town).percent == 100.0


def test_two_mondays_average_to_one_cell_and_to_two_days():
    town = network({"a": 100, "b": 100})
    rows = [
        (segment, f"2014-06-{day}T12:00", status)
        for day, segment, status in [
            (16, "a", "slow"), (16, "b", "slow"), (17, "a", "free"), (17, "b", "free"),
            (23, "a", "slow"), (23, "b", "free"),
        ]
    ]  # fmt: skip
    by_cells = occupancy_table(seen(*rows), town, options())
    by_days = occupancy_table(seen(*rows), town, options(mean_of="days"))
    monday, tuesday = by_cells.cells
    assert (monday.percent, monday.days) == (pytest.approx(75.0), 2)
    assert (tuesday.percent, tuesday.days) == (pytest.approx(0.0), 1)
    assert by_cells.means[0].percent == pytest.approx(37.5)
    assert by_days.means[0].percent == pytest.approx(50.0)
    assert by_days.means[0].count == 3


def test_an_interval_of_confidence_needs_three_values():
    assert confidence_95([1.0, 2.0]) is None
    low, high = confidence_95([10.0, 12.0, 14.0])
    # Student's t for two degrees of freedom at 97.5 % is 4.30265; SD 2, n 3.
    assert (high - low) / 2 == pytest.approx(4.30265 * 2 / np.sqrt(3), rel=1e-5)
    low, high = confidence_95([10.0, 12.0, 14.0, 16.0])
    # For three degrees of freedom 3.18245; SD sqrt(20 / 3), n 4.
    assert (high - low) / 2 == pytest.approx(3.18245 * np.sqrt(20 / 3) / 2, rel=1e-5)


def test_the_rush_hours_are_those_of_the_paper():
    assert OccupancyOptions(zone("UTC")).windows == RUSH_HOURS
    assert {"lunch": time(13), "evening": time(19, 30)} == RUSH_HOURS


def test_options_do_not_change_once_made():
    with pytest.raises(dataclasses.FrozenInstanceError):
        options().min_coverage = 2.0


def test_by_the_hour_every_moment_of_a_day_lies_in_a_window():
    by_hour = hourly(options(tolerance=timedelta(minutes=10)))
    assert by_hour.windows == {f"{hour:02d}": time(hour) for hour in range(24)}
    assert by_hour.tolerance == timedelta(minutes=40)
    table = occupancy_table(seen(("a", "2014-06-16T12:30", "slow")), network({"a": 100}), by_hour)
    found = {cell.window for cell in table.cells if cell.percent is not None}
    assert found == {"12", "13"}


def test_a_holiday_is_kept_apart():
    town = network({"a": 100})
    rows = seen(("a", "2014-06-02T12:00", "slow"), ("a", "2014-06-09T12:00", "free"))
    table = occupancy_table(rows, town, options(holidays={date(2014, 6, 2)}))
    assert {c.day: c.percent for c in table.cells} == {"Monday": 0.0, "Holiday": 100.0}
    assert {m.group: m.percent for m in table.means} == {"weekday": 0.0, "holiday": 100.0}


def test_windows_follow_the_clock_through_the_change_to_winter_time():
    town = network({"a": 100})
    # One o'clock in Dublin is 12:00 UTC on 24 October and 13:00 UTC on 27 October.
    rows = seen(("a", "2014-10-24T12:00", "slow"), ("a", "2014-10-27T13:00", "slow"))
    table = occupancy_table(
        rows, town, options(tz=zone("Europe/Dublin"), windows={"lunch": time(13)})
    )
    assert [c.percent for c in table.cells] == [100.0, 100.0]


def test_a_day_whose_clock_skips_the_window_has_no_figure(caplog):
    town = network({"a": 100})
    rows = seen(("a", "2015-03-29T00:55", "slow"), ("a", "2015-03-29T01:05", "slow"))
    table = occupancy_table(
        rows, town, options(tz=zone("Europe/Dublin"), windows={"night": time(1, 30)})
    )
    assert not table.cells
    assert "skip" in caplog.text


def test_lanes_weigh_when_asked():
    town = network({"a": 100, "b": 100}, lanes=[3, 1])
    rows = seen(("a", "2014-06-16T12:00", "slow"), ("b", "2014-06-16T12:00", "free"))
    assert cell(rows, town).percent == pytest.approx(50.0)
    assert cell(rows, town, weight="lane").percent == pytest.approx(75.0)


def test_undirected_counts_a_two_way_street_once():
    there = shapely.LineString([(0, 0), (100, 0)])
    one_way = shapely.LineString([(0, 50), (100, 50)])
    town = gpd.GeoDataFrame(
        {"segment_id": ["there", "back", "one"]},
        geometry=[there, there.reverse(), one_way],
        crs=2157,
    )
    rows = seen(
        ("there", "2014-06-16T12:00", "slow"),
        ("back", "2014-06-16T12:00", "free"),
        ("one", "2014-06-16T12:00", "free"),
    )
    assert cell(rows, town).percent == pytest.approx(100 / 3)
    assert cell(rows, town, weight="undirected").percent == pytest.approx(25.0)


def test_a_segment_given_twice_counts_once(caplog):
    town = network({"a": 100, "b": 100})
    twice = gpd.GeoDataFrame(
        {"segment_id": ["a", "b", "b"]}, geometry=town.geometry.iloc[[0, 1, 1]].values, crs=2157
    )
    rows = seen(("a", "2014-06-16T12:00", "slow"), ("b", "2014-06-16T12:00", "free"))
    assert cell(rows, twice).percent == pytest.approx(50.0)
    assert "twice" in caplog.text


def test_two_ids_on_one_line_share_its_length(caplog):
    town = network({"a": 100, "b": 100})
    shared = gpd.GeoDataFrame(
        {"segment_id": ["a", "b", "b2"]}, geometry=town.geometry.iloc[[0, 1, 1]].values, crs=2157
    )
    rows = seen(
        ("a", "2014-06-16T12:00", "free"),
        ("b", "2014-06-16T12:00", "slow"),
        ("b2", "2014-06-16T12:00", "slow"),
    )
    assert cell(rows, shared).percent == pytest.approx(50.0)
    assert "share its length" in caplog.text


def test_length_under_two_segments_the_same_way_counts_once(caplog):
    lines = [shapely.LineString([(0, 0), (100, 0)]), shapely.LineString([(60, 0), (200, 0)])]
    town = gpd.GeoDataFrame({"segment_id": ["a", "b"]}, geometry=lines, crs=2157)
    rows = seen(("a", "2014-06-16T12:00", "slow"), ("b", "2014-06-16T12:00", "free"))
    # 200 m of street; the shared 40 m go half to each: 80 m of 200 m.
    assert cell(rows, town).percent == pytest.approx(40.0)
    assert "overlap along 40 m" in caplog.text


def test_length_under_two_segments_of_opposite_ways_counts_twice():
    lines = [shapely.LineString([(0, 0), (100, 0)]), shapely.LineString([(200, 0), (60, 0)])]
    town = gpd.GeoDataFrame({"segment_id": ["a", "b"]}, geometry=lines, crs=2157)
    rows = seen(("a", "2014-06-16T12:00", "slow"), ("b", "2014-06-16T12:00", "free"))
    assert cell(rows, town).percent == pytest.approx(100 * 100 / 240)


def test_an_aoi_clips_the_streets():
    town = network({"a": 100, "b": 300})
    rows = seen(("a", "2014-06-16T12:00", "slow"), ("b", "2014-06-16T12:00", "free"))
    inside = shapely.box(-10, -10, 50, 200)
    assert cell(rows, town, aoi=inside).percent == pytest.approx(50.0)


def test_an_aoi_that_cuts_a_street_in_two_counts_both_parts():
    town = network({"a": 300, "b": 300})
    rows = seen(("a", "2014-06-16T12:00", "slow"), ("b", "2014-06-16T12:00", "free"))
    two_ends = shapely.union_all(
        [shapely.box(-10, -10, 100, 10), shapely.box(200, -10, 300, 10),
         shapely.box(-10, 90, 100, 110)]
    )  # fmt: skip
    assert cell(rows, town, aoi=two_ends).percent == pytest.approx(100 * 200 / 300)


def test_a_declared_length_far_from_the_measured_is_reported(caplog):
    town = network({"a": 100, "b": 100}, length_m=[109.0, 150.0])
    cell(seen(("a", "2014-06-16T12:00", "slow")), town)
    assert "1 segments declare a length that differs by over 10 %" in caplog.text


def test_observations_of_another_network_are_an_error():
    with pytest.raises(ColumnError, match="no observation belongs"):
        cell(seen(("z", "2014-06-16T12:00", "slow")), network({"a": 100}))


def test_filled_length_is_less_than_flagged_and_a_measured_queue_is_exact():
    town = network({"a": 100, "b": 100})
    rows = Observations.from_columns(
        ["a", "b"], ["2014-06-16T12:00"] * 2, ["slow", "free"], queue_m=[31.0, np.nan]
    )
    found = cell(rows, town)
    assert (found.percent, found.filled_percent) == (pytest.approx(50.0), pytest.approx(15.5))


@pytest.mark.parametrize(
    "changes",
    [{"occupied": ("crawling",)}, {"occupied": ()}, {"min_coverage": 1.5}, {"mean_of": "weeks"}],
)
def test_options_out_of_range_are_refused(changes):
    with pytest.raises(OptionError):
        options(**changes)


def test_a_half_rounds_up_in_decimal():
    assert [half_up(v) for v in (13.025, 2.665, 0.005, 99.995)] == [
        "13.03",
        "2.67",
        "0.01",
        "100.00",
    ]


def test_tolerance_is_a_length_of_time():
    assert options().tolerance == timedelta(minutes=10)


def test_a_window_before_midnight_is_told_by_an_observation_after_it():
    town = network({"a": 100})
    rows = seen(("a", "2014-06-17T00:02", "slow"))
    table = occupancy_table(rows, town, options(windows={"late": time(23, 55)}))
    assert [(c.day, c.percent) for c in table.cells] == [("Monday", 100.0), ("Tuesday", None)]


def test_a_window_after_midnight_is_told_by_an_observation_before_it():
    rows = seen(("a", "2014-06-16T23:58", "slow"))
    table = occupancy_table(rows, network({"a": 100}), options(windows={"early": time(0, 2)}))
    assert [(c.day, c.percent) for c in table.cells] == [("Monday", None), ("Tuesday", 100.0)]


def test_a_day_near_an_observation_that_tells_nothing_of_it_is_left_out():
    rows = seen(("a", "2014-06-16T23:58", "slow"))
    table = occupancy_table(rows, network({"a": 100}), options())
    assert [day.date for day in table.days] == [date(2014, 6, 16)]


def test_a_street_shorter_than_a_metre_counts():
    rows = seen(("a", "2014-06-16T12:00", "slow"), ("b", "2014-06-16T12:00", "free"))
    found = cell(rows, network({"a": 0.25, "b": 0.5}))
    assert found.percent == pytest.approx(100 / 3)


def test_an_interval_over_two_days_tells_both():
    town = network({"a": 100})
    rows = Observations.from_columns(
        ["a"], ["2014-06-16T10:00"], ["slow"], until=["2014-06-17T18:00"]
    )
    table = occupancy_table(rows, town, options())
    assert [(c.day, c.percent) for c in table.cells] == [("Monday", 100.0), ("Tuesday", 100.0)]

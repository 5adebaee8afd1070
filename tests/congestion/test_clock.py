from datetime import date, datetime, time, timedelta

import numpy as np
import pytest

from covertool.congestion.clock import (
    instant,
    local_days,
    parse_instant,
    to_numpy,
    window_instant,
    zone,
)
from covertool.errors import ColumnError, OptionError

DUBLIN = zone("Europe/Dublin")


def utc(text: str) -> np.datetime64:
    return np.datetime64(text, "us")


def test_one_o_clock_in_summer_is_noon_utc_and_in_winter_it_is_not():
    assert window_instant(date(2014, 6, 16), time(13), DUBLIN) == utc("2014-06-16T12:00")
    assert window_instant(date(2014, 12, 1), time(13), DUBLIN) == utc("2014-12-01T13:00")


def test_the_october_fold_is_refused_until_it_is_chosen():
    twice = datetime(2014, 10, 26, 1, 30)
    with pytest.raises(ColumnError, match="twice"):
        instant(twice, DUBLIN, None, "x")
    early = instant(twice, DUBLIN, "earlier", "x")
    late = instant(twice, DUBLIN, "later", "x")
    assert to_numpy(early) == utc("2014-10-26T00:30")
    assert late - early == timedelta(hours=1)


def test_a_window_in_the_october_fold_is_the_first_of_the_two():
    assert window_instant(date(2014, 10, 26), time(1, 30), DUBLIN) == utc("2014-10-26T00:30")


def test_the_march_gap_holds_no_time():
    with pytest.raises(ColumnError, match="skip"):
        instant(datetime(2015, 3, 29, 1, 30), DUBLIN, "earlier", "x")
    assert window_instant(date(2015, 3, 29), time(1, 30), DUBLIN) is None


def test_a_naive_time_needs_a_zone_and_a_time_with_an_offset_does_not():
    with pytest.raises(ColumnError, match="no UTC offset"):
        parse_instant("2014-06-16T13:00:00", None, None, "x")
    assert to_numpy(parse_instant("2014-06-16T13:00+01:00", None, None, "x")) == utc(
        "2014-06-16T12:00"
    )


def test_late_evening_in_utc_is_the_next_day_in_dublin_in_summer():
    assert local_days(np.array([utc("2014-06-16T23:30")]), DUBLIN) == [date(2014, 6, 17)]


def test_local_days_hold_where_the_offset_has_quarter_hours():
    nepal = zone("Asia/Kathmandu")
    moments = np.array([utc("2014-06-16T18:14"), utc("2014-06-16T18:15")])
    assert local_days(moments, nepal) == [date(2014, 6, 16), date(2014, 6, 17)]


def test_an_unknown_zone_is_an_option_error():
    with pytest.raises(OptionError):
        zone("Europe/Atlantis")

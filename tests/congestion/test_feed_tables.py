"""CSV and Parquet observation tables, and their journey to disk and back."""

import numpy as np
import pytest
import shapely

from covertool.congestion.clock import zone
from covertool.congestion.status import parse_profile
from covertool.errors import ColumnError, FileError
from covertool.gis.observations import write_observations
from covertool.model import Observations
from tests.congestion.feedtools import read, statuses

HEAD = "segment_id,time,status\n"


def test_naive_times_are_refused_without_a_zone_and_read_in_it():
    text = HEAD + "a,2014-06-16T13:00:00,slow\n"
    with pytest.raises(ColumnError, match="no UTC offset"):
        read("csv", text)
    seen = read("csv", text, tz=zone("Europe/Dublin"))
    assert seen.time[0] == np.datetime64("2014-06-16T12:00", "us")


def test_kilometres_an_hour_and_metres_a_second_are_told_apart():
    kmh = read("csv", "segment_id,time,speed_kmh,free_flow_mps\na,2014-06-16T12:00Z,36,20\n")
    mps = read("csv", "segment_id,time,speed_mps,free_flow_kmh\na,2014-06-16T12:00Z,10,72\n")
    assert kmh.speed_mps[0] == mps.speed_mps[0] == pytest.approx(10.0)
    assert kmh.relative_speed[0] == mps.relative_speed[0] == pytest.approx(0.5)
    assert kmh.status[0] == mps.status[0] == "slow"


def test_a_speed_without_a_unit_is_refused_until_the_unit_is_said():
    text = "segment_id,time,speed,relative_speed\na,2014-06-16T12:00Z,36,0.5\n"
    with pytest.raises(ColumnError, match="unit"):
        read("csv", text)
    assert read("csv", text, speed_unit="km/h").speed_mps[0] == pytest.approx(10.0)


def test_a_word_wins_over_a_speed_and_a_gap_is_filled_by_it():
    text = HEAD.strip() + ",relative_speed\na,2014-06-16T12:00Z,closed,0.9\n"
    seen = read("csv", text + "b,2014-06-16T12:00Z,,0.05\n")
    assert statuses(seen) == {"a": "closed", "b": "stationary"}


def test_a_foreign_word_needs_its_profile():
    text = HEAD + "a,2014-06-16T12:00Z,heavy\n"
    with pytest.raises(ColumnError, match="heavy"):
        read("csv", text)
    mine = parse_profile('[words]\nheavy = "very_slow"')
    assert statuses(read("csv", text, profile=mine)) == {"a": "very_slow"}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("segment,time,status\na,2014-06-16T12:00Z,slow\n", "rename 'segment'"),
        (HEAD + "a,yesterday,slow\n", "not a time"),
        (HEAD + "a,,slow\n", "no time"),
        (HEAD + ",2014-06-16T12:00Z,slow\n", "no segment_id"),
        ("segment_id,time\na,2014-06-16T12:00Z\n", "no column status"),
        ("segment_id,time,relative_speed\na,2014-06-16T12:00Z,fast\n", "'fast' in row 1"),
        ("segment_id,time,relative_speed\na,2014-06-16T12:00Z,-1\n", "'-1' in row 1"),
    ],
)
def test_a_table_at_fault_is_told_where(text, said):
    with pytest.raises(ColumnError) as fault:
        read("csv", text, where="obs.csv")
    assert said in str(fault.value)
    assert "obs.csv" in str(fault.value)


def test_an_empty_table_and_binary_trash_are_file_errors():
    for raw in (b"", b"\xff\xfe\x00trash\x00" * 9):
        with pytest.raises((FileError, ColumnError)):
            read("csv", raw)
    with pytest.raises(FileError):
        read("parquet", b"PAR1 but not really PAR1")


@pytest.mark.parametrize("suffix", [".parquet", ".csv"])
def test_observations_come_back_from_disk(tmp_path, suffix):
    given = Observations.from_columns(
        ["a", "b"],
        ["2014-06-16T12:00:00.25", "2014-06-16T13:00"],
        ["slow", "closed"],
        until=["2014-06-16T12:05", "NaT"],
        relative_speed=[0.5, np.nan],
        queue_m=[np.nan, 12.5],
    )
    path = tmp_path / f"obs{suffix}"
    assert write_observations(path, [given.take([0]), given.take([1])]) == 2
    back = read(suffix[1:], path.read_bytes())
    for name, column in given.columns().items():
        if name != "line":
            np.testing.assert_array_equal(back.columns()[name], column)


def test_lines_survive_parquet(tmp_path):
    line = np.empty(1, dtype=object)
    line[0] = shapely.LineString([(-6.2, 53.3), (-6.1, 53.4)])
    given = Observations.from_columns(["a"], ["2014-06-16T12:00"], ["slow"], line=line)
    write_observations(tmp_path / "obs.parquet", [given])
    assert read("parquet", (tmp_path / "obs.parquet").read_bytes()).line[0] == line[0]


def test_a_feed_that_fails_midway_leaves_no_table(tmp_path):
    def failing():
        yield Observations.from_columns(["a"], ["2014-06-16T12:00"], ["slow"])
        raise FileError("the feed broke", "feed", "fetch it again")

    with pytest.raises(FileError, match="broke"):
        write_observations(tmp_path / "obs.parquet", failing())
    assert list(tmp_path.iterdir()) == []


def test_no_rows_make_an_empty_table(tmp_path):
    assert write_observations(tmp_path / "obs.csv", []) == 0
    assert len(read("csv", (tmp_path / "obs.csv").read_bytes())) == 0

"""Traces in SUMO's column names, written here and by SUMO itself."""

import gzip

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from covertool.crs import IRISH_TM, WGS84, transform
from covertool.errors import ColumnError, FileError, GeometryError, OptionError
from covertool.traffic.fcd import clock_s
from covertool.traffic.mobility import recorded
from covertool.traffic.trace import read_fcd
from tests.traffic.towns import SPEC, tool

HEAD = "timestep_time;vehicle_id;vehicle_x;vehicle_y;vehicle_angle;vehicle_speed;vehicle_lane\n"


def written(folder, rows, head=HEAD, name="t.csv"):
    path = folder / name
    path.write_text(head + "\n".join(rows) + "\n")
    return path


@given(angle=st.floats(0, 359.99), length_m=st.floats(2, 20), speed=st.floats(0, 40))
def test_the_centre_is_half_a_length_behind_the_bumper(tmp_path_factory, angle, length_m, speed):
    folder = tmp_path_factory.mktemp("t")
    path = written(folder, [f"0;a;100;200;{angle!r};{speed!r};e_0", f"1;a;1;2;0;{speed!r};e_0"])
    trace = read_fcd(path, length_m={"a": length_m})
    back = np.array([100 - trace.x_m[0], 200 - trace.y_m[0]])
    assert np.hypot(*back) == pytest.approx(length_m / 2)
    # The car drives from its centre to its bumper, at its speed.
    along = np.array([trace.vx[0], trace.vy[0]])
    assert np.hypot(*along) == pytest.approx(speed, abs=1e-9)
    assert along @ back == pytest.approx(speed * length_m / 2, abs=1e-6)
    assert back[0] == pytest.approx(np.sin(np.radians(angle)) * length_m / 2, abs=1e-9)


@pytest.fixture(scope="module")
def four_files(tmp_path_factory):
    """One run recorded by SUMO in every format that it writes, with a walker in it."""
    if SPEC is None:
        pytest.skip("SUMO is not installed")
    folder = tmp_path_factory.mktemp("fcd")
    tool("netgenerate", folder, "--grid", "--grid.number=3", "--grid.length=150", "-o", "n.net.xml")
    (folder / "r.xml").write_text(
        '<routes><flow id="1" begin="0" end="60" period="3" from="A1B1" to="B1C1"/>'
        '<person id="p" depart="0"><walk from="A1B1" to="B1C1"/></person></routes>'
    )
    names = ["a.csv", "b.xml", "c.parquet", "d.xml.gz", "e.csv"]
    for name in names:
        clock = ["-H"] if name == "e.csv" else []
        tool("sumo", folder, "-n", "n.net.xml", "-r", "r.xml", "--end", "60", "--no-step-log",
             "--fcd-output", name, *clock)  # fmt: skip
    return [folder / name for name in names]


def test_all_formats_give_the_same_trace_of_cars_only(four_files):
    first, *others = (read_fcd(path) for path in four_files)
    assert len(first) > 300
    assert set(first.vehicle) == {f"1.{k}" for k in range(20)}
    assert first.step_s == 1.0
    for other in others:
        assert other.vehicle.tolist() == first.vehicle.tolist()
        for name in ("time_s", "x_m", "y_m", "vx", "vy"):
            np.testing.assert_allclose(getattr(other, name), getattr(first, name), atol=0.0051)


def test_a_recorded_trace_needs_no_sumo_and_knows_its_streets(four_files):
    found = recorded(four_files[0], crs="EPSG:2157", horizon_s=30)
    assert found.crs == IRISH_TM
    assert found.trace.time_s.max() == 29.0
    assert found.route_edges["1.0"] == ("A1B1", "B1C1")
    with pytest.raises(OptionError, match="either its net"):
        recorded(four_files[0])


def test_a_trace_in_lon_lat_becomes_metres_with_true_speeds(tmp_path):
    x_m, y_m = np.array([600000.0, 600000.0]), np.array([750000.0, 750010.0])
    lon, lat = transform(x_m, y_m, IRISH_TM, WGS84)
    rows = [f"{k};a;{lon[k]!r};{lat[k]!r};0;10;e_0" for k in (0, 1)]
    path = written(tmp_path, [row.replace("np.float64(", "").replace(")", "") for row in rows])
    found = recorded(path, crs="EPSG:4326")
    assert found.crs == IRISH_TM
    np.testing.assert_allclose(found.trace.y_m, y_m - 2.5, atol=0.01)
    np.testing.assert_allclose(np.hypot(found.trace.vx, found.trace.vy), 10, atol=1e-6)


@pytest.mark.parametrize(
    ("head", "rows", "error", "told"),
    [
        (HEAD.replace("vehicle_angle", "vehicle_pos"), ["0;a;1;2;3;4;e"], ColumnError, "angle"),
        (HEAD, ["0;a;x;2;3;4;e"], ColumnError, "column x"),
        (HEAD, ["0;a;1;inf;3;4;e"], ColumnError, "column y"),
        (HEAD, ["noon;a;1;2;3;4;e"], ColumnError, "column time"),
        (HEAD, ["0;a;1;2;3;4;e", "0;a;1;2;3;4;e"], GeometryError, "stands twice at 0 s"),
        (HEAD, [f"{t};a;1;2;3;4;e" for t in (0, 1, 1.7)], ColumnError, "whole steps"),
        (HEAD, [], GeometryError, "no vehicle"),
        (HEAD, ["0;p;1;2;3;4;"], GeometryError, "no vehicle"),
    ],
)
def test_a_trace_that_cannot_be_used_is_refused(tmp_path, head, rows, error, told):
    with pytest.raises(error, match=told):
        read_fcd(written(tmp_path, rows, head))


def test_files_that_are_cut_off_are_refused(four_files, tmp_path):
    for path in four_files[1:4]:
        cut = tmp_path / path.name
        cut.write_bytes(path.read_bytes()[:-200])
        with pytest.raises(FileError, match=r"cut off|ends early"):
            read_fcd(cut)
    with pytest.raises(FileError, match="no format of a trace"):
        read_fcd(tmp_path / "t.fcd")


def test_packed_csv_with_commas_and_plain_names_is_read(tmp_path):
    path = tmp_path / "t.csv.gz"
    frame = pd.DataFrame(
        {"time": [0, 0.5], "id": ["7", "7"], "x": [0, 5], "y": 0, "angle": 90, "speed": 10}
    )
    path.write_bytes(gzip.compress(frame.to_csv(index=False).encode()))
    trace = read_fcd(path)
    assert trace.step_s == 0.5
    assert trace.vehicle.tolist() == ["7", "7"]
    np.testing.assert_allclose(trace.x_m, [-2.5, 2.5])


def test_clock_times_count_days_hours_minutes_and_seconds():
    assert clock_s("00:01:05") == 65
    assert clock_s("2:03:00:00.50") == 2 * 86400 + 3 * 3600 + 0.5
    with pytest.raises(ValueError):
        clock_s("1:2")

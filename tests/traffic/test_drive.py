"""SUMO as a child: what it drives, and every way in which it can fail us."""

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import textwrap
import time
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
import shapely
from pyproj import CRS

from covertool.errors import (
    ComputationError,
    FileError,
    GeometryError,
    MissingExtraError,
    OptionError,
)
from covertool.model import Anchors
from covertool.traffic import sumo as sumo_module
from covertool.traffic.demand import campus_demand, town_demand, user_routes
from covertool.traffic.mobility import drive
from covertool.traffic.network import read_network
from covertool.traffic.run import run_sumo
from covertool.traffic.sumo import find_sumo
from tests.congestion.feedtools import read
from tests.traffic.towns import children, needs_sumo

pytestmark = needs_sumo
LINUX = pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")


@pytest.fixture(scope="module")
def driven(town):
    return drive(town, town_demand(town, seed=2, started=40, entering=10, horizon_s=120), seed=5)


def test_cars_drive_on_the_lanes_of_their_routes_on_the_left(town, driven):
    trace = driven.trace
    assert len(set(trace.vehicle)) == 50
    assert trace.time_s.max() == 119.0
    assert driven.facts["loaded"] == driven.facts["inserted"] == 50
    streets = shapely.union_all(list(town.lines().geoms)).buffer(3.5)
    assert shapely.contains_xy(streets, trace.x_m, trace.y_m).mean() > 0.97  # junctions are wider
    moved = trace.take(np.hypot(trace.vx, trace.vy) > 5)
    places = shapely.points(moved.x_m, moved.y_m)
    lanes = [shapely.LineString(edge.shape) for edge in town.edges.values()]
    for place, vx, vy in list(zip(places, moved.vx, moved.vy, strict=True))[:200:5]:
        lane = min(lanes, key=place.distance)
        if place.distance(lane) < 0.2:
            at = lane.project(place)
            ahead = lane.interpolate(at + 0.5)
            behind = lane.interpolate(at - 0.5)
            along = np.array([ahead.x - behind.x, ahead.y - behind.y])
            assert along @ (vx, vy) > 0.99 * np.hypot(vx, vy) * np.hypot(*along)


def test_the_velocity_is_the_change_of_place(driven):
    trace = driven.trace
    for name in sorted(set(trace.vehicle))[:10]:
        car = trace.take(trace.vehicle == name)
        # SUMO's Euler steps: the place at t is the one before plus the speed at t.
        moved_m = np.hypot(np.diff(car.x_m), np.diff(car.y_m))
        speed = np.hypot(car.vx, car.vy)[1:]
        assert np.median(np.abs(moved_m - speed)) < 0.02
        assert np.max(np.abs(moved_m - speed)) < 2.0  # bends and the turn of the heading


def test_the_same_seeds_give_the_same_bytes_and_others_do_not(town, driven):
    def again(demand_seed, seed):
        demand = town_demand(town, seed=demand_seed, started=40, entering=10, horizon_s=120)
        return drive(town, demand, seed=seed)

    same = again(2, 5)
    for name, column in driven.trace.columns().items():
        assert np.array_equal(column, same.trace.columns()[name])
    assert same.edge_data == driven.edge_data
    assert not np.array_equal(again(2, 6).trace.x_m, driven.trace.x_m)


def test_anchors_as_points_leave_the_trace_identical_and_parked_ones_do_not(town, tmp_path):
    demand = town_demand(town, seed=2, started=60, entering=10, horizon_s=60)
    x, y = np.concatenate([town.edges[name].shape for name in ("0.0", "0.1")]).T
    y = y + 4.0
    anchors = Anchors.from_points(x, y, town.crs)
    written = {}
    for name, given, kind in (("off", None, "points"), ("on", anchors, "points"),
                              ("cars", anchors, "parked")):  # fmt: skip
        folder = tmp_path / name
        folder.mkdir()
        run = run_sumo(town, demand, folder, seed=1, step_s=1.0, anchors=given, anchors_as=kind,
                       timeout_s=60)  # fmt: skip
        written[name] = (folder / "fcd.csv").read_bytes()
    assert written["on"] == written["off"]
    assert written["cars"] != written["off"]
    # Each parked car's middle stands on its anchor.
    parked = run.rows.take([str(v).startswith("anchor.") for v in run.rows.vehicle])
    last = parked.take(parked.time_s == parked.time_s.max())
    heading = np.radians(last.angle)
    centre = last.x - 2.5 * np.sin(heading), last.y - 2.5 * np.cos(heading)
    found_x, found_y = town.projection.to_crs(*centre)
    order = [int(str(name).removeprefix("anchor.")) - 1 for name in last.vehicle]
    np.testing.assert_allclose(found_x, x[order], atol=0.02)
    np.testing.assert_allclose(found_y, y[order], atol=0.02)
    assert sorted(order) == list(range(len(x)))
    # ... and is no moving car.
    trace = drive(town, demand, anchors=anchors, anchors_as="parked").trace
    assert not any(str(name).startswith("anchor.") for name in trace.vehicle)


def test_the_edge_data_of_a_run_goes_through_the_congestion_import(town, driven):
    seen = read("sumo", driven.edge_data, time=datetime(2014, 6, 16, 7, tzinfo=UTC))
    assert set(seen.segment_id) == set(town.edges)
    assert len(seen) == 2 * len(town.edges)  # two minutes
    assert (seen.status != "free").any()


def test_a_run_becomes_a_row_of_the_occupancy_table(town, driven, tmp_path):
    (tmp_path / "edges.xml").write_bytes(driven.edge_data)
    town.to_frame().to_file(tmp_path / "net.gpkg", layer="segments")

    def covertool(*arguments):
        command = [sys.executable, "-m", "covertool", "congestion", *arguments]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
        return done.stdout

    covertool("import", "edges.xml", "--format", "sumo", "-o", "seen.csv",
              "--time", "2014-06-16T12:59:00+01:00")  # fmt: skip
    told = json.loads(
        covertool("table", "seen.csv", "--segments", "net.gpkg", "--tz", "Europe/Dublin", "--json")
    )
    (cell,) = [cell for cell in told["cells"] if cell["percent"] is not None]
    assert (cell["day"], cell["window"]) == ("Monday", "lunch")
    assert 0 < cell["percent"] < 100


def test_rasterio_still_works_after_a_run_in_the_same_process(driven):
    import rasterio.crs

    assert "sumo" not in sys.modules
    assert len(driven.trace)
    assert rasterio.crs.CRS.from_epsg(2157).to_wkt().startswith("PROJCS")
    for name in ("PROJ_DATA", "PROJ_LIB", "SUMO_HOME"):
        assert "sumo" not in os.environ.get(name, "").lower()


def test_the_child_sees_sumos_proj_and_none_of_ours(monkeypatch):
    monkeypatch.setenv("PROJ_LIB", "/ours")
    monkeypatch.setenv("GDAL_DATA", "/ours")
    monkeypatch.setenv("LD_LIBRARY_PATH", "/ours")
    environment = find_sumo().environment
    assert not any(value == "/ours" for value in environment.values())
    assert (Path(environment["PROJ_DATA"]) / "proj.db").is_file()
    assert environment["SUMO_HOME"] == str(find_sumo().home)


def test_without_sumo_or_with_an_old_one_the_extra_is_named(monkeypatch):
    monkeypatch.setattr(sumo_module.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(MissingExtraError, match=r"pip install 'covertool\[simulate\]'"):
        find_sumo()
    monkeypatch.undo()
    monkeypatch.setattr(sumo_module.importlib.metadata, "version", lambda name: "1.20.0")
    with pytest.raises(MissingExtraError, match=r"SUMO 1.20.0 is too old; covertool needs 1.24"):
        find_sumo()


def test_the_campus_drives_on_for_the_whole_horizon(town):
    seen = []
    mobility = drive(town, campus_demand(town, seed=1, horizon_s=200), on_time=seen.append)
    trace = mobility.trace
    assert np.sum(trace.time_s == 199.0) == 12
    assert seen == sorted(seen)
    assert all(0 <= at <= 200 for at in seen)


def test_a_users_routes_drive_with_their_own_lengths(town, tmp_path):
    routes = tmp_path / "mine.rou.xml"
    routes.write_text(
        '<routes><vType id="b" vClass="bus"/>'
        '<vehicle id="bus" type="b" depart="1000" departPos="50" departSpeed="0">'
        '<route edges="0.0 0.1"/></vehicle>'
        '<trip id="car" depart="1000" departPos="30" departSpeed="0" from="0.0" to="0.1"/></routes>'
    )
    mobility = drive(town, user_routes(routes, town, horizon_s=30))
    first = mobility.trace.take(mobility.trace.time_s == 1000.0)
    x_m = dict(zip(first.vehicle, first.x_m, strict=True))
    # Bumpers at 50 and 30 m, a bus of 12 m and a car of 5 m: centres at 44 and 27.5 m.
    assert x_m["bus"] - x_m["car"] == pytest.approx(44 - 27.5, abs=0.1)
    assert mobility.route_edges["bus"] == ("0.0", "0.1")


def test_teleported_and_collided_vehicles_are_reported_and_left_out(town, tmp_path, caplog):
    routes = tmp_path / "r.rou.xml"
    routes.write_text(
        '<routes><vehicle id="block" depart="0"><route edges="0.0 0.1"/>'
        '<stop lane="0.0_0" endPos="100" duration="900"/></vehicle>'
        '<vehicle id="late" depart="1"><route edges="0.0 0.1 0.2"/></vehicle>'
        '<vehicle id="one" depart="2" departPos="50" departSpeed="0">'
        '<route edges="1.0 1.1"/></vehicle>'
        '<vehicle id="two" depart="2" departPos="47" departSpeed="0" insertionChecks="none">'
        '<route edges="1.0 1.1"/></vehicle>'
        '<vehicle id="free" depart="3"><route edges="-0.2 -0.1"/></vehicle></routes>'
    )
    mobility = drive(town, user_routes(routes, town, horizon_s=400))
    assert mobility.facts["teleports"] == 1
    assert mobility.facts["collisions"] >= 1
    assert mobility.facts["left_out"] == ("late", "one", "two")
    assert set(mobility.trace.vehicle) == {"block", "free"}
    assert "3 vehicles are left out" in caplog.text


def test_what_sumo_refuses_is_told_with_its_reason(town, tmp_path):
    routes = tmp_path / "r.rou.xml"
    # Two streets that exist, without a turn between them.
    routes.write_text(
        '<routes><vehicle id="a" depart="0"><route edges="0.0 1.1"/></vehicle></routes>'
    )
    with pytest.raises(GeometryError, match="cannot be driven"):
        drive(town, user_routes(routes, town, horizon_s=30))
    routes.write_text(
        '<routes><vehicle id="a" depart="0" type="ghost"><route edges="0.0 0.1"/></vehicle>'
        "</routes>"
    )
    with pytest.raises(ComputationError, match="ghost"):
        drive(town, user_routes(routes, town, horizon_s=30))
    routes.write_text(
        '<routes><flow id="f" begin="0" end="9" number="0" from="0.0" to="0.1"/></routes>'
    )
    with pytest.raises(GeometryError, match="no vehicles entered"):
        drive(town, user_routes(routes, town, horizon_s=30))


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"anchors_as": "ghosts"}, "ghosts"),
        ({"step_s": 0.0}, "step"),
        ({"timeout_s": 0}, "time-out"),
        ({"seed": 2**31}, "seed"),
        ({"anchors": Anchors.from_points([0.0], [0.0], CRS(32632))}, "dst_crs"),
    ],
)
def test_options_out_of_range_are_refused(town, options, told):
    with pytest.raises(OptionError, match=told):
        drive(town, campus_demand(town), **options)


def long_demand(town):
    return town_demand(town, seed=1, started=60, entering=60, gap_s=50, horizon_s=80_000)


def interfering(sign):
    """Return what sends SUMO a signal once it drives."""
    sent = []

    def send(at_s):
        if at_s > 5 and not sent:
            sent.append(children()[-1])
            os.kill(sent[0], sign)

    return send


@LINUX
def test_a_sumo_that_is_told_to_stop_is_not_taken_for_done(town):
    with pytest.raises(ComputationError, match=r"stopped at .* though its exit code is 0"):
        drive(town, long_demand(town), on_time=interfering(signal.SIGTERM))


@LINUX
@pytest.mark.parametrize("sign", [signal.SIGKILL, signal.SIGSEGV])
def test_a_sumo_that_crashes_says_how(town, sign):
    with pytest.raises(ComputationError, match=f"was ended by {sign.name}"):
        drive(town, long_demand(town), on_time=interfering(sign))


@LINUX
def test_a_sumo_that_hangs_is_ended_by_force(town, monkeypatch):
    monkeypatch.setattr("covertool.traffic.child._GRACE_S", 0.5)
    before = children()
    started = time.monotonic()
    with pytest.raises(ComputationError, match="longer than 4 s"):
        # A stopped process does not hear TERM.
        drive(town, long_demand(town), timeout_s=4, on_time=interfering(signal.SIGSTOP))
    assert time.monotonic() - started < 20
    assert children() == before


@LINUX
def test_a_sumo_on_a_full_disk_is_not_taken_for_done(town, tmp_path, monkeypatch):
    disk = tmp_path / "small"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(disk)]
    if shutil.which("mount") is None or subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("a small disk cannot be mounted here")
    try:
        monkeypatch.setattr(tempfile, "tempdir", str(disk))
        with pytest.raises(FileError, match="disk is full"):
            drive(town, town_demand(town, seed=1, started=60, entering=90, horizon_s=600))
        assert list(disk.iterdir()) == []
    finally:
        subprocess.run(["umount", str(disk)], check=True)


def test_a_folder_that_is_gone_is_told(town, tmp_path):
    with pytest.raises(FileError, match="cannot be written for SUMO"):
        run_sumo(town, campus_demand(town), tmp_path / "gone", seed=1, step_s=1.0, anchors=None,
                 anchors_as="points", timeout_s=9)  # fmt: skip


def python(code, *arguments):
    return [sys.executable, "-c", textwrap.dedent(code), *arguments]


DRIVE = """
    import resource, sys
    from covertool.errors import CovertoolError
    from covertool.traffic.demand import town_demand
    from covertool.traffic.mobility import drive
    from covertool.traffic.network import read_network
    town = read_network(sys.argv[1])
    horizon_s = float(sys.argv[2])
    demand = town_demand(town, started=60, entering=60, gap_s=50, horizon_s=horizon_s)
    if len(sys.argv) > 3:
        resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[3]), int(sys.argv[3])))
    try:
        drive(town, demand, on_time=lambda at: print(at, flush=True))
    except CovertoolError as fault:
        print(fault)
"""


@LINUX
def test_a_limit_on_file_size_is_told(town):
    command = python(DRIVE, str(town.path), "900", str(100 * 1024))
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "largest file that is allowed" in done.stdout


@LINUX
def test_when_we_are_killed_sumo_dies_with_us(town):
    with subprocess.Popen(
        python(DRIVE, str(town.path), "80000"), stdout=subprocess.PIPE, text=True
    ) as ours:
        assert ours.stdout is not None
        while float(ours.stdout.readline()) <= 5:
            pass
        (sumo,) = (
            int(pid)
            for task in Path(f"/proc/{ours.pid}/task").iterdir()
            for pid in (task / "children").read_text().split()
        )
        assert b"sumo" in Path(f"/proc/{sumo}/cmdline").read_bytes()
        ours.kill()
    for _ in range(100):
        if (
            not Path(f"/proc/{sumo}").exists()
            or "(zombie)" in Path(f"/proc/{sumo}/status").read_text()
        ):
            return
        time.sleep(0.05)
    os.kill(sumo, signal.SIGKILL)
    pytest.fail("SUMO outlived us")


@LINUX
def test_an_exception_of_ours_ends_sumo_and_leaves_no_files(town, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    before = children()

    def stop(at_s):
        if at_s > 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        drive(town, long_demand(town), on_time=stop)
    assert children() == before
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_the_net_in_the_sumo_wheel_drives_whole():
    network = read_network(find_sumo().home / "tools/game/DRT/osm.net.xml")
    mobility = drive(network, town_demand(network, seed=1, horizon_s=300))
    assert mobility.facts["inserted"] > 200
    assert mobility.trace.time_s.max() == 299.0

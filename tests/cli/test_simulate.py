"""`covertool simulate` as a program: what it prints, writes and refuses."""

import contextlib
import io
import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import rasterio

from covertool.cli.main import main
from covertool.gis.study import read_tables
from covertool.traffic.sumo import find_sumo

DATA = Path(__file__).parents[2] / "data"
STUDY = DATA / "sample.gpkg"
WITHOUT_SUMO = """
import importlib.util as util, sys
found = util.find_spec
util.find_spec = lambda name, *rest: None if name == "sumo" else found(name, *rest)
from covertool.cli.main import main
sys.exit(main(sys.argv[1:]))
"""
QUICK = ("--estimator", "ekf", "--runs", 2, "--sigma-range", 0.2, "--no-bound")


@dataclass
class Done:
    returncode: int
    stdout: str
    stderr: str


def run(*arguments, cwd=None, sumo=True):
    """Run the program: in this process, which is quicker, or in one that finds no SUMO."""
    words = [str(word) for word in arguments]
    if not sumo:
        command = [sys.executable, "-c", WITHOUT_SUMO, *words]
        done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=cwd)
        return Done(done.returncode, done.stdout, done.stderr)
    out, told = io.StringIO(), io.StringIO()
    place = contextlib.chdir(cwd) if cwd else contextlib.nullcontext()
    with place, contextlib.redirect_stdout(out), contextlib.redirect_stderr(told):
        code = main(words)
    return Done(code, out.getvalue(), told.getvalue())


def ask(*arguments, **how):
    done = run("simulate", *arguments, "--json", **how)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A trace of 15 cars for 30 s in three formats, and the study's anchors moved 10 km away."""
    place = tmp_path_factory.mktemp("simulate")
    trace = pd.read_parquet(DATA / "trace.parquet")
    names = sorted(trace["vehicle_id"].unique())[:15]
    few = trace[trace["vehicle_id"].isin(names) & (trace["timestep_time"] < 30)]
    few.to_csv(place / "few.csv", sep=";", index=False)
    pd.read_csv(place / "few.csv", sep=";").to_parquet(place / "few.parquet")
    anchors = gpd.read_file(STUDY, layer="anchors")
    anchors.geometry = anchors.geometry.translate(10_000, 0)
    anchors.drop(columns=["x_m", "y_m"]).to_file(place / "far.gpkg", layer="anchors")
    return place


def few(folder, *arguments):
    return ("--fcd", folder / "few.csv", "--crs", "EPSG:2157", STUDY, *QUICK, *arguments)


@pytest.fixture(scope="module")
def written(folder):
    """Everything that a run can write, and what it printed."""
    done = ask(
        *few(folder, "--sigma-range", 4, "--table", "table.csv", "--traces", "steps.parquet",
             "--additional", "town.add.xml", "--fcd-out", "estimates.xml", "--plot", "time.png",
             "--plot-density", "density.svg", "-o", "run.gpkg"),
        cwd=folder,
    )  # fmt: skip
    return folder, done


def test_json_has_the_keys_that_others_rely_on(written):
    found = written[1]
    assert (found["schema_version"], found["command"]) == (1, "simulate")
    assert (found["vehicles"], found["steps"], found["runs"]) == (15, 30, 2)
    assert found["anchors"] > 0
    wanted = {
        "arm", "estimator", "preset", "sigma_range_m", "radius_m", "vehicle", "mean_error_m",
        "sd_error_m", "rmse_m", "median_error_m", "p95_error_m", "bound_rmse_m",
    }  # fmt: skip
    assert all(wanted <= set(row) for row in found["results"])
    better = {"estimator", "preset", "sigma_range_m", "radius_m", "vehicle", "percent", "ci95"}
    assert all(better <= set(row) for row in found["improvements"])
    assert {"sumo", "positioning", "total"} <= set(found["seconds"])


def test_arms_that_do_not_range_have_nulls(written):
    rows = [row for row in written[1]["results"] if row["arm"] in ("gps", "gps_odometry")]
    assert {row["arm"] for row in rows} == {"gps", "gps_odometry"}
    for row in rows:
        names = ("estimator", "preset", "sigma_range_m", "radius_m", "bound_rmse_m")
        assert [row[name] for name in names] == [None] * 5


def test_the_study_holds_layers_and_tables_that_agree_with_the_json(written):
    folder, found = written
    tables = read_tables(folder / "run.gpkg", ["positioning", "improvements", "parked_met"])
    assert len(tables["positioning"]) == len(found["results"])
    percents = [row["percent"] for row in found["improvements"]]
    assert tables["improvements"]["percent"].tolist() == pytest.approx(percents)
    assert len(tables["parked_met"]) == 5
    lines = gpd.read_file(folder / "run.gpkg", layer="trajectories")
    assert len(lines) == 15
    assert len(gpd.read_file(folder / "run.gpkg", layer="anchors")) == found["anchors"]


def test_the_written_steps_give_the_printed_errors(written):
    folder = written[0]
    steps = pd.read_parquet(folder / "steps.parquet")
    first = steps[(steps["run"] == 0) & (steps["arm"] == "gps")]
    error = np.hypot(first["gps_x_m"] - first["true_x_m"], first["gps_y_m"] - first["true_y_m"])
    assert first["error_m"].to_numpy() == pytest.approx(error.to_numpy())
    whole = ask(*few(folder, "--runs", 1, "--arm", "proposed"), cwd=folder)
    (row,) = [r for r in whole["results"] if r["vehicle"] == "all" and r["sigma_range_m"] == 0.2]
    mine = steps[(steps["arm"] == "proposed") & (steps["sigma_range_m"] == 0.2)]
    assert mine["error_m"].mean() == pytest.approx(row["mean_error_m"])


def test_the_table_holds_every_result(written):
    folder, found = written
    assert len(pd.read_csv(folder / "table.csv")) == len(found["results"])


def test_estimates_are_read_back_as_a_trace_within_a_centimetre(written):
    from covertool.traffic.mobility import recorded

    folder = written[0]
    back = recorded(folder / "estimates.xml", crs="EPSG:2157").trace.to_frame()
    steps = pd.read_parquet(folder / "steps.parquet")
    mine = steps[(steps["arm"] == "proposed") & (steps["sigma_range_m"] == 0.2)]
    both = mine.merge(back, on=["vehicle", "time_s"])
    assert len(both) == len(back) == len(mine)
    # Rounded to a centimetre, and the heading to a hundredth of a degree.
    assert np.abs(both["estimated_x_m"] - both["x_m"]).max() < 0.011
    assert np.abs(both["estimated_y_m"] - both["y_m"]).max() < 0.011


def test_sumos_own_trace_exporter_reads_the_estimates(written, tmp_path):
    sumo = find_sumo()
    tool = sumo.home / "tools" / "traceExporter.py"
    done = subprocess.run(
        [sys.executable, tool, "--fcd-input", written[0] / "estimates.xml", "--gpx-output",
         tmp_path / "out.gpx"],
        capture_output=True, text=True, check=False, env=dict(sumo.environment),
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out.gpx").read_text().count("<trkpt ") > 15 * 10


def test_same_seed_same_bytes_and_another_seed_others(written, tmp_path):
    folder, found = written
    again = ask(
        *few(folder, "--sigma-range", 4, "--traces", tmp_path / "steps.parquet", "--fcd-out",
             tmp_path / "e.xml", "--plot-density", tmp_path / "density.svg", "--workers", 2),
    )  # fmt: skip
    for varying in ("seconds", "provenance"):
        assert varying in found
        del again[varying]
    assert again == {key: found[key] for key in again}
    assert set(found) - set(again) == {"seconds", "provenance"}
    assert (tmp_path / "steps.parquet").read_bytes() == (folder / "steps.parquet").read_bytes()
    assert (tmp_path / "e.xml").read_bytes() == (folder / "estimates.xml").read_bytes()
    assert (tmp_path / "density.svg").read_bytes() == (folder / "density.svg").read_bytes()
    other = ask(*few(folder, "--seed", 2))
    assert other["results"][0]["mean_error_m"] != found["results"][0]["mean_error_m"]


def test_csv_and_parquet_traces_give_the_same(folder):
    parquet = ("--fcd", folder / "few.parquet", "--crs", "EPSG:2157", STUDY, *QUICK)
    one, two = ask(*few(folder)), ask(*parquet)
    assert one["results"] == two["results"]


def test_anchors_ten_kilometres_away_are_refused_or_bring_nothing(folder):
    far = ("--fcd", folder / "few.csv", "--crs", "EPSG:2157", "--anchors", folder / "far.gpkg")
    done = run("simulate", *far, *QUICK)
    assert done.returncode == 1
    assert [line.split(":")[0] for line in done.stderr.splitlines()[-3:]] == [
        "error", "where", "mend",
    ]  # fmt: skip
    found = ask(*far, *QUICK, "--allow-unheard")
    assert {row["percent"] for row in found["improvements"]} == {0.0}


def test_a_trace_without_anchors_is_a_usage_error(folder):
    done = run("simulate", "--fcd", folder / "few.csv", "--crs", "EPSG:2157")
    assert (done.returncode, "--anchors" in done.stderr) == (2, True)


@pytest.mark.parametrize(
    "wrong",
    [
        ("--preset", "worst"),
        ("--preset", "best", "--estimator", "ekf"),
        ("--reading", "velocity=sideways"),
        ("--reading", "speed=1"),
        ("--radius", "own"),
        ("--scenario", "campus"),
        ("--edge-data", "edges.xml"),
    ],
)
def test_options_that_do_not_fit_are_usage_errors(folder, wrong):
    done = run("simulate", *few(folder), *wrong)
    assert (done.returncode, "Traceback" in done.stderr) == (2, False)


def test_a_taken_output_is_refused_before_the_work(folder):
    (folder / "taken.csv").write_text("mine")
    done = run("simulate", *few(folder, "--table", folder / "taken.csv"))
    assert (done.returncode, (folder / "taken.csv").read_text()) == (1, "mine")


def test_without_sumo_the_shipped_trace_is_used_and_the_extra_named():
    done = run("simulate", *QUICK, "--arm", "gps", "--json", sumo=False)
    assert done.returncode == 0, done.stderr
    assert "covertool[simulate]" in done.stderr
    found = json.loads(done.stdout)
    assert (found["vehicles"], found["synthetic"], found["traffic"]) == (295, True, [{}])


def test_without_sumo_other_traffic_names_the_extra():
    for given in (("--scenario", "campus"), ("--net", "any.net.xml", STUDY)):
        done = run("simulate", *given, sumo=False)
        assert done.returncode == 1
        assert "pip install 'covertool[simulate]'" in done.stderr.splitlines()[-1]


def test_a_reading_changes_the_result(folder):
    plain = ask(*few(folder))
    literal = ask(*few(folder, "--reading", "velocity=current", "--reading", "gps-reset-s=none"))
    assert literal["options"]["velocity"] == "current"
    assert literal["options"]["gps_reset_s"] is None
    assert plain["results"] != literal["results"]


@pytest.mark.slow
def test_campus_by_sumo_goes_through_congestion_and_leaves_rasterio_whole(tmp_path):
    found = ask(
        "--scenario", "campus", "--horizon", 60, *QUICK, "--radius", 15, "-o", "run.gpkg",
        "--edge-data", "edges.xml", cwd=tmp_path,
    )  # fmt: skip
    assert found["vehicles"] == 12
    assert found["traffic"][0]["inserted"] == 12
    when = ("--time", "2026-06-15T13:00:00+01:00")
    given = ("congestion", "import", "--format", "sumo", "edges.xml", *when, "-o", "obs.parquet")
    assert run(*given, cwd=tmp_path).returncode == 0
    table = run(
        "congestion", "table", "obs.parquet", "--segments", "run.gpkg", "--tz", "Europe/Dublin",
        "--json", cwd=tmp_path,
    )  # fmt: skip
    assert table.returncode == 0, table.stderr
    lunch = [c for c in json.loads(table.stdout)["cells"] if c["window"] == "lunch"]
    assert any(cell["percent"] is not None for cell in lunch)
    with rasterio.open(DATA / "orthophoto.tif") as photo:  # its PROJ is still its own
        assert photo.crs.to_epsg() == 2157

"""The congestion verbs as a user runs them."""

import csv
import json
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import geopandas as gpd
import numpy as np
import pytest
import shapely

from covertool.cli.main import main

SHARED = Path(__file__).resolve().parents[2] / "../shared/data/congestion"
SAMPLE = Path(__file__).resolve().parents[2] / "data"
needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="shared data is not here")
needs_sample = pytest.mark.skipif(
    not (SAMPLE / "sample.gpkg").is_file() or not list(SAMPLE.glob("observations.*")),
    reason="the sample study is not made yet",
)


@pytest.fixture
def run(capsys):
    """Return what runs the command in this process, which saves seconds of start-up each time."""

    def in_process(*arguments, code=0):
        capsys.readouterr()
        found = main([str(argument) for argument in arguments])
        done = capsys.readouterr()
        assert found == code, done.err + done.out
        return Done(done.out, done.err)

    return in_process


class Done(NamedTuple):
    """What a command printed."""

    stdout: str
    stderr: str


def said(done):
    return json.loads(done.stdout)


@pytest.fixture
def town(tmp_path):
    """Write two streets that cross, and what was seen of them on a Tuesday in June."""
    x, y = 715_000.0, 734_000.0
    lines = [
        shapely.LineString([(x, y), (x + 200, y)]),
        shapely.LineString([(x, y), (x, y + 100)]),
    ]
    frame = gpd.GeoDataFrame({"segment_id": ["a", "b"]}, geometry=lines, crs=2157)
    frame.to_file(tmp_path / "net.gpkg", layer="segments")
    (tmp_path / "obs.csv").write_text(
        "segment_id,time,status,relative_speed\n"
        "a,2014-06-17T13:02:00,free,0.9\nb,2014-06-17T12:58:00,slow,0.65\n"
        "a,2014-06-17T19:30:00,stationary,0.05\nb,2014-06-17T19:30:00,free,1.0\n"
    )
    return tmp_path


def case(folder):
    return (folder / "obs.csv", "--segments", folder / "net.gpkg", "--tz", "Europe/Dublin")


def test_the_papers_table_is_printed_without_any_input():
    command = [sys.executable, "-m", "covertool", "congestion", "table", "--paper"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    lines = done.stdout.splitlines()
    assert lines[-4].split()[:3] == ["weekday", "mean", "22.64"]
    assert "13.03" in lines[-1]


def test_the_table_in_json_has_the_promised_keys(run, town):
    found = said(run("congestion", "table", *case(town), "--json"))
    assert (found["schema_version"], found["command"]) == (1, "congestion table")
    lunch, evening = found["cells"]
    assert (lunch["day"], lunch["window"], lunch["days"]) == ("Tuesday", "lunch", 1)
    assert lunch["percent"] == pytest.approx(100 / 3)
    assert evening["percent"] == pytest.approx(200 / 3)
    assert evening["filled_percent"] == pytest.approx(200 / 3)
    assert lunch["observed_fraction"] == 1.0
    assert found["means"][0] == {
        "group": "weekday", "window": "lunch", "percent": pytest.approx(100 / 3),
        "filled_percent": lunch["filled_percent"], "count": 1, "text": "33.33", "ci95": None,
    }  # fmt: skip


@needs_shared
def test_the_papers_cells_come_out_of_the_synthetic_feed_end_to_end(run, tmp_path):
    run("congestion", "import", "--format", "csv", SHARED / "SYNTHETIC_dublin_obs.csv",
        "-o", tmp_path / "obs.parquet")  # fmt: skip
    found = said(
        run("congestion", "table", tmp_path / "obs.parquet", "--segments",
            SHARED / "dublin_trips_net.gpkg", "--at", "lunch=13:00", "--at", "evening=19:30",
            "--tz", "Europe/Dublin", "--tolerance", "10min", "--json")
    )  # fmt: skip
    means = {(m["group"], m["window"]): m["percent"] for m in found["means"]}
    assert means["weekday", "lunch"] == pytest.approx(22.644, abs=0.001)
    assert means["weekend", "evening"] == pytest.approx(13.025, abs=0.001)


@needs_shared
@pytest.mark.parametrize(
    ("name", "file", "more", "rows"),
    [
        ("waze", "louisville_SampeData1.json", (), 50),
        ("datex2", "bisonfute_traficolor_excerpt.xml", ("--tz", "Europe/Paris"), 2),
        ("datex2", "france_events.xml", (), 0),
        ("tomtom", "flowSegmentData_nijmegen.json", ("--time", "2026-07-24T08:00Z"), 1),
    ],
)
def test_the_real_feeds_import(run, tmp_path, name, file, more, rows):
    out = tmp_path / "obs.parquet"
    done = run("congestion", "import", "--format", name, SHARED / file, "-o", out, *more, "--json")
    assert said(done)["rows"] == rows
    if name == "waze":
        assert said(done)["statuses"] == {"closed": 38, "slow": 2, "very_slow": 10}


@needs_shared
@pytest.mark.parametrize("suffix", ["gpkg", "parquet"])
def test_the_real_trips_network_imports_as_segments(run, tmp_path, suffix):
    out = tmp_path / f"net.{suffix}"
    run("congestion", "import", "--format", "trips", SHARED / "dublin_trips_routes.csv", "-o", out)
    links = gpd.read_parquet(out) if suffix == "parquet" else gpd.read_file(out, layer="segments")
    assert len(links) == 488


def test_every_format_of_the_table_is_written(run, town):
    for suffix in ("csv", "xlsx", "tex", "json"):
        run("congestion", "table", *case(town), "-o", town / f"table.{suffix}")
    rows = list(csv.DictReader((town / "table.csv").open()))
    assert float(rows[0]["percent"]) == pytest.approx(100 / 3)
    from openpyxl import load_workbook

    sheet = load_workbook(town / "table.xlsx").active
    assert [cell.value for cell in sheet[2]][:2] == ["Tuesday", 33.33]
    assert r"flagged \%" in (town / "table.tex").read_text()
    assert json.loads((town / "table.json").read_text())["schema_version"] == 1


def test_a_window_name_that_looks_like_a_formula_stays_text(run, town):
    out = town / "table.xlsx"
    run("congestion", "table", *case(town), "--at", "@SUM(1)=13:00", "-o", out)
    from openpyxl import load_workbook

    for row in load_workbook(out).active:
        assert all(cell.data_type != "f" for cell in row)


def test_an_output_is_not_overwritten_unasked(run, town):
    (town / "table.csv").write_text("mine")
    done = run("congestion", "table", *case(town), "-o", town / "table.csv", code=1)
    assert "--overwrite" in done.stderr
    assert (town / "table.csv").read_text() == "mine"


@pytest.mark.parametrize(
    ("arguments", "code", "word"),
    [
        (("--tz", "Europe/Atlantis"), 1, "no time zone"),
        (("--at", "lunch"), 2, "NAME=HH:MM"),
        (("--tolerance", "soon"), 2, "90s"),
        (("--occupied", "crawling"), 1, "occupied"),
        (("--weight", "axles"), 1, "weight"),
        (("--mean-of", "weeks"), 1, "average"),
        (("--holidays", "XX"), 1, "holidays"),
        (("--profile", "nobody"), 1, "profile"),
        (("--min-coverage", "2"), 1, "share"),
    ],
)
def test_a_wrong_option_says_so(run, town, arguments, code, word):
    done = run("congestion", "table", *case(town), *arguments, code=code)
    assert word in done.stderr.lower() or word in done.stderr
    assert "Traceback" not in done.stderr


def test_naive_times_need_a_zone_on_the_command_line_too(run, town):
    done = run("congestion", "table", town / "obs.csv", "--segments", town / "net.gpkg", code=2)
    assert "--tz" in done.stderr


def test_a_truncated_feed_leaves_no_table(run, tmp_path):
    (tmp_path / "cut.xml").write_text('<meandata><interval begin="0" end="9"><edge id="a"')
    out = tmp_path / "obs.parquet"
    arguments = ("congestion", "import", "--format", "sumo", tmp_path / "cut.xml",
                 "--time", "2014-06-16T07:00Z", "-o", out)  # fmt: skip
    assert "ends early" in run(*arguments, code=1).stderr
    assert [path.name for path in tmp_path.iterdir()] == ["cut.xml"]
    run(*arguments, "--allow-partial")
    assert out.is_file()


def test_the_map_is_a_picture_or_a_layer_by_its_extension(run, town):
    run("congestion", "map", *case(town), "--window", "lunch", "-o", town / "map.png",
        "--heat", town / "heat.svg")  # fmt: skip
    assert (town / "map.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (town / "heat.svg").read_text()
    run("congestion", "map", *case(town), "--window", "lunch", "-o", town / "map.gpkg")
    layer = gpd.read_file(town / "map.gpkg", layer="congestion").set_index("segment_id")
    assert layer["kind"].to_dict() == {"a": "free", "b": "occupied"}
    assert layer.crs.to_epsg() == 2157


def test_sensitivity_prints_every_profile_and_set(run, town):
    found = said(run("congestion", "sensitivity", *case(town), "--json"))["variants"]
    assert len(found) == 9
    lunch = {v["profile"]: v["means"][0]["percent"] for v in found if len(v["occupied"]) == 3}
    # 0.65 is slow by two profiles and free by the third (0.625).
    assert lunch == {
        "datex": pytest.approx(100 / 3), "tomtom-tile": pytest.approx(100 / 3), "tomtom-feed": 0.0,
    }  # fmt: skip


def study(folder):
    """Write a study of one parked car and the two streets as transit area."""
    x, y = 715_000.0, 734_000.0
    road = shapely.union_all(
        [shapely.box(x, y - 4, x + 200, y + 4), shapely.box(x - 4, y, x + 4, y + 100)]
    )
    path = folder / "town.gpkg"
    car = gpd.GeoDataFrame({"id": ["p1"]}, geometry=[shapely.Point(x + 20, y + 5)], crs=2157)
    car.to_file(path, layer="anchors")
    gpd.GeoDataFrame(geometry=[road], crs=2157).to_file(path, layer="transit")
    return path


def test_queued_cars_stand_beside_the_parked_ones_of_a_study(run, town):
    path = study(town)
    for _ in range(2):
        run("anchors", "queue", *case(town), "--window", "evening", "--into", path)
    anchors = gpd.read_file(path, layer="anchors")
    assert (anchors["origin"] != "queue").sum() == 1
    queued = anchors[anchors["origin"] == "queue"]
    # A stationary street of 200 m holds floor(201.5 / 7.5) = 26 cars.
    assert len(queued) == 26
    assert set(queued["segment_id"]) == {"a"}
    assert queued["synthetic"].astype(bool).all()
    found = said(run("coverage", path, "--radius", "15", "--json"))["results"]
    assert {result.get("origin") for result in found} >= {None, "parked", "queue"}


def test_one_command_compares_parked_queued_and_both(run, town):
    arguments = ("--window", "evening", "--coverage", 15, "--study", study(town), "--json")
    found = said(run("anchors", "queue", *case(town), *arguments))["coverage"]
    covered = {row["origin"]: 1 - row["fractions"][0] for row in found}
    assert set(covered) == {None, "parked", "queue"}
    assert max(covered["parked"], covered["queue"]) <= covered[None]
    assert covered[None] <= covered["parked"] + covered["queue"] + 1e-12


def test_the_same_seed_places_the_same_cars(run, town):
    outs = [town / "one.gpkg", town / "two.gpkg"]
    for out in outs:
        run("anchors", "queue", *case(town), "--window", "lunch", "--seed", 3, "-o", out)
    one, two = (gpd.read_file(out, layer="anchors") for out in outs)
    assert np.array_equal(one.geometry.to_wkb(), two.geometry.to_wkb())


@needs_sample
def test_the_sample_study_needs_no_arguments(run):
    done = run("congestion", "table", "--json")
    assert "sample study" in done.stderr
    percents = [cell["percent"] for cell in said(done)["cells"]]
    assert percents
    assert all(0 <= percent <= 100 for percent in percents if percent is not None)


@needs_sample
def test_parked_and_queued_cars_together_is_one_command_on_the_sample_study(run):
    found = said(run("anchors", "queue", "--coverage", 15, "--json"))["coverage"]
    covered = {row["origin"]: 1 - row["fractions"][0] for row in found}
    assert covered[None] >= max(covered["parked"], covered["queue"]) > 0


def test_several_snapshots_make_one_table(tmp_path, run):
    for minute in range(3):
        start = 1_550_675_460_000 + 60_000 * minute
        jams = [{"uuid": 1, "level": 3, "delay": 9}]
        content = {"startTimeMillis": start, "endTimeMillis": start + 60_000, "jams": jams}
        (tmp_path / f"{minute}.json").write_text(json.dumps(content))
    snapshots = sorted(tmp_path.glob("*.json"))
    out = tmp_path / "obs.csv"
    run("congestion", "import", "--format", "waze", *snapshots, "-o", out)
    assert len(list(csv.DictReader(out.open()))) == 3


def test_a_feed_given_as_observations_is_told_to_be_imported(tmp_path, run):
    (tmp_path / "jams.json").write_text("{}")
    done = run("congestion", "table", tmp_path / "jams.json", "--segments", "x.gpkg",
               "--tz", "UTC", code=1)  # fmt: skip
    assert "covertool congestion import" in done.stderr


def test_the_heat_matrix_is_a_table_too(town, run):
    run("congestion", "map", *case(town), "--heat", town / "heat.csv")
    rows = {(row["day"], row["window"]): row for row in csv.DictReader((town / "heat.csv").open())}
    assert float(rows["Tuesday", "13"]["percent"]) == pytest.approx(100 / 3)
    assert rows["Tuesday", "03"]["percent"] == ""

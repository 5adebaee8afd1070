"""`covertool coverage` on cases whose answer is known, run as a user runs it."""

import json
import math
import re
import subprocess
import sys
from pathlib import Path

import geopandas as gpd
import numpy as np
import pyogrio
import pytest
import shapely
from pyproj import Proj

from tests.running import answer, run

EAST, NORTH, CRS = 693_000.0, 737_000.0, "EPSG:2157"
R = 15.0
DISC = math.pi * R**2
LENS = 2 * R**2 * math.acos(0.5) - R / 2 * math.sqrt(4 * R**2 - R**2)
REULEAUX = R**2 / 2 * (math.pi - math.sqrt(3))
SIDE = 100.0


def write_study(path: Path, points, box=(-50.0, -50.0, 50.0, 50.0), **columns) -> Path:
    x, y = np.array(points, dtype=float).reshape(-1, 2).T
    anchors = gpd.GeoDataFrame(columns, geometry=shapely.points(x + EAST, y + NORTH), crs=CRS)
    anchors.to_file(path, layer="anchors")
    square = shapely.transform(shapely.box(*box), lambda xy: xy + np.array([EAST, NORTH]))
    gpd.GeoDataFrame({"kind": ["road"]}, geometry=[square], crs=CRS).to_file(path, layer="transit")
    return path


def areas(result: dict) -> list[float]:
    return [result["levels"][str(level)]["area_m2"] for level in range(4)]


CASES = {
    "one_disc": ([(0, 0)], (DISC, 0, 0)),
    "lens_of_two": ([(0, 0), (R, 0)], (2 * DISC - 2 * LENS, LENS, 0)),
    "three_around_a_reuleaux_triangle": (
        [(0, 0), (R, 0), (R / 2, R * math.sqrt(3) / 2)],
        (3 * DISC - 6 * LENS + 3 * REULEAUX, 3 * LENS - 3 * REULEAUX, REULEAUX),
    ),
    "two_identical": ([(0, 0), (0, 0)], (0, DISC, 0)),
    "half_outside": ([(50, 0)], (DISC / 2, 0, 0)),
    "outside_but_out_of_reach": ([(50 + R, 0)], (0, 0, 0)),
}


@pytest.mark.parametrize("case", CASES)
def test_the_levels_of_a_known_figure(tmp_path, case):
    points, expected = CASES[case]
    found = answer("coverage", write_study(tmp_path / "town.gpkg", points), "--radius", R)
    (result,) = found["results"]
    assert areas(result) == pytest.approx([SIDE**2 - sum(expected), *expected], abs=1e-6)
    assert sum(level["fraction"] for level in result["levels"].values()) == pytest.approx(1)
    assert found["transit_area_m2"] == pytest.approx(SIDE**2)
    assert result["closure_m"] < 1e-6
    assert (result["radius_m"], result["device_class"], result["anchors"]) == (R, None, len(points))


@pytest.fixture(scope="module")
def mixed(tmp_path_factory):
    """A study of two parked cars and one queueing car, each with its own radius or class."""
    return write_study(
        tmp_path_factory.mktemp("mixed") / "town.gpkg",
        [(-20, -20), (20, 20), (-20, 20)],
        origin=["parked", "parked", "queue"],
        radius_m=[10.0, 5.0, np.nan],
        device_class=[None, None, "A"],
    )


def test_without_a_radius_each_anchors_own_counts_and_origins_are_told_apart(mixed):
    done = run("coverage", mixed, "--json")
    results = {result["origin"]: result for result in json.loads(done.stdout)["results"]}
    parked, queue = math.pi * (10**2 + 5**2), DISC
    assert areas(results[None])[1] == pytest.approx(parked + queue)
    assert areas(results["parked"])[1] == pytest.approx(parked)
    assert areas(results["queue"])[1] == pytest.approx(queue)
    assert results[None]["radius_m"] is None
    assert [results[o]["anchors"] for o in (None, "parked", "queue")] == [3, 2, 1]
    assert "own radius" in done.stderr


def test_several_radii_and_classes_are_answered_in_one_call_in_their_order(mixed):
    found = answer("coverage", mixed, "--radius", "5", "--radius", "own", "--device-class", "A")
    together = [result for result in found["results"] if result["origin"] is None]
    assert [(r["radius_m"], r["device_class"]) for r in together] == [
        (5.0, None),
        (None, None),
        (15.0, "A"),
    ]
    assert areas(together[0])[1] == pytest.approx(3 * math.pi * 25)
    assert areas(together[2])[1] == pytest.approx(3 * DISC)


def test_the_table_has_a_row_for_each_level_and_nothing_else_is_on_stdout(mixed):
    done = run("coverage", mixed, "--radius", "10")
    labels = [line.split("  ")[0] for line in done.stdout.splitlines() if line.startswith("Level ")]
    assert labels[:4] == ["Level 0", "Level 1", "Level 2", "Level 3"]
    factors = Proj(CRS).get_factors(*Proj(CRS)(EAST, NORTH, inverse=True))
    printed = float(re.search(r"scale factor ([\d.]+)", done.stdout)[1])
    assert printed == pytest.approx(factors.parallel_scale, abs=2e-6)
    assert "Closure residual" in done.stdout
    assert all("compiling" in line for line in done.stderr.splitlines())


def test_two_runs_differ_only_in_provenance_and_seconds(mixed):
    first, second = (
        answer("coverage", mixed, "--radius", "10", "--penetration", "0.5") for _ in range(2)
    )
    for found in (first, second):
        del found["provenance"], found["seconds"]
    assert first == second


def test_a_study_is_only_read_and_a_new_one_is_whole(mixed, tmp_path):
    before = mixed.read_bytes()
    out = tmp_path / "out.gpkg"
    done = run("coverage", mixed, "--radius", "10", "--radius", "20", "-o", out)
    assert done.returncode == 0, done.stderr
    assert mixed.read_bytes() == before
    assert [path.name for path in mixed.parent.iterdir()] == ["town.gpkg"]

    first = gpd.read_file(out, layer="coverage_level_1")
    assert list(first["radius_m"]) == [10.0, 20.0]
    assert list(first["level"]) == [1, 1]
    assert first.area.iloc[0] == pytest.approx(3 * math.pi * 100, abs=0.01 * 60 * math.pi)
    assert np.allclose(first.area, first["area_m2"])
    again = answer("coverage", out, "--radius", "10")
    assert again["results"] == answer("coverage", mixed, "--radius", "10")["results"]

    refused = run("coverage", mixed, "--radius", "10", "-o", out)
    assert refused.returncode == 1
    assert "--overwrite" in refused.stderr


def test_into_a_study_adds_only_the_level_layers_and_the_tables(tmp_path):
    study = write_study(tmp_path / "town.gpkg", [(0, 0)])
    zones = gpd.GeoDataFrame({"name": ["x"]}, geometry=[shapely.box(0, 0, 1, 1)], crs=CRS)
    zones.to_file(study, layer="zones")
    done = run("coverage", study, "--radius", R, "--into", study)
    assert done.returncode == 0, done.stderr
    layers = set(gpd.list_layers(study)["name"])
    assert layers >= {"anchors", "transit", "zones", *(f"coverage_level_{k}" for k in (1, 2, 3))}
    assert gpd.read_file(study, layer="coverage_level_1").area.sum() == pytest.approx(DISC, abs=1)
    summary = pyogrio.read_dataframe(study, layer="coverage_summary", read_geometry=False)
    assert list(summary["level"]) == [0, 1, 2, 3]
    assert summary["area_m2"][1] == pytest.approx(DISC, rel=1e-9)
    assert summary["fraction"].sum() == pytest.approx(1)


def test_one_layer_formats_hold_all_levels(tmp_path):
    study = write_study(tmp_path / "town.gpkg", [(0, 0), (R, 0)])
    done = run("coverage", study, "--radius", R, "-o", tmp_path / "levels.parquet")
    assert done.returncode == 0, done.stderr
    assert list(gpd.read_parquet(tmp_path / "levels.parquet")["level"]) == [1, 2]


def test_files_of_two_crss_are_brought_together(tmp_path):
    study = write_study(tmp_path / "town.gpkg", [(0, 0)])
    anchors = gpd.read_file(study, layer="anchors").to_crs(4326)
    lonlat = tmp_path / "cars.csv"
    place = anchors.geometry.iloc[0]
    lonlat.write_text(f"id,lon,lat\na,{place.x:.10f},{place.y:.10f}\n")
    found = answer("coverage", "--anchors", lonlat, "--transit", f"{study}:transit", "--radius", R)
    assert areas(found["results"][0])[1] == pytest.approx(DISC, rel=1e-9)


@pytest.mark.parametrize(
    ("arguments", "code", "told"),
    [
        (["--anchors", "cars.csv"], 2, "--transit"),
        (["--transit", "roads.gpkg"], 2, "--anchors"),
        (["town.gpkg", "--radius", "wide"], 2, "--radius"),
        (["town.gpkg", "-o", "levels.tif"], 2, "--raster"),
        (["town.gpkg", "--plot", "x.png"], 2, "--curve"),
        (["town.gpkg", "--workers", "2", "--raster", "1", "-o", "x.tif"], 2, "--raster"),
        (["town.gpkg", "--tile", "90", "-o", "levels.fgb"], 2, ".gpkg"),
        (["no.gpkg", "--radius", "15"], 1, "mend:"),
    ],
)
def test_what_does_not_fit_is_told_on_stderr(arguments, code, told):
    done = run("coverage", *arguments)
    assert done.returncode == code
    assert told in done.stderr
    assert done.stdout == ""
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("radius", ["0", "-15", "nan", "inf"])
def test_a_radius_that_is_none_is_refused(mixed, radius):
    done = run("coverage", mixed, "--radius", radius)
    assert done.returncode == 1
    assert "mend:" in done.stderr


def test_without_input_the_sample_study_is_used_and_named():
    from covertool.errors import FileError
    from covertool.gis.sample import sample_folder

    try:
        sample_folder()
    except FileError:
        pytest.skip("the sample study is not made yet")
    done = run("coverage", "--radius", "15")
    assert done.returncode == 0, done.stderr
    assert "sample.gpkg" in done.stderr
    assert "Level 3" in done.stdout


def test_a_short_run_loads_no_library_that_it_does_not_use(tmp_path):
    study = write_study(tmp_path / "town.gpkg", [(0, 0)])
    program = f"""
import sys
from covertool.cli.main import main
assert main(["coverage", {str(study)!r}, "--radius", "15"]) == 0
heavy = {{"pandas", "geopandas", "pyogrio", "pyarrow", "rasterio", "scipy.linalg", "matplotlib"}}
heavy |= {{"covertool.cli.simulate", "covertool.cli.extract"}}
sys.exit(", ".join(sorted(heavy & set(sys.modules))) or 0)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr

"""The other questions of `covertool coverage`: curves, shares, zones, pixels, tiles."""

import math

import geopandas as gpd
import numpy as np
import pytest
import rasterio
import shapely

from covertool.gis.sample import SAMPLE_STUDY, sample_folder
from covertool.gis.study import read_tables
from tests.running import answer, run

EAST, NORTH, CRS = 693_000.0, 737_000.0, "EPSG:2157"


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    """A folder with a study of random cars along two crossing roads, and two districts."""
    folder = tmp_path_factory.mktemp("town")
    rng = np.random.default_rng(5)
    x = EAST + np.concatenate([rng.uniform(0, 1000, 150), rng.normal(500, 6, 150)])
    y = NORTH + np.concatenate([rng.normal(500, 6, 150), rng.uniform(0, 1000, 150)])
    origin = ["parked"] * 250 + ["queue"] * 50
    anchors = gpd.GeoDataFrame({"origin": origin}, geometry=shapely.points(x, y), crs=CRS)
    anchors.to_file(folder / "town.gpkg", layer="anchors")
    roads = [
        shapely.box(EAST, NORTH + 495, EAST + 1000, NORTH + 505),
        shapely.box(EAST + 495, NORTH, EAST + 505, NORTH + 495),
        shapely.box(EAST + 495, NORTH + 505, EAST + 505, NORTH + 1000),
    ]
    kinds = ["primary", "residential", "residential"]
    gpd.GeoDataFrame({"highway": kinds}, geometry=roads, crs=CRS).to_file(
        folder / "town.gpkg", layer="transit"
    )
    halves = [
        shapely.box(EAST, NORTH, EAST + 400, NORTH + 1000),
        shapely.box(EAST + 400, NORTH, EAST + 1000, NORTH + 1000),
    ]
    gpd.GeoDataFrame(
        {"name": ["west", "east"], "ward": ["1", "2"]}, geometry=halves, crs=CRS
    ).to_file(folder / "districts.gpkg", layer="districts")
    return folder


def fractions(result: dict) -> list[float]:
    return [result["levels"][str(level)]["fraction"] for level in range(4)]


def test_districts_that_part_the_town_add_up_to_it(town):
    found = answer(
        "coverage", town / "town.gpkg", "--radius", "15", "--by", f"{town / 'districts.gpkg'}:ward"
    )
    assert [zone["zone"] for zone in found["zones"]] == ["1", "2"]
    summed = sum(zone["transit_area_m2"] * np.array(zone["fractions"]) for zone in found["zones"])
    whole = np.array(fractions(found["results"][0])) * found["transit_area_m2"]
    assert summed == pytest.approx(whole, abs=1e-6)


def test_a_column_of_the_transit_layer_makes_zones(town):
    found = answer("coverage", town / "town.gpkg", "--radius", "15", "--by", "highway")
    sizes = {zone["zone"]: zone["transit_area_m2"] for zone in found["zones"]}
    assert sizes == pytest.approx({"primary": 10_000.0, "residential": 9_900.0})


def test_an_unknown_column_is_told_with_those_there_are(town):
    done = run("coverage", town / "town.gpkg", "--by", "surface")
    assert done.returncode == 1
    assert "highway" in done.stderr


def test_an_area_of_interest_cuts_the_transit_area_and_not_the_anchors(town, tmp_path):
    aoi = gpd.GeoDataFrame(
        geometry=[shapely.box(EAST, NORTH, EAST + 400, NORTH + 1000)], crs=CRS
    ).to_crs(4326)
    aoi.to_file(tmp_path / "aoi.geojson")
    found = answer(
        "coverage", town / "town.gpkg", "--radius", "15", "--aoi", tmp_path / "aoi.geojson"
    )
    assert found["transit_area_m2"] == pytest.approx(4000, rel=1e-4)
    assert found["anchors"] == 300


def test_penetration_runs_from_nothing_to_all(town, tmp_path):
    plot = tmp_path / "shares.svg"
    found = answer(
        "coverage", town / "town.gpkg", "--radius", "15", "--penetration", "0,0.5,1", "--plot", plot
    )
    none, half, whole = found["penetration"]
    assert none["expected"] == pytest.approx([1, 0, 0, 0])
    assert whole["expected"] == pytest.approx(fractions(found["results"][0]), abs=2e-4)
    assert 0 < half["expected"][3] < whole["expected"][3]
    assert all(error < 1e-3 for error in half["se"])
    assert plot.read_text().startswith("<?xml")


def test_a_curve_that_cannot_be_read_is_told(town):
    done = run("coverage", town / "town.gpkg", "--radius", "15", "--curve", "5:200")
    assert done.returncode == 1
    assert "START:STOP:COUNT" in done.stderr


def test_a_share_above_one_is_refused(town):
    done = run("coverage", town / "town.gpkg", "--penetration", "1.5")
    assert done.returncode == 1
    assert "mend:" in done.stderr


def test_the_level_raster_counts_what_the_exact_table_says(town, tmp_path):
    found = answer(
        "coverage",
        town / "town.gpkg",
        "--radius",
        "15",
        "--raster",
        "0.5",
        "-o",
        tmp_path / "l.tif",
    )
    with rasterio.open(tmp_path / "l.tif") as dataset:
        levels = dataset.read(1)
        assert dataset.res == (0.5, 0.5)
        assert dataset.nodata == 255
    assert found["raster"]["fractions"] == pytest.approx(fractions(found["results"][0]), abs=5e-5)
    counted = np.bincount(levels[levels != 255], minlength=4)[:4] / np.sum(levels != 255)
    assert counted == pytest.approx(fractions(found["results"][0]), abs=2e-3)


def test_the_curve_is_exact_at_its_nodes_and_its_slopes_fit(town, tmp_path):
    plot = tmp_path / "curve.png"
    found = answer(
        "coverage", town / "town.gpkg", "--radius", "15", "--curve", "14.99:15.01:3", "--plot", plot
    )
    before, node, after = found["curve"]
    assert node["fractions"] == pytest.approx(fractions(found["results"][0]), abs=1e-12)
    slope = (np.array(after["fractions"]) - before["fractions"]) / 0.02
    assert node["slopes"] == pytest.approx(slope, abs=2e-3)
    assert plot.read_bytes().startswith(b"\x89PNG")


def test_a_plot_says_whether_its_anchors_are_synthetic(town, tmp_path):
    for study, count in (
        (sample_folder() / SAMPLE_STUDY, "4,541 synthetic anchors"),
        (town / "town.gpkg", "300 anchors"),
    ):
        plot = tmp_path / "curve.svg"
        words = ["--radius", "15", "--curve", "5:50:3", "--plot", plot, "--overwrite"]
        assert run("coverage", study, *words).returncode == 0
        assert count in plot.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def parquet(town):
    """The town as sorted GeoParquet, by the command."""
    for layer, name in (("anchors", "cars.parquet"), ("transit", "roads.parquet")):
        done = run("convert", f"{town / 'town.gpkg'}:{layer}", town / name)
        assert done.returncode == 0, done.stderr
    return ["--anchors", town / "cars.parquet", "--transit", town / "roads.parquet"]


@pytest.mark.parametrize(
    "how",
    [
        ["--tile", "170"],
        ["--workers", "2", "--tile", "310"],
        pytest.param(
            ["--scheduler", "local", "--workers", "2", "--tile", "310"], marks=pytest.mark.slow
        ),
    ],
    ids=["tiles", "processes", "dask"],
)
def test_tiles_give_the_fractions_of_one_process(town, parquet, how):
    if "--scheduler" in how:
        pytest.importorskip("distributed")
    radii = ["--radius", "15", "--device-class", "B"]
    whole = answer("coverage", town / "town.gpkg", *radii)
    tiled = answer("coverage", *parquet, *radii, *how)
    assert tiled["transit_area_m2"] == pytest.approx(whole["transit_area_m2"], rel=1e-12)
    assert len(tiled["results"]) == len(whole["results"]) == 6
    for one, other in zip(whole["results"], tiled["results"], strict=True):
        assert fractions(other) == pytest.approx(fractions(one), abs=1e-12)
        for key in ("radius_m", "device_class", "origin", "anchors"):
            assert other[key] == one[key]


@pytest.fixture(scope="module")
def everything(town, tmp_path_factory):
    """All that a run can find, in memory and in tiles by two processes, and the two studies."""
    folder = tmp_path_factory.mktemp("everything")
    asked = [
        town / "town.gpkg", "--radius", "15", "--radius", "30", "--curve", "5:60:3",
        "--penetration", "0.1,0.5", "--by", f"{town / 'districts.gpkg'}:districts",
        "--aoi", f"{town / 'districts.gpkg'}:districts",
    ]  # fmt: skip
    whole = answer("coverage", *asked, "-o", folder / "whole.gpkg")
    how = ["--tile", "230", "--workers", "2", "-o", folder / "tiled.gpkg"]
    return whole, answer("coverage", *asked, *how), folder


def test_tiles_find_zones_curves_and_levels_as_one_process_does(everything):
    whole, tiled, _ = everything
    for one, other in zip(whole["results"], tiled["results"], strict=True):
        assert fractions(other) == pytest.approx(fractions(one), abs=1e-12)
        assert other["anchors"] == one["anchors"]
    assert len(whole["curve"]) == 3
    for one, other in zip(whole["curve"], tiled["curve"], strict=True):
        assert other["fractions"] == pytest.approx(one["fractions"], abs=1e-12)
        assert other["slopes"] == pytest.approx(one["slopes"], abs=1e-12)
    assert len(whole["zones"]) == 4
    for one, other in zip(whole["zones"], tiled["zones"], strict=True):
        assert (other["zone"], other["radius_m"]) == (one["zone"], one["radius_m"])
        assert other["fractions"] == pytest.approx(one["fractions"], abs=1e-12)


def test_tiles_expect_of_equipped_shares_what_one_process_does(everything):
    whole, tiled, _ = everything
    assert len(whole["penetration"]) == 4
    for one, other in zip(whole["penetration"], tiled["penetration"], strict=True):
        assert (other["share"], other["radius_m"]) == (one["share"], one["radius_m"])
        for level in range(4):
            apart = abs(other["expected"][level] - one["expected"][level])
            assert apart <= 3 * (one["se"][level] + other["se"][level]) + 1e-12


def test_level_layers_of_tiles_cover_what_those_of_one_process_do(everything):
    _, _, folder = everything
    for level in (1, 2, 3):
        whole = gpd.read_file(folder / "whole.gpkg", layer=f"coverage_level_{level}")
        tiled = gpd.read_file(folder / "tiled.gpkg", layer=f"coverage_level_{level}")
        assert len(tiled) > len(whole)
        assert set(tiled["radius_m"]) == set(whole["radius_m"])  # a level of no area has no row
        assert tiled.is_valid.all()
        for radius_m in set(whole["radius_m"]):
            one = whole.geometry[whole["radius_m"] == radius_m].union_all()
            other = tiled.geometry[tiled["radius_m"] == radius_m].union_all()
            assert one.symmetric_difference(other).area <= 0.01 * one.length
            parts = tiled.geometry[tiled["radius_m"] == radius_m].area.sum()
            assert parts == pytest.approx(other.area, rel=1e-9)


def test_a_study_holds_the_tables_of_all_that_was_found(everything):
    whole, _, folder = everything
    names = ("coverage_summary", "coverage_curve", "coverage_penetration", "coverage_zones")
    for study in ("whole.gpkg", "tiled.gpkg"):
        tables = read_tables(folder / study, names)
        assert tuple(tables) == names
        assert [len(table) for table in tables.values()] == [24, 12, 16, 16]
        curve = tables["coverage_curve"]
        told = [share for node in whole["curve"] for share in node["fractions"]]
        assert curve["fraction"].tolist() == pytest.approx(told, abs=1e-12)


def test_an_area_of_interest_elsewhere_is_told_by_tiles_too(town, tmp_path):
    sea = gpd.GeoDataFrame(
        geometry=[shapely.box(EAST - 900, NORTH, EAST - 800, NORTH + 9)], crs=CRS
    )
    sea.to_file(tmp_path / "sea.gpkg")
    done = run("coverage", town / "town.gpkg", "--tile", "300", "--aoi", tmp_path / "sea.gpkg")
    assert done.returncode == 1
    assert "area of interest" in done.stderr


def test_a_resumed_run_leaves_no_ledger_and_the_same_numbers(town, tmp_path):
    study, ledger = town / "town.gpkg", tmp_path / "ledger"
    first = answer("coverage", study, "--radius", "15", "--tile", "400", "--resume", ledger)
    assert not ledger.exists()
    assert (
        first["results"] == answer("coverage", study, "--radius", "15", "--tile", "400")["results"]
    )


def test_convert_refuses_another_format(town, tmp_path):
    done = run("convert", f"{town / 'town.gpkg'}:anchors", tmp_path / "cars.geojson")
    assert done.returncode == 1
    assert "mend:" in done.stderr


def test_one_car_on_a_wide_square_covers_pi_r_squared_in_tiles(tmp_path):
    study = tmp_path / "one.gpkg"
    car = gpd.GeoDataFrame(geometry=[shapely.Point(EAST + 100, NORTH + 100)], crs=CRS)
    square = gpd.GeoDataFrame(geometry=[shapely.box(EAST, NORTH, EAST + 200, NORTH + 200)], crs=CRS)
    car.to_file(study, layer="anchors")
    square.to_file(study, layer="transit")
    found = answer("coverage", study, "--radius", "50", "--tile", "60")
    area = found["results"][0]["levels"]["1"]["area_m2"]
    assert area == pytest.approx(math.pi * 50**2, rel=1e-12)

"""`covertool export`: maps, layers and tables of a study that the commands themselves made."""

import hashlib
import json
import re
from pathlib import Path

import cv2
import geopandas as gpd
import numpy as np
import openpyxl
import pandas as pd
import pyarrow.parquet as pq
import pyogrio
import pytest
import shapely

import covertool
from covertool.cli.main import main
from covertool.gis.study import layer_names, read_tables, table_names
from covertool.gis.write import write_layers
from covertool.model import Anchors, TransitArea
from tests.running import run

MIDDLE = "693900,737350,694300,737650"
COLOURS = {"blue": (79, 129, 189), "yellow": (255, 217, 47), "orange": (253, 141, 60)}


@pytest.fixture(scope="module")
def study(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("export") / "sample.gpkg"
    done = run("coverage", "--radius", "15", "-o", path)
    assert done.returncode == 0, done.stderr
    return path


@pytest.fixture
def told(capsys):
    """Run a command in this process; return its exit code and what it says on stderr."""

    def run_here(*arguments: object) -> tuple[int, str]:
        code = main([str(argument) for argument in arguments])
        return code, capsys.readouterr().err

    return run_here


@pytest.fixture
def small(tmp_path) -> Path:
    """A street of 100 m by 10 m with three cars and a table that a user might have written."""
    crs = "EPSG:2157"
    cars = Anchors.from_points([695010.0, 695012, 695090], [737000.0] * 3, crs)
    road = TransitArea(shapely.MultiPolygon([shapely.box(695000, 736995, 695100, 737005)]), crs)
    summary = pd.DataFrame(
        {"radius_m": 15.0, "level": [0, 1, 2, 3], "area_m2": 250.0, "fraction": 0.25}
    )
    zones = pd.DataFrame({"zone": ["=1+1"], "radius_m": [15.0]})
    path = tmp_path / "small.gpkg"
    layers = {"anchors": cars.to_frame(), "transit": road.to_frame()}
    tables = {"coverage_summary": summary, "coverage_zones": zones}
    told = {"title": "Small", "licence": "CC0", "data_date": "May 2026"}
    write_layers(path, {**layers, **tables}, metadata=told)
    return path


def test_the_map_shows_the_papers_colours(study, tmp_path):
    out = tmp_path / "map.png"
    assert run("export", study, "-o", out, "--bounds", MIDDLE).returncode == 0
    picture = cv2.imread(str(out))[..., ::-1].astype(int)
    for name, colour in {**COLOURS, "red": (227, 26, 28), "black": (0, 0, 0)}.items():
        near = np.abs(picture - colour).max(axis=2) < 12
        assert near.mean() > 0.001, name


def test_a_map_of_synthetic_data_says_so(study, tmp_path, told):
    out = tmp_path / "map.svg"
    assert told("export", study, "-o", out, "--bounds", MIDDLE)[0] == 0
    assert "synthetic: Synthetic Maynooth-like town" in out.read_text()


def test_a_radius_that_was_not_computed_names_its_verb(study, tmp_path, told):
    code, said = told("export", study, "-o", tmp_path / "map.png", "--radius", "400")
    assert code == 1
    assert "covertool coverage STUDY --radius 400" in said
    assert list(tmp_path.iterdir()) == []


def test_a_map_prints_scale_north_crs_date_licence_and_run(small, tmp_path):
    covertool.export(small, tmp_path / "map.svg")
    # matplotlib draws letters as curves and leaves the words as a comment beside them
    texts = re.findall("<!-- (.*?) -->", (tmp_path / "map.svg").read_text(), re.DOTALL)
    run_id = hashlib.sha256(small.read_bytes()).hexdigest()[:12]
    for words in ("20 m", "CRS EPSG:2157", "Data of: May 2026", "CC0", f"run {run_id}"):
        assert any(words in text for text in texts), words
    assert {"N", "3 parked cars"} <= set(texts)


def test_the_same_study_gives_the_same_bytes_in_every_format(small, tmp_path):
    outputs = {
        "png": {}, "svg": {}, "pdf": {}, "xlsx": {}, "tex": {}, "md": {}, "gpkg": {}, "kml": {},
        "shp.zip": {}, "geojson": {"layers": ["transit"]}, "parquet": {"layers": ["transit"]},
        "fgb": {"layers": ["transit"]}, "csv": {"table": "coverage"},
    }  # fmt: skip
    for suffix, options in outputs.items():
        first, second = tmp_path / f"a.{suffix}", tmp_path / f"b.{suffix}"
        for out in (first, second):
            covertool.export(small, out, **options)
        assert first.read_bytes() == second.read_bytes(), suffix


def test_a_layer_goes_out_in_degrees_as_geojson(study, tmp_path, told):
    out = tmp_path / "transit.geojson"
    assert told("export", study, "--layer", "transit", "-o", out)[0] == 0
    content = json.loads(out.read_text())
    lon, lat = content["features"][0]["geometry"]["coordinates"][0][0][0][:2]
    assert -6.7 < lon < -6.5
    assert 53.3 < lat < 53.5
    assert "provenance export" in content["description"]


def test_provenance_lies_in_geoparquet_too(small, tmp_path):
    covertool.export(small, tmp_path / "t.parquet", layers=["transit"])
    told = pq.ParquetFile(tmp_path / "t.parquet").schema_arrow.metadata[b"PANDAS_ATTRS"]
    assert json.loads(json.loads(told)["covertool"])["licence"] == "CC0"


def test_a_whole_geopackage_takes_layers_tables_and_metadata_along(small, tmp_path):
    covertool.export(small, tmp_path / "all.gpkg")
    assert layer_names(tmp_path / "all.gpkg") == ["anchors", "transit"]
    assert table_names(tmp_path / "all.gpkg") == ["coverage_summary", "coverage_zones"]
    for name, table in read_tables(small, table_names(small)).items():
        copy = read_tables(tmp_path / "all.gpkg", [name])[name]
        pd.testing.assert_frame_equal(copy, table)


def test_discs_are_round_lie_on_their_cars_and_have_the_asked_size(small, tmp_path, told):
    out = tmp_path / "d.gpkg"
    assert told("export", small, "--discs", "A", "--discs", "7.5", "-o", out)[0] == 0
    cars = gpd.read_file(small, layer="anchors")
    for layer, radius_m in (("discs_class_a", 15), ("discs_7_5_m", 7.5)):
        discs = gpd.read_file(out, layer=layer)
        assert discs["id"].tolist() == cars["id"].tolist()
        assert discs.centroid.distance(cars.geometry).max() < 1e-6
        reach = [
            shapely.hausdorff_distance(d, c)
            for d, c in zip(discs.geometry, cars.geometry, strict=True)
        ]
        assert reach == pytest.approx([radius_m] * 3, rel=1e-9)
        assert discs.area.tolist() == pytest.approx([np.pi * radius_m**2] * 3, rel=0.005)


@pytest.mark.parametrize("size", ["E", "-3", "0", "nan", "inf", ""])
def test_a_size_that_no_disc_has_is_refused(small, tmp_path, told, size):
    code, said = told("export", small, f"--discs={size}", "-o", tmp_path / "d.gpkg")
    assert code == 1
    assert "mend:  give a radius in metres or A, B, C, D" in said


def test_a_workbook_holds_every_table_and_no_formula(small, tmp_path, told):
    out = tmp_path / "t.xlsx"
    assert told("export", small, "-o", out) == (0, f"wrote {out}\n")
    book = openpyxl.load_workbook(out)
    assert book.sheetnames == ["summary", "coverage", "zones", "parameters", "dictionary"]
    assert (book["zones"]["A2"].value, book["zones"]["A2"].data_type) == ("=1+1", "s")
    back = pd.read_excel(out, sheet_name="coverage")
    assert back["Level 1: one (%)"].tolist() == [25]
    assert back["covered, Levels 1 to 3 (%)"].tolist() == [75]


def test_one_table_goes_out_as_csv_latex_or_markdown(small, tmp_path, told):
    for suffix in ("csv", "tex", "md"):
        assert told("export", small, "--table", "coverage", "-o", tmp_path / f"c.{suffix}")[0] == 0
    assert pd.read_csv(tmp_path / "c.csv")["level_3_percent"].tolist() == [25]
    assert "25.00" in (tmp_path / "c.tex").read_text()
    assert "| 25.00 |" in (tmp_path / "c.md").read_text()


@pytest.mark.parametrize(
    ("arguments", "mend"),
    [
        (["--table", "positioning", "-o", "p.csv"], "covertool simulate"),
        (["--show", "curve", "-o", "c.png"], "covertool coverage"),
        (["--show", "circuit", "-o", "c.png"], "covertool simulate"),
        (["--layer", "coverage_level_1", "-o", "c.geojson"], "covertool coverage"),
        (["-o", "levels.tif"], "--raster 0.5 -o"),
        (["-o", "page.html"], "covertool report"),
        (["-o", "c.geojson"], "add --layer NAME, one of: anchors, transit"),
        (["--show", "stars", "-o", "c.png"], "choose one of: coverage"),
        (["--table", "coverage", "-o", "c.fgb"], "use .xlsx, .csv, .tex or .md"),
        (["-o", "c.xyz"], ".shp.zip"),
        (["-o", "small.gpkg", "--overwrite"], "name another output"),
    ],
)
def test_what_cannot_be_exported_names_the_way_to_it(small, tmp_path, told, arguments, mend):
    before = sorted(tmp_path.iterdir())
    *rest, output = arguments if arguments[-1] != "--overwrite" else arguments[:-1]
    more = ["--overwrite"] if arguments[-1] == "--overwrite" else []
    code, said = told("export", small, *rest, tmp_path / output, *more)
    assert code == 1
    lines = said.splitlines()
    assert [line.partition(":")[0] for line in lines] == ["error", "where", "mend"]
    assert mend in lines[2]
    assert sorted(tmp_path.iterdir()) == before


def test_an_existing_output_is_kept_unless_overwritten(small, tmp_path, told):
    out = tmp_path / "t.md"
    out.write_text("mine")
    assert told("export", small, "-o", out)[0] == 1
    assert out.read_text() == "mine"
    assert told("export", small, "-o", out, "--overwrite")[0] == 0
    assert out.read_text().startswith("## Summary")


def test_layers_that_are_named_go_alone(small, tmp_path):
    covertool.export(small, tmp_path / "one.gpkg", layers=["transit"])
    names = [name for name, _ in pyogrio.list_layers(tmp_path / "one.gpkg")]
    assert names == ["transit", "layer_styles", "metadata"]

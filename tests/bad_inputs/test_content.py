"""What layers and tables hold: what is repaired and counted, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely

from tests.bad_inputs.conftest import (
    CRS,
    EAST_M,
    NORTH_M,
    Run,
    Town,
    assert_refused,
    assert_works_like,
)


def with_rows(frame: gpd.GeoDataFrame, *geometries: object) -> gpd.GeoDataFrame:
    more = gpd.GeoDataFrame({"id": [None] * len(geometries)}, geometry=list(geometries), crs=CRS)
    return gpd.GeoDataFrame(pd.concat([frame, more], ignore_index=True), crs=CRS)


def test_null_empty_and_nan_places_among_good_ones_are_dropped_and_counted(
    town: Town, coverage: Run
) -> None:
    bad = with_rows(
        town.anchors, None, shapely.Point(), shapely.Point(np.nan, 3), shapely.Point(np.inf, 1)
    )
    outcome = coverage(anchors=town.write("bad.parquet", bad))
    assert_works_like(coverage(), outcome)
    assert "dropped" in outcome.err


def test_a_layer_in_which_every_place_is_bad_is_refused(town: Town, coverage: Run) -> None:
    frame = town.anchors.set_geometry([shapely.Point(np.nan, np.nan)] * 8, crs=CRS)
    assert_refused(coverage(anchors=town.write("none.parquet", frame)), "none.parquet")


def test_no_car_at_all_covers_nothing_and_is_told(town: Town, coverage: Run) -> None:
    outcome = coverage(anchors=town.write("empty.gpkg", town.anchors.iloc[:0]))
    assert outcome.code == 0
    assert outcome.fractions() == [1, 0, 0, 0]
    assert "no anchors" in outcome.err or "empty" in outcome.err or "0 anchors" in outcome.err


def test_places_with_height_and_measure_and_several_in_one_row_are_points(
    town: Town, coverage: Run
) -> None:
    raised = town.anchors.set_geometry(shapely.force_3d(town.anchors.geometry, 30.0), crs=CRS)
    assert_works_like(coverage(), coverage(anchors=town.write("raised.gpkg", raised)))
    together = shapely.multipoints(town.anchors.geometry.to_numpy())
    frame = gpd.GeoDataFrame({"id": ["all"]}, geometry=[together], crs=CRS)
    assert_works_like(coverage(), coverage(anchors=town.write("together.gpkg", frame)))


def test_cars_on_the_same_spot_count_each(town: Town, coverage: Run) -> None:
    thrice = pd.concat([town.anchors] * 3, ignore_index=True)
    outcome = coverage(anchors=town.write("thrice.gpkg", thrice))
    levels = outcome.fractions()
    assert levels[0] == pytest.approx(coverage().fractions()[0], abs=1e-12)
    assert levels[1] == levels[2] == 0


def test_repeated_ids_change_nothing(town: Town, coverage: Run) -> None:
    same = town.anchors.assign(id="car")
    assert_works_like(coverage(), coverage(anchors=town.write("same.gpkg", same)))


def test_anchors_drawn_as_outlines_count_at_their_middle(town: Town, coverage: Run) -> None:
    squares = town.anchors.set_geometry(
        shapely.buffer(town.anchors.geometry.to_numpy(), 1, cap_style="square"), crs=CRS
    )
    outcome = coverage(anchors=town.write("squares.gpkg", squares))
    if outcome.code == 0:
        assert_works_like(coverage(), outcome, within=1e-9)
    else:
        assert_refused(outcome, "squares.gpkg")


@pytest.mark.parametrize("name", ["pieces", "nested", "twice", "bow_ties", "mixed"])
def test_a_transit_area_that_can_be_mended_gives_the_same_answer(
    name: str, town: Town, coverage: Run
) -> None:
    (cross,) = town.transit.geometry
    east = shapely.box(EAST_M - 120, NORTH_M - 3, EAST_M + 120, NORTH_M + 3)
    north = shapely.box(EAST_M - 3, NORTH_M - 120, EAST_M + 3, NORTH_M + 120)
    x, y = EAST_M, NORTH_M
    bow_tie = shapely.Polygon([(x - 120, y - 3), (x, y), (x - 120, y + 3), (x - 120, y - 3)])
    parts = {
        "pieces": [east, north],
        "nested": [cross, shapely.box(x - 2, y - 2, x + 2, y + 2)],
        "twice": [cross, cross],
        "bow_ties": [cross, bow_tie],
        "mixed": [
            cross,
            shapely.LineString([(x, y), (x + 9, y)]),
            shapely.Point(x, y),
            shapely.Polygon(),
            None,
        ],
    }[name]
    frame = gpd.GeoDataFrame({"id": range(len(parts))}, geometry=parts, crs=CRS)
    assert_works_like(coverage(), coverage(transit=town.write(f"{name}.parquet", frame)))


def test_an_outline_that_crosses_itself_is_repaired_and_counted(town: Town, coverage: Run) -> None:
    x, y = EAST_M, NORTH_M
    bow_tie = shapely.Polygon([(x - 50, y - 5), (x + 50, y + 5), (x + 50, y - 5), (x - 50, y + 5)])
    halves = [
        shapely.Polygon([(x - 50, y - 5), (x, y), (x - 50, y + 5)]),
        shapely.Polygon([(x + 50, y - 5), (x, y), (x + 50, y + 5)]),
    ]
    bad = gpd.GeoDataFrame({"id": [1]}, geometry=[bow_tie], crs=CRS)
    good = gpd.GeoDataFrame({"id": [1, 2]}, geometry=halves, crs=CRS)
    outcome = coverage(transit=town.write("bow_tie.parquet", bad))
    assert_works_like(coverage(transit=town.write("halves.parquet", good)), outcome)
    assert "repaired" in outcome.err


@pytest.mark.parametrize(
    "shape",
    [
        shapely.LineString([(EAST_M, NORTH_M), (EAST_M + 9, NORTH_M)]),
        shapely.Polygon([(EAST_M, NORTH_M), (EAST_M + 9, NORTH_M), (EAST_M + 3, NORTH_M)]),
        shapely.Polygon(),
    ],
    ids=["a line", "a flat polygon", "an empty polygon"],
)
def test_a_transit_area_of_nothing_is_refused(
    shape: shapely.Geometry, town: Town, coverage: Run
) -> None:
    frame = gpd.GeoDataFrame({"id": [1]}, geometry=[shape], crs=CRS)
    assert_refused(coverage(transit=town.write("flat.parquet", frame)), "flat.parquet")


@pytest.mark.parametrize(
    ("column", "value"),
    [("radius_m", 0.0), ("radius_m", -15.0), ("radius_m", np.inf), ("sigma_m", -1.0)],
)
def test_a_column_out_of_range_is_refused_by_its_name(
    column: str, value: float, town: Town, coverage: Run
) -> None:
    frame = town.anchors.assign(**{column: value})
    outcome = coverage("--radius", "own", anchors=town.write("bad.gpkg", frame))
    assert_refused(outcome, "bad.gpkg", column)


@pytest.mark.parametrize("radius", ["0", "-15", "nan", "inf", "fifteen", "1e300"])
def test_a_radius_that_is_none_is_refused(radius: str, town: Town, run: Run) -> None:
    outcome = run(
        "coverage", "--radius", radius,
        "--anchors", town.anchors_file(), "--transit", town.transit_file(),
    )  # fmt: skip
    assert outcome.code in (1, 2), outcome
    assert "Traceback" not in outcome.err
    assert outcome.out == ""


def test_a_misspelt_device_class_column_is_pointed_out(town: Town, coverage: Run) -> None:
    frame = town.anchors.assign(device_clas="A")
    outcome = coverage("--radius", "own", anchors=town.write("bad.gpkg", frame))
    assert "device_class" in outcome.err


@pytest.mark.parametrize("column", ["fid", "geometry_1", "Geometry", "ogc_fid", "GEOM", "index"])
def test_columns_named_like_those_of_a_format_do_no_harm(
    column: str, town: Town, coverage: Run, tmp_path: Path
) -> None:
    frame = town.anchors.assign(**{column: range(8)})
    path = town.write("clash.parquet", frame)
    assert_works_like(coverage(), coverage("-o", tmp_path / "out.gpkg", anchors=path))


@pytest.mark.parametrize(
    "text",
    [
        "x,y\n{x},{y}\n",
        "\ufeffx,y\n{x},{y}\n",
        "x;y\n{x};{y}\n".replace(".", ","),
        "X, Y\r\n{x}, {y}\r\n",
        'id,x,y\n"=HYPERLINK(""http://example.com"")",{x},{y}\n',
        "x\ty\n{x}\t{y}\n",
    ],
    ids=["plain", "BOM", "decimal comma", "capitals and CRLF", "formula", "tabs"],
)
def test_a_table_of_points_reads_in_any_dress(text: str, town: Town, coverage: Run) -> None:
    x, y = f"{EAST_M + 10.5}", f"{NORTH_M + 0.25}"
    if ";" in text:
        x, y = x.replace(".", ","), y.replace(".", ",")
    path = town.folder / "points.csv"
    path.write_text(text.format(x=x, y=y), encoding="utf-8")
    one = gpd.GeoDataFrame(
        {"id": ["a"]}, geometry=[shapely.Point(EAST_M + 10.5, NORTH_M + 0.25)], crs=CRS
    )
    outcome = coverage("--crs", CRS, anchors=path)
    clean = coverage(anchors=town.write("one.gpkg", one))
    assert_works_like(clean, outcome)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\x00\x01\x02\xff",
        b"x,y\n\xff\xfe,1\n",
        b"a,b\n1,2\n",
        b"x,y\nnan,nan\n",
        b'x,y\n"1,2\n',
        b"{" * 10_000,
        b"lon,lat\n53.3,-200\n",
    ],
    ids=[
        "zero bytes", "binary", "not UTF-8", "other columns", "NaN only", "open quote",
        "braces", "beyond the pole",
    ],
)  # fmt: skip
def test_a_table_that_is_none_is_refused(content: bytes, town: Town, coverage: Run) -> None:
    path = town.folder / "points.csv"
    path.write_bytes(content)
    crs = [] if content.startswith(b"lon") else ["--crs", CRS]
    assert_refused(coverage(*crs, anchors=path), "points.csv")


@pytest.mark.parametrize(
    "text",
    [
        '{"type": "FeatureCollection"',
        '{"type": "FeatureCollection", "features": 3}',
        '{"a": ' * 5000,
        "[]",
        '{"type": "FeatureCollection", "features": [{"type": "Feature"}]}',
    ],
    ids=["truncated", "wrong type", "deep nesting", "no object", "no geometry"],
)
def test_json_that_is_no_layer_is_refused(text: str, town: Town, coverage: Run) -> None:
    path = town.folder / "anchors.geojson"
    path.write_text(text)
    assert_refused(coverage(anchors=path), "anchors.geojson")


@pytest.mark.parametrize(
    ("status", "value"), [("occupancy", "1.5"), ("occupancy", "-0.1"), ("occupancy", "nan")]
)
def test_an_occupancy_outside_0_to_1_is_refused(
    status: str, value: str, town: Town, run: Run
) -> None:
    path = town.folder / "t.osm"
    path.write_text("<?xml version='1.0'?><osm version='0.6'></osm>")
    outcome = run("anchors", "parked", "--osm", path, "--occupancy", value, "--json")
    assert outcome.code in (1, 2)
    assert "Traceback" not in outcome.err


def test_times_without_a_zone_are_refused_with_the_option(town: Town, run: Run) -> None:
    path = town.folder / "seen.csv"
    path.write_text("time,segment_id,status\n2026-01-05T08:00,a,slow\n")
    line = shapely.LineString([(EAST_M, NORTH_M), (EAST_M + 90, NORTH_M)])
    net = gpd.GeoDataFrame({"segment_id": ["a"]}, geometry=[line], crs=CRS)
    segments = town.write("net.gpkg", net)
    outcome = run("congestion", "table", path, "--segments", segments)
    assert outcome.code == 2
    assert "--tz" in outcome.err


def test_formula_text_in_a_zone_name_stays_text(town: Town, coverage: Run, tmp_path: Path) -> None:
    zone = shapely.box(EAST_M - 200, NORTH_M - 200, EAST_M + 200, NORTH_M + 200)
    frame = gpd.GeoDataFrame({"name": ["=1+1"]}, geometry=[zone], crs=CRS)
    outcome = coverage("--by", f"{town.write('zones.gpkg', frame)}:name")
    (found,) = json.loads(outcome.out)["zones"]
    assert found["zone"] == "=1+1"

"""Tables without geometry in a GeoPackage, as SQLite and covertool's own reader see them."""

import sqlite3
from contextlib import closing
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely

from covertool.errors import FileError, GeometryError
from covertool.gis import study
from covertool.gis.write import write_layers

SUMMARY = pd.DataFrame(
    {
        "radius_m": [15.0, np.nan],
        "device_class": np.array([None, "A"], dtype=object),
        "level": [1, 2],
        "area_m2": [12.5, 7.25],
    }
)


def road() -> gpd.GeoDataFrame:
    return gpd.GeoDataFrame(geometry=[shapely.box(0, 0, 10, 10)], crs=2157)


def ask(path: Path, sql: str) -> list[tuple[object, ...]]:
    with closing(sqlite3.connect(f"{path.as_uri()}?mode=ro", uri=True)) as connection:
        return connection.execute(sql).fetchall()


def test_a_plain_table_is_registered_as_attributes_and_has_no_geometry(tmp_path: Path) -> None:
    path = tmp_path / "s.gpkg"
    write_layers(path, {"transit": road(), "coverage_summary": SUMMARY})
    kinds = dict(ask(path, "SELECT table_name, data_type FROM gpkg_contents"))
    assert kinds["coverage_summary"] == "attributes"
    assert kinds["transit"] == "features"
    assert ask(path, "SELECT table_name FROM gpkg_geometry_columns") == [("transit",)]
    assert ask(path, "SELECT radius_m, device_class, level, area_m2 FROM coverage_summary") == [
        (15.0, None, 1, 12.5),
        (None, "A", 2, 7.25),
    ]
    assert ask(path, "PRAGMA integrity_check") == [("ok",)]


def test_layers_and_tables_are_listed_apart(tmp_path: Path) -> None:
    path = tmp_path / "s.gpkg"
    write_layers(path, {"coverage_summary": SUMMARY, "transit": road()}, metadata={"a": "b"})
    assert study.layer_names(path) == ["transit"]
    assert study.table_names(path) == ["coverage_summary"]


def test_a_table_comes_back_as_it_was_and_an_absent_one_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "s.gpkg"
    write_layers(path, {"coverage_summary": SUMMARY})
    found = study.read_tables(path, ["occupancy", "coverage_summary", "metadata"])
    assert list(found) == ["coverage_summary"]
    back = found["coverage_summary"]
    assert list(back.columns) == list(SUMMARY.columns)
    pd.testing.assert_frame_equal(
        back.drop(columns="device_class"), SUMMARY.drop(columns="device_class")
    )
    assert [v if isinstance(v, str) else None for v in back["device_class"]] == [None, "A"]


def test_into_replaces_a_table_and_leaves_the_layers(tmp_path: Path) -> None:
    path = tmp_path / "s.gpkg"
    write_layers(path, {"transit": road(), "coverage_summary": SUMMARY})
    before = ask(path, "SELECT * FROM transit")
    write_layers(path, {"coverage_summary": SUMMARY.iloc[:1], "curve": SUMMARY}, into=True)
    assert ask(path, "SELECT count(*) FROM coverage_summary") == [(1,)]
    assert ask(path, "SELECT * FROM transit") == before
    assert study.table_names(path) == ["coverage_summary", "curve"]


def test_a_name_may_turn_from_a_table_into_a_layer_and_back(tmp_path: Path) -> None:
    path = tmp_path / "s.gpkg"
    write_layers(path, {"anchors": SUMMARY})
    write_layers(path, {"anchors": road()}, into=True)
    assert study.layer_names(path) == ["anchors"]
    write_layers(path, {"anchors": SUMMARY}, into=True)
    assert study.layer_names(path) == []
    assert ask(path, "SELECT count(*) FROM layer_styles") == [(0,)]
    assert ask(path, "SELECT count(*) FROM sqlite_master WHERE name LIKE 'rtree_%'") == [(0,)]


def test_the_same_tables_give_the_same_bytes(tmp_path: Path) -> None:
    for name in ("one.gpkg", "two.gpkg"):
        write_layers(tmp_path / name, {"transit": road(), "coverage_summary": SUMMARY})
    assert (tmp_path / "one.gpkg").read_bytes() == (tmp_path / "two.gpkg").read_bytes()


def test_a_table_without_rows_keeps_its_columns(tmp_path: Path) -> None:
    path = tmp_path / "s.gpkg"
    write_layers(path, {"coverage_summary": SUMMARY.iloc[:0]})
    back = study.read_tables(path, ["coverage_summary"])["coverage_summary"]
    assert list(back.columns) == list(SUMMARY.columns)
    assert len(back) == 0


def test_a_table_goes_into_a_geopackage_only(tmp_path: Path) -> None:
    with pytest.raises(GeometryError, match="coverage_summary"):
        write_layers(tmp_path / "s.geojson", {"coverage_summary": SUMMARY})
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_is_no_geopackage_holds_no_tables(tmp_path: Path) -> None:
    path = tmp_path / "s.gpkg"
    path.write_text("no")
    with pytest.raises(FileError):
        study.table_names(path)

"""GeoPackages read straight from SQLite hold what GDAL reads in them."""

import sqlite3
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path

import geopandas as gpd
import numpy as np
import pyogrio
import pytest
import shapely

from covertool.errors import FileError
from covertool.gis.features import feature_layers, read_features
from covertool.gis.layers import read_layer
from covertool.gis.read import read_anchors


@pytest.fixture
def town(tmp_path: Path) -> Path:
    """Return a file with every type of column, gaps, Z coordinates and an odd layer name."""
    frame = gpd.GeoDataFrame(
        {
            "whole": [1, 2, 3],
            "some": [1.5, None, -2.0],
            "said": [True, False, True],
            "text": ["a", None, "\u00e9'\"; --"],
            "seen": [datetime(2024, 5, 1, 12, tzinfo=UTC)] * 3,
        },
        geometry=[shapely.Point(1, 2, 3), None, shapely.box(0, 0, 1, 1)],
        crs=2157,
    )
    path = tmp_path / "town.gpkg"
    pyogrio.write_dataframe(frame, path, layer='odd "name"', layer_options={"SPATIAL_INDEX": "NO"})
    pyogrio.write_dataframe(frame.iloc[:0], path, layer="none", geometry_type="Point")
    return path


def test_layers_are_those_with_geometry_in_the_files_order(town: Path) -> None:
    assert feature_layers(town) == ['odd "name"', "none"]


def test_columns_and_geometries_are_those_that_gdal_reads(town: Path) -> None:
    ours = read_layer(f'{town}:odd "name"', None).frame
    theirs = pyogrio.read_dataframe(town, layer='odd "name"', force_2d=True)
    assert ours.crs == theirs.crs
    assert list(ours.columns) == list(theirs.columns)
    for name in theirs.columns.drop("geometry"):
        assert ours[name].isna().tolist() == theirs[name].isna().tolist()
        there = theirs[name].notna()
        assert ours[name][there].tolist() == theirs[name][there].tolist()
        assert ours[name].dtype.kind == theirs[name].dtype.kind
    assert ours.geometry.geom_equals(theirs.geometry).tolist() == [True, False, True]
    assert ours.geometry[1] is None
    assert not shapely.has_z(np.asarray(ours.geometry.array)).any()


def test_a_layer_without_rows_has_its_columns(town: Path) -> None:
    features = read_features(town, "none")
    assert list(features.columns) == ["whole", "some", "said", "text", "seen"]
    assert len(features.geometries) == 0


def test_a_column_that_holds_other_than_it_declares_is_read_as_it_is(town: Path) -> None:
    with closing(sqlite3.connect(town)) as connection, connection:
        connection.execute('UPDATE "odd ""name""" SET some = ? WHERE whole = 1', ("wide",))
    features = read_features(town, 'odd "name"')
    assert features.columns["some"].tolist() == ["wide", None, -2.0]


@pytest.mark.parametrize("table", ["gpkg_contents", "gpkg_geometry_columns", "anchors"])
def test_a_file_that_lacks_a_table_is_refused(tmp_path: Path, table: str) -> None:
    path = tmp_path / "town.gpkg"
    frame = gpd.GeoDataFrame(geometry=[shapely.Point(695000, 737000)], crs=2157)
    pyogrio.write_dataframe(frame, path, layer="anchors", layer_options={"SPATIAL_INDEX": "NO"})
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute("PRAGMA foreign_keys = OFF")
        connection.execute(f"ALTER TABLE {table} RENAME TO gone")
    with pytest.raises(FileError):
        read_anchors(path)

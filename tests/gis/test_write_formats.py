"""The single-layer formats, read back by readers that are not ours."""

import json
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pyogrio
import pytest
import shapely
from pyproj import Transformer

from covertool import crs as crs_door
from covertool.errors import CrsError, FileError, GeometryError, OptionError
from covertool.gis.read import read_anchors, read_transit
from covertool.gis.write import write_layers
from covertool.model import Anchors

SHAPE = shapely.Polygon(
    [(695000, 737000), (695000, 737100), (695100, 737100), (695100, 737000)],
    [[(695040, 737040), (695060, 737040), (695060, 737060), (695040, 737060)]],
)  # the outer ring runs clockwise, the hole counterclockwise: against RFC 7946


def polygons(crs: object = 2157) -> gpd.GeoDataFrame:
    flags = np.array([True], dtype=object)
    return gpd.GeoDataFrame({"name": ["Straße"], "parked": flags}, geometry=[SHAPE], crs=crs)


def points() -> gpd.GeoDataFrame:
    return Anchors.from_points(
        [695000.5, 695010], [737000.25, 737020], crs_door.IRISH_TM
    ).to_frame()


def test_geojson_follows_rfc_7946(tmp_path: Path) -> None:
    path = tmp_path / "t.geojson"
    frame = pd.concat([polygons(), polygons().assign(parked=None, name=None)])
    write_layers(path, {"transit": frame})
    content = json.loads(path.read_text(encoding="utf-8"))
    assert content["type"] == "FeatureCollection"
    assert "crs" not in content
    first, second = content["features"]
    assert first["properties"] == {"name": "Straße", "parked": True}
    assert second["properties"] == {"name": None, "parked": None}
    (outer, hole) = first["geometry"]["coordinates"][0]
    assert first["geometry"]["type"] == "MultiPolygon"
    assert shapely.LinearRing(outer).is_ccw
    assert not shapely.LinearRing(hole).is_ccw
    to_wgs84 = Transformer.from_crs(2157, 4326, always_xy=True)
    expected = {tuple(np.round(to_wgs84.transform(x, y), 7)) for x, y in SHAPE.exterior.coords}
    assert {tuple(place) for place in outer} == expected
    assert all(len(repr(v).partition(".")[2]) <= 7 for place in outer for v in place)


@pytest.mark.parametrize("suffix", ["geojson", "parquet", "fgb", "shp", "gpkg"])
def test_every_format_brings_the_same_area_back(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"t.{suffix}"
    write_layers(path, {"transit": polygons()})
    assert read_transit(path).area_m2 == pytest.approx(100 * 100 - 20 * 20, rel=2e-4)
    independent = pyogrio.read_info(path)["features"] if suffix != "parquet" else 1
    assert independent == 1


@pytest.mark.parametrize("suffix", ["geojson", "parquet", "fgb", "shp"])
def test_the_same_layer_gives_the_same_bytes(tmp_path: Path, suffix: str) -> None:
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        write_layers(tmp_path / name / f"t.{suffix}", {"transit": polygons()})
    one, two = (sorted((tmp_path / name).iterdir()) for name in ("one", "two"))
    assert [p.read_bytes() for p in one] == [p.read_bytes() for p in two]


def test_an_image_plane_has_no_place_in_geojson(tmp_path: Path) -> None:
    with pytest.raises(CrsError) as caught:
        write_layers(tmp_path / "t.geojson", {"transit": polygons(crs_door.IMAGE_PLANE)})
    assert "--crs" in caught.value.mend
    assert "--origin" in caught.value.mend
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", ["parquet", "fgb", "shp"])
def test_an_image_plane_survives_in_the_formats_that_can_name_it(
    tmp_path: Path, suffix: str
) -> None:
    path = tmp_path / f"t.{suffix}"
    write_layers(path, {"transit": polygons(crs_door.IMAGE_PLANE)})
    transit = read_transit(path)
    assert transit.crs == crs_door.IMAGE_PLANE
    assert transit.area_m2 == 9600


def test_geoparquet_is_version_1_1_with_a_bounding_box_of_each_row(tmp_path: Path) -> None:
    path = tmp_path / "t.parquet"
    write_layers(path, {"transit": polygons()})
    file = pq.ParquetFile(path)
    told = json.loads(file.metadata.metadata[b"geo"])
    assert told["version"] == "1.1.0"
    assert "bbox" in told["columns"]["geometry"]["covering"]
    row = file.read().to_pylist()[0]
    assert row["bbox"] == {"xmin": 695000, "ymin": 737000, "xmax": 695100, "ymax": 737100}
    assert row["parked"] is True


def test_shapefile_names_are_short_distinct_and_come_back(tmp_path: Path) -> None:
    path = tmp_path / "a.shp"
    anchors = points().assign(device_class=["A", "B"], a_rather_long_name=1, a_rather_long_one=2)
    write_layers(path, {"anchors": anchors})
    fields = pyogrio.read_info(path)["fields"].tolist()
    assert max(map(len, fields)) <= 10
    assert len(set(fields)) == len(fields)
    assert list(read_anchors(path).device_class) == ["A", "B"]
    assert {p.suffix for p in tmp_path.iterdir()} == {".shp", ".shx", ".dbf", ".prj", ".cpg"}


def test_csv_points_come_back_with_the_crs_named(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    write_layers(path, {"anchors": points().assign(radius_m=[15.0, np.nan])})
    table = pd.read_csv(path)
    assert table.columns[:2].tolist() == ["x", "y"]
    assert table["x"].tolist() == [695000.5, 695010]
    anchors = read_anchors(path, crs="EPSG:2157")
    np.testing.assert_array_equal(anchors.radius_m, [15, np.nan])
    write_layers(path, {"anchors": points().to_crs(4326)}, overwrite=True)
    assert pd.read_csv(path).columns[:2].tolist() == ["lon", "lat"]
    assert read_anchors(path).x_m.tolist() == pytest.approx([695000.5, 695010], abs=1e-3)


def test_csv_takes_no_polygons(tmp_path: Path) -> None:
    with pytest.raises(GeometryError):
        write_layers(tmp_path / "t.csv", {"transit": polygons()})


@pytest.mark.parametrize("suffix", ["geojson", "parquet", "fgb", "shp", "csv"])
def test_a_format_for_one_layer_refuses_two(tmp_path: Path, suffix: str) -> None:
    layers = {"anchors": points(), "transit": polygons()}
    with pytest.raises(OptionError, match="anchors, transit"):
        write_layers(tmp_path / f"t.{suffix}", layers)
    with pytest.raises(OptionError):
        write_layers(tmp_path / f"t.{suffix}", {"anchors": points()}, into=True)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", ["geojson", "parquet", "fgb", "shp", "csv", "gpkg"])
def test_no_rows_at_all_are_written_and_read(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a.{suffix}"
    write_layers(path, {"anchors": points().iloc[:0]})
    crs = "EPSG:2157" if suffix == "csv" else None
    assert len(read_anchors(path, crs=crs)) == 0


def test_an_output_that_is_an_input_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.fgb"
    write_layers(path, {"anchors": points()})
    with pytest.raises(FileError, match="same file"):
        write_layers(path, {"anchors": points()}, overwrite=True, inputs=[path])


def test_an_unknown_extension_is_refused_and_the_known_are_listed(tmp_path: Path) -> None:
    with pytest.raises(FileError) as caught:
        write_layers(tmp_path / "a.xyz", {"anchors": points()})
    for known in (".gpkg", ".geojson", ".parquet", ".fgb", ".shp", ".csv"):
        assert known in caught.value.mend


def test_overwriting_replaces_and_a_failure_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    write_layers(path, {"anchors": points()})
    before = path.read_bytes()
    with pytest.raises(GeometryError):
        write_layers(path, {"transit": polygons()}, overwrite=True)
    assert path.read_bytes() == before
    write_layers(path, {"anchors": points().iloc[:1]}, overwrite=True)
    assert len(pd.read_csv(path)) == 1
    assert [p.name for p in tmp_path.iterdir()] == ["a.csv"]

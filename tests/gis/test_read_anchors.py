"""Anchors from every format and CRS: the same metres, repairs counted, the rest refused."""

import logging
import math
import shutil
import sqlite3
from pathlib import Path

import geopandas as gpd
import numpy as np
import pyogrio
import pytest
import shapely
from pyproj import CRS, Geod, Transformer

from covertool import crs as crs_door
from covertool.errors import ColumnError, CrsError, FileError, GeometryError
from covertool.gis.read import read_anchors

EAST = np.array([695000.0, 695040.0, 695000.0])
NORTH = np.array([737000.0, 737000.0, 737030.0])


def points(crs: object = 2157, **columns: object) -> gpd.GeoDataFrame:
    """Three places in Maynooth, 40 m and 30 m apart at right angles, in any CRS."""
    x, y = Transformer.from_crs(2157, crs, always_xy=True).transform(EAST, NORTH)
    return gpd.GeoDataFrame(columns, geometry=shapely.points(x, y), crs=crs)


def save(frame: gpd.GeoDataFrame, path: Path, layer: str | None = None) -> Path:
    if path.suffix == ".parquet":
        frame.to_parquet(path)
    else:
        pyogrio.write_dataframe(frame, path, layer=layer)
    return path


@pytest.mark.parametrize("suffix", ["gpkg", "fgb", "shp", "parquet", "geojson"])
def test_the_format_does_not_change_the_places(tmp_path: Path, suffix: str) -> None:
    crs = 4326 if suffix == "geojson" else 2157
    path = save(points(crs, id=["a", "b", "c"]), tmp_path / f"town.{suffix}")
    anchors = read_anchors(path)
    order = np.argsort(anchors.id)
    tolerance = 0.02 if suffix == "geojson" else 0
    np.testing.assert_allclose(anchors.x_m[order], EAST, atol=tolerance, rtol=0)
    np.testing.assert_allclose(anchors.y_m[order], NORTH, atol=tolerance, rtol=0)
    assert anchors.crs.to_epsg() == 2157
    assert list(anchors.origin) == ["parked"] * 3
    assert np.isnan(anchors.radius_m).all()


@pytest.mark.parametrize(
    ("source", "warned"),
    [
        (4326, False),  # degrees, north-first by its authority
        (4258, False),
        (3857, True),  # the web's Mercator
        (3035, True),  # equal area: circles do not stay round
        (29903, False),  # the older Irish Grid, in metres
        (32629, False),
        ("+proj=utm +zone=29 +datum=WGS84 +units=us-ft", False),
        ("+proj=utm +zone=29 +datum=WGS84 +units=ft", False),
    ],
)
def test_distances_are_metres_on_the_ground_whatever_the_crs(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, source: int | str, warned: bool
) -> None:
    path = save(points(source), tmp_path / "town.gpkg")
    anchors = read_anchors(path)
    scale = crs_door.scale_factor(anchors.crs, anchors.x_m[0], anchors.y_m[0])
    lon, lat = Transformer.from_crs(2157, 4326, always_xy=True).transform(EAST, NORTH)
    for i in (1, 2):
        ground = Geod(ellps="WGS84").inv(lon[0], lat[0], lon[i], lat[i])[2]
        measured = math.hypot(anchors.x_m[i] - anchors.x_m[0], anchors.y_m[i] - anchors.y_m[0])
        assert measured / scale == pytest.approx(ground, rel=2e-5)
    assert bool(caplog.records) == warned
    assert crs_door.is_working(anchors.crs)


def test_a_north_first_projected_crs_is_taken_as_x_east_y_north(tmp_path: Path) -> None:
    x, y = Transformer.from_crs(4326, 2193, always_xy=True).transform([174.78], [-41.28])
    frame = gpd.GeoDataFrame(geometry=shapely.points(x, y), crs=2193)
    anchors = read_anchors(save(frame, tmp_path / "wellington.gpkg"))
    assert anchors.crs.to_epsg() == 2193
    assert (anchors.x_m[0], anchors.y_m[0]) == pytest.approx((x[0], y[0]))
    assert 1.6e6 < anchors.x_m[0] < 1.8e6 < 5.3e6 < anchors.y_m[0]


def test_a_south_oriented_crs_is_turned_north_up(tmp_path: Path) -> None:
    lon, lat = np.array([18.42, 18.43]), np.array([-33.92, -33.91])
    x, y = Transformer.from_crs(4326, 2048, always_xy=True).transform(lon, lat)
    frame = gpd.GeoDataFrame(geometry=shapely.points(x, y), crs=2048)
    anchors = read_anchors(save(frame, tmp_path / "cape.gpkg"))
    there = Transformer.from_crs(anchors.crs, 4326, always_xy=True)
    np.testing.assert_allclose(there.transform(anchors.x_m, anchors.y_m), [lon, lat], atol=1e-7)
    assert anchors.crs.to_epsg() == 32734


def test_data_across_the_antimeridian_stays_together(tmp_path: Path) -> None:
    frame = gpd.GeoDataFrame(geometry=shapely.points([179.999, -179.999], [-16.5, -16.5]), crs=4326)
    anchors = read_anchors(save(frame, tmp_path / "fiji.gpkg"))
    ground = Geod(ellps="WGS84").inv(179.999, -16.5, -179.999, -16.5)[2]
    assert abs(anchors.x_m[1] - anchors.x_m[0]) == pytest.approx(ground, rel=1e-3)


def test_data_too_wide_for_one_projection_is_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    frame = gpd.GeoDataFrame(geometry=shapely.points([0.0, 30.0], [50.0, 50.0]), crs=4326)
    read_anchors(save(frame, tmp_path / "europe.gpkg"))
    assert "so wide" in caplog.text


def test_dst_crs_transforms_and_one_that_is_not_true_is_refused(tmp_path: Path) -> None:
    path = save(points(), tmp_path / "town.gpkg")
    anchors = read_anchors(path, dst_crs="EPSG:32629")
    expected = Transformer.from_crs(2157, 32629, always_xy=True).transform(EAST, NORTH)
    np.testing.assert_allclose([anchors.x_m, anchors.y_m], expected, atol=1e-3)
    for wrong in ("EPSG:3857", "EPSG:4326", "EPSG:3035"):
        with pytest.raises(CrsError) as caught:
            read_anchors(path, dst_crs=wrong)
        assert caught.value.where == "--dst-crs"


def test_a_missing_crs_is_refused_with_the_option_that_mends_it(tmp_path: Path) -> None:
    frame = points().set_crs(None, allow_override=True)
    for suffix in ("gpkg", "shp", "fgb", "parquet"):
        path = save(frame, tmp_path / f"town.{suffix}")
        with pytest.raises(CrsError) as caught:
            read_anchors(path)
        assert "--crs" in caught.value.mend
        np.testing.assert_array_equal(
            np.sort(read_anchors(path, crs="EPSG:2157").x_m), np.sort(EAST)
        )


def test_a_crs_in_conflict_with_the_file_is_refused_and_both_are_named(tmp_path: Path) -> None:
    path = save(points(), tmp_path / "town.gpkg")
    with pytest.raises(CrsError, match=r"EPSG:2157.*EPSG:4326"):
        read_anchors(path, crs="EPSG:4326")
    assert len(read_anchors(path, crs="EPSG:2157")) == 3
    with pytest.raises(CrsError, match="not known"):
        read_anchors(path, crs="EPSG:999999")


def test_metres_labelled_as_degrees_are_refused(tmp_path: Path) -> None:
    frame = points().set_crs(4326, allow_override=True)
    for suffix in ("gpkg", "fgb", "geojson"):
        with pytest.raises(CrsError, match="not degrees"):
            read_anchors(save(frame, tmp_path / f"town.{suffix}"))


def test_geojson_in_metres_is_read_with_the_crs_that_the_user_names(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = save(points().set_crs(4326, allow_override=True), tmp_path / "town.geojson")
    np.testing.assert_allclose(read_anchors(path, crs="EPSG:2157").x_m, EAST)
    assert "RFC 7946" in caplog.text


def test_bad_geometries_among_good_ones_are_dropped_and_counted_in_one_line(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    shapes = [
        shapely.Point(695000, 737000),
        None,
        shapely.Point(),
        shapely.Point(math.inf, 737000),
        shapely.LineString([(695000, 737000), (695001, 737000)]),
        shapely.box(695010, 737010, 695014, 737012),
        shapely.MultiPoint([(695020, 737020), (695030, 737030)]),
        shapely.Point(695040, 737040, 99),
    ]
    frame = gpd.GeoDataFrame({"id": range(8)}, geometry=shapes, crs=2157)
    anchors = read_anchors(save(frame, tmp_path / "mixed.gpkg"))
    assert sorted(zip(anchors.x_m.tolist(), anchors.y_m.tolist(), strict=True)) == [
        (695000, 737000),
        (695012, 737011),
        (695020, 737020),
        (695030, 737030),
        (695040, 737040),
    ]
    assert len(set(anchors.id)) == 5
    assert len(caplog.records) == 1
    for told in ("null", "empty", "infinite", "centroid", "neither points nor polygons", "ids"):
        assert told in caplog.text


def test_a_layer_in_which_nothing_can_be_used_is_refused(tmp_path: Path) -> None:
    frame = gpd.GeoDataFrame(geometry=shapely.points([math.inf] * 2, [1.0, 2.0]), crs=2157)
    with pytest.raises(GeometryError, match="none of the 2"):
        read_anchors(save(frame, tmp_path / "bad.gpkg"))


@pytest.mark.parametrize("crs", [2157, 4326, 3857, 3035, 2263])
def test_an_empty_layer_gives_no_anchors_and_a_warning(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, crs: int
) -> None:
    path = tmp_path / "none.gpkg"
    empty = gpd.GeoDataFrame({"id": []}, geometry=[], crs=crs)
    pyogrio.write_dataframe(empty, path, layer="anchors", geometry_type="Point")
    assert len(read_anchors(path)) == 0
    assert "empty" in caplog.text


def test_repeated_and_missing_ids_become_unique(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = save(points(id=["2", "2", None]), tmp_path / "town.gpkg")
    ids = read_anchors(path).id
    assert ids[0] == "2"
    assert len(set(ids)) == 3
    assert "2 repeated or missing ids" in caplog.text


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ([7, 8, 9], ["7", "8", "9"]),
        ([7.0, 8.0, 9.0], ["7", "8", "9"]),
        ([7.5, 8.0, 9.0], ["7.5", "8.0", "9.0"]),
        (["07", "8", "x"], ["07", "8", "x"]),
    ],
)
def test_ids_become_text_as_they_were_meant(
    tmp_path: Path, given: list[object], expected: list[str]
) -> None:
    assert list(read_anchors(save(points(id=given), tmp_path / "town.gpkg")).id) == expected


def test_columns_of_anchors_are_read_in_any_case_and_checked(tmp_path: Path) -> None:
    frame = points(
        Radius_M=[15.0, None, 100.0],
        DEVICE_CLASS=["a", None, "D"],
        sigma_m=[0.5, None, 0.0],
        origin=[None, "queue", "RSU"],
    )
    anchors = read_anchors(save(frame, tmp_path / "town.gpkg"))
    np.testing.assert_array_equal(anchors.radius_m, [15.0, math.nan, 100.0])
    assert list(anchors.device_class) == ["A", None, "D"]
    np.testing.assert_array_equal(anchors.sigma_m, [0.5, math.nan, 0.0])
    assert list(anchors.origin) == ["parked", "queue", "rsu"]


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("radius_m", [15.0, -1.0, 2.0]),
        ("radius_m", [15.0, 0.0, 2.0]),
        ("radius_m", ["15", "wide", "2"]),
        ("sigma_m", [0.5, -0.5, 0.5]),
        ("device_class", ["A", "E", "B"]),
        ("origin", ["parked", "moving", "rsu"]),
    ],
)
def test_values_out_of_range_are_refused_by_the_name_of_their_column(
    tmp_path: Path, name: str, values: list[object]
) -> None:
    with pytest.raises(ColumnError, match=name):
        read_anchors(save(points(**{name: values}), tmp_path / "town.gpkg"))


def test_a_nearly_right_column_name_is_pointed_out(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    read_anchors(save(points(radus_m=[1.0, 2.0, 3.0]), tmp_path / "town.gpkg"))
    assert "did you mean 'radius_m'" in caplog.text


def test_the_layer_is_the_named_one_else_the_default_else_the_only_one(tmp_path: Path) -> None:
    path = tmp_path / "study.gpkg"
    save(points(id=["only"] * 3), path, "cars")
    assert read_anchors(path).id[0] == "only"
    save(points().iloc[:2], path, "other")
    with pytest.raises(FileError) as caught:
        read_anchors(path)
    assert "cars, other" in caught.value.mend
    save(points().iloc[:1], path, "anchors")
    assert len(read_anchors(path)) == 1
    assert len(read_anchors(f"{path}:other")) == 2
    with pytest.raises(FileError, match="'roads'"):
        read_anchors(f"{path}:roads")


def test_odd_paths_are_read(tmp_path: Path) -> None:
    folder = tmp_path / "Má Nuad – straße" / ("long " * 20).strip()
    folder.mkdir(parents=True)
    assert len(read_anchors(save(points(), folder / "pärked cars #1 100%.gpkg"))) == 3


def test_a_truncated_file_is_refused(tmp_path: Path) -> None:
    for suffix in ("gpkg", "fgb", "parquet"):
        path = save(points(id=["a", "b", "c"]), tmp_path / f"town.{suffix}")
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
        with pytest.raises(FileError):
            read_anchors(path)
    path = save(points(4326), tmp_path / "town.geojson")
    path.write_bytes(path.read_bytes()[:-30])
    with pytest.raises(FileError):
        read_anchors(path)


def test_reading_leaves_nothing_beside_the_file(tmp_path: Path) -> None:
    path = save(points(), tmp_path / "town.gpkg")
    before = path.read_bytes()
    read_anchors(path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_a_geopackage_in_wal_mode_is_read_with_its_log_and_left_alone(tmp_path: Path) -> None:
    path = save(points(id=["a", "b", "c"]), tmp_path / "town.gpkg")
    writer = sqlite3.connect(path)
    try:
        for name in ("IsEmpty", "MinX", "MaxX", "MinY", "MaxY"):  # for the index's triggers
            writer.create_function(f"ST_{name}", 1, lambda _: 0)
        writer.execute("PRAGMA journal_mode=WAL")
        writer.execute("UPDATE town SET id = 'fresh' WHERE id = 'a'")
        writer.commit()
        listed = sorted(tmp_path.iterdir())
        assert "fresh" in read_anchors(path).id
        assert sorted(tmp_path.iterdir()) == listed
        alone = tmp_path / "alone" / "town.gpkg"
        alone.parent.mkdir()
        shutil.copy(path, alone)
        assert len(read_anchors(alone)) == 3
        assert list(alone.parent.iterdir()) == [alone]
    finally:
        writer.close()


def test_a_locked_geopackage_is_refused_with_the_mend(tmp_path: Path) -> None:
    path = save(points(), tmp_path / "town.gpkg")
    holder = sqlite3.connect(path)
    try:
        holder.execute("BEGIN EXCLUSIVE")
        with pytest.raises(FileError, match="locked"):
            read_anchors(path)
    finally:
        holder.close()


def test_a_wkt_without_a_code_is_still_the_same_place(tmp_path: Path) -> None:
    path = save(points(), tmp_path / "town.shp")  # the .prj holds ESRI's WKT
    anchors = read_anchors(path, crs="EPSG:2157")
    np.testing.assert_allclose(anchors.x_m, EAST)
    assert CRS.from_user_input(anchors.crs).is_projected


@pytest.fixture(autouse=True)
def _log_everything(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.WARNING, logger="covertool")
    logging.getLogger("covertool").propagate = True

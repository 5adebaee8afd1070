"""Transit areas: united, valid and disjoint whatever came in; zones keep their columns."""

import logging
import math
import sqlite3
import struct
from contextlib import closing
from pathlib import Path

import geopandas as gpd
import numpy as np
import pyogrio
import pytest
import shapely
from pyproj import Geod, Transformer

from covertool import crs as crs_door
from covertool.errors import CovertoolError, FileError, GeometryError
from covertool.gis.read import read_polygons, read_study, read_transit
from covertool.gis.write import write_layers
from covertool.model import Anchors, TransitArea, Vehicles

X, Y = 695000.0, 737000.0


def box(x0: float, y0: float, x1: float, y1: float) -> shapely.Polygon:
    return shapely.box(X + x0, Y + y0, X + x1, Y + y1)


def save(path: Path, shapes: list[object], crs: object = 2157, **columns: object) -> Path:
    frame = gpd.GeoDataFrame(columns, geometry=shapes, crs=crs)
    pyogrio.write_dataframe(frame, path, layer="transit")
    return path


def test_overlapping_nested_and_repeated_polygons_count_once(tmp_path: Path) -> None:
    shapes = [box(0, 0, 10, 10), box(5, 0, 15, 10), box(1, 1, 2, 2), box(0, 0, 10, 10)]
    transit = read_transit(save(tmp_path / "t.gpkg", shapes))
    assert transit.area_m2 == pytest.approx(150)
    assert transit.polygons.is_valid
    assert len(transit.polygons.geoms) == 1


def test_disjoint_parts_and_holes_survive(tmp_path: Path) -> None:
    ring = box(0, 0, 10, 10).difference(box(4, 4, 6, 6))
    transit = read_transit(save(tmp_path / "t.gpkg", [ring, box(20, 0, 30, 10)]))
    assert transit.area_m2 == pytest.approx(96 + 100)
    assert len(transit.polygons.geoms) == 2


def test_a_bow_tie_is_repaired_and_counted(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    bow = shapely.Polygon([(X, Y), (X + 10, Y + 10), (X + 10, Y), (X, Y + 10)])
    transit = read_transit(save(tmp_path / "t.gpkg", [bow]))
    assert transit.area_m2 == pytest.approx(50)
    assert "1 invalid polygons repaired" in caplog.text


def test_what_is_not_a_polygon_is_dropped_and_counted(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    shapes = [
        box(0, 0, 10, 10),
        None,
        shapely.Polygon(),
        shapely.Point(X, Y),
        shapely.LineString([(X, Y), (X + 1, Y)]),
        shapely.GeometryCollection([box(20, 0, 30, 10), shapely.Point(X, Y)]),
        shapely.Polygon([(X, Y, 5), (X - 10, Y, 5), (X - 10, Y + 10, 5), (X, Y + 10, 5)]),
        shapely.Polygon([(X, Y), (math.nan, Y), (X, Y + 1), (X, Y)]),
    ]
    transit = read_transit(save(tmp_path / "t.gpkg", shapes))
    assert transit.area_m2 == pytest.approx(300)
    assert not transit.polygons.has_z
    for told in (
        "1 null",
        "1 empty",
        "2 geometries that are not polygons",
        "1 geometries with NaN",
    ):
        assert told in caplog.text


@pytest.mark.parametrize(
    "shapes",
    [
        [shapely.LineString([(X, Y), (X + 9, Y)])],
        [shapely.Polygon([(X, Y), (X + 9, Y), (X + 18, Y), (X, Y)])],
        [None, None],
    ],
)
def test_a_transit_area_of_zero_is_refused(tmp_path: Path, shapes: list[object]) -> None:
    with pytest.raises(GeometryError):
        read_transit(save(tmp_path / "t.gpkg", shapes))


def test_an_empty_transit_layer_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "t.gpkg"
    empty = gpd.GeoDataFrame({"id": []}, geometry=[], crs=2157)
    pyogrio.write_dataframe(empty, path, layer="transit", geometry_type="Polygon")
    with pytest.raises(GeometryError, match="no polygon with an area"):
        read_transit(path)


@pytest.mark.parametrize("crs", [4326, 3857, 3035, 32629, "+proj=utm +zone=29 +units=us-ft"])
def test_the_area_is_that_on_the_ground_whatever_the_crs(tmp_path: Path, crs: object) -> None:
    corners = shapely.get_coordinates(box(0, 0, 100, 50))
    lon, lat = Transformer.from_crs(2157, 4326, always_xy=True).transform(*corners.T)
    ground = abs(Geod(ellps="WGS84").polygon_area_perimeter(lon, lat)[0])
    x, y = Transformer.from_crs(4326, crs, always_xy=True).transform(lon, lat)
    shape = shapely.Polygon(np.column_stack([x, y]))
    transit = read_transit(save(tmp_path / "t.gpkg", [shape], crs))
    scale = crs_door.scale_factor(transit.crs, *transit.polygons.centroid.coords[0])
    assert transit.area_m2 / scale**2 == pytest.approx(ground, rel=1e-4)


def test_zones_keep_their_columns_and_lose_only_bad_rows(tmp_path: Path) -> None:
    shapes = [box(0, 0, 1, 1), None, box(2, 0, 3, 1)]
    path = save(tmp_path / "zones.gpkg", shapes, zone=["north", "lost", "south"])
    zones = read_polygons(path)
    assert list(zones["zone"]) == ["north", "south"]
    assert zones.crs.to_epsg() == 2157


def study(path: Path) -> Path:
    crs = crs_door.IRISH_TM
    write_layers(
        path,
        {
            "anchors": Anchors.from_points([X, X + 5], [Y, Y], crs).to_frame(),
            "transit": TransitArea(shapely.MultiPolygon([box(0, 0, 9, 9)]), crs).to_frame(),
        },
    )
    return path


def test_a_study_comes_in_one_crs_even_when_its_layers_differ(tmp_path: Path) -> None:
    path = study(tmp_path / "s.gpkg")
    utm = crs_door.utm(-6.6, 53.4)
    x, y = Transformer.from_crs(2157, utm, always_xy=True).transform([X], [Y])
    write_layers(path, {"anchors": Anchors.from_points(x, y, utm).to_frame()}, into=True)
    found = read_study(path)
    assert found.anchors is not None
    assert found.transit is not None
    assert found.anchors.crs == found.transit.crs
    assert (found.anchors.x_m[0], found.anchors.y_m[0]) == pytest.approx((X, Y), abs=1e-3)
    assert found.vehicles is None


def test_anchors_far_from_the_transit_area_are_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = study(tmp_path / "s.gpkg")
    read_study(path)
    assert not caplog.records
    far = Anchors.from_points([X + 50_000], [Y], crs_door.IRISH_TM)
    write_layers(path, {"anchors": far.to_frame()}, into=True)
    read_study(path)
    assert "swapped" in caplog.text


def test_a_curve_is_read_as_a_fine_line(tmp_path: Path) -> None:
    path = save(tmp_path / "t.gpkg", [box(0, 0, 1, 1), shapely.Point(X, Y)])  # of any type
    arcs = [(X + 10, Y), (X, Y + 10), (X - 10, Y), (X, Y - 10), (X + 10, Y)]
    string = struct.pack("<BII", 1, 8, 5) + b"".join(struct.pack("<2d", *place) for place in arcs)
    blob = b"GP\x00\x01" + struct.pack("<i", 2157) + struct.pack("<BII", 1, 10, 1) + string
    with closing(sqlite3.connect(path)) as connection, connection:
        for name in ("IsEmpty", "MinX", "MaxX", "MinY", "MaxY"):  # for the index's triggers
            connection.create_function(f"ST_{name}", 1, lambda _: 0)
        connection.execute("UPDATE transit SET geom = ? WHERE fid = 1", (blob,))
    assert read_transit(path).area_m2 == pytest.approx(math.pi * 100, rel=2e-3)


def test_vehicles_come_back_as_they_were_written(tmp_path: Path) -> None:
    cars = Vehicles(
        id=np.array(["a", "b"], dtype=object),
        x_m=np.array([X, X + 20]),
        y_m=np.array([Y, Y + 5]),
        heading_deg=np.array([30.0, 170.0]),
        length_m=np.array([4.5, 5.0]),
        width_m=np.array([1.8, 2.0]),
        score=np.array([0.5, 1.0]),
        site=np.array([None, "lot"], dtype=object),
        parked=np.array([None, True], dtype=object),
        image=np.array(["p.tif", None], dtype=object),
        image_x_px=np.array([1.5, 2.5]),
        image_y_px=np.array([3.5, 4.5]),
        crs=crs_door.IRISH_TM,
    )
    path = study(tmp_path / "s.gpkg")
    write_layers(path, {"vehicles": cars.to_frame()}, into=True)
    found = read_study(path).vehicles
    assert found is not None
    for name, column in cars.columns().items():
        got = found.columns()[name]
        if column.dtype == object:
            assert list(got) == list(column), name
        else:
            np.testing.assert_allclose(got, column, atol=1e-6, rtol=0, err_msg=name)
    moved = read_study(path, dst_crs="EPSG:32629").vehicles
    assert moved is not None
    ahead = np.array([X + math.sin(math.radians(30)), Y + math.cos(math.radians(30))])
    to_utm = Transformer.from_crs(2157, 32629, always_xy=True)
    (x0, x1), (y0, y1) = to_utm.transform([X, ahead[0]], [Y, ahead[1]])
    turned = math.degrees(math.atan2(x1 - x0, y1 - y0))
    assert moved.heading_deg[0] == pytest.approx(turned, abs=1e-4)
    assert abs(turned - 30) > 0.5  # the two grid norths differ here


def test_a_file_without_study_layers_is_refused_and_its_layers_are_named(tmp_path: Path) -> None:
    path = tmp_path / "s.gpkg"
    frame = gpd.GeoDataFrame(geometry=[box(0, 0, 1, 1)], crs=2157)
    pyogrio.write_dataframe(frame, path, layer="lakes")
    with pytest.raises(FileError, match="lakes"):
        read_study(path)
    with pytest.raises(CovertoolError):
        read_study(tmp_path / "s.geojson")


@pytest.fixture(autouse=True)
def _log_everything(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.WARNING, logger="covertool")
    logging.getLogger("covertool").propagate = True

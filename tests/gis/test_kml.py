"""KML as an XML reader that is not ours sees it."""

import logging
from pathlib import Path
from xml.etree import ElementTree

import geopandas as gpd
import numpy as np
import pytest
import shapely
from pyproj import Transformer

from covertool import crs as crs_door
from covertool.errors import CrsError
from covertool.gis.write import write_layers

NS = {"k": "http://www.opengis.net/kml/2.2"}
RING = [(695000, 737000), (695000, 737100), (695100, 737100), (695100, 737000)]  # clockwise
HOLE = [(695040, 737040), (695060, 737040), (695060, 737060)]


def frame(**columns: object) -> gpd.GeoDataFrame:
    return gpd.GeoDataFrame(columns, geometry=[shapely.Polygon(RING, [HOLE])], crs=2157)


def written(path: Path, layers: dict[str, gpd.GeoDataFrame], **more: object) -> ElementTree.Element:
    write_layers(path, layers, **more)  # type: ignore[arg-type]
    return ElementTree.parse(path).getroot()


def places(element: ElementTree.Element | None) -> np.ndarray:
    assert element is not None
    return np.array([tuple(map(float, word.split(","))) for word in str(element.text).split()])


def test_places_are_wgs_84_longitude_first_and_outer_rings_run_counterclockwise(tmp_path) -> None:
    root = written(tmp_path / "a.kml", {"transit": frame()})
    outer = places(root.find(".//k:outerBoundaryIs//k:coordinates", NS))
    inner = places(root.find(".//k:innerBoundaryIs//k:coordinates", NS))
    assert shapely.LinearRing(outer).is_ccw
    assert not shapely.LinearRing(inner).is_ccw
    lon, lat = Transformer.from_crs(2157, 4326, always_xy=True).transform(*np.transpose(RING))
    for here in zip(lon, lat, strict=True):
        assert np.abs(outer - here).max(axis=1).min() < 1e-7


def test_levels_bear_the_papers_colours_as_alpha_blue_green_red(tmp_path: Path) -> None:
    layers = {f"coverage_level_{level}": frame() for level in (1, 2, 3)}
    root = written(tmp_path / "a.kml", {"transit": frame(), **layers})
    colours = {
        style.get("id"): style.findtext("k:PolyStyle/k:color", namespaces=NS)
        for style in root.iterfind(".//k:Style", NS)
    }
    assert colours == {
        "style_transit": "ffbd814f",
        "style_coverage_level_1": "ff2fd9ff",
        "style_coverage_level_2": "ff3c8dfd",
        "style_coverage_level_3": "ff1c1ae3",
    }
    used = {mark.text for mark in root.iterfind(".//k:styleUrl", NS)}
    assert used == {f"#{name}" for name in colours}


def test_of_several_radii_the_smallest_is_switched_on(tmp_path: Path) -> None:
    two = gpd.GeoDataFrame(
        {"level": [1, 1], "radius_m": [100.0, 15.0]},
        geometry=[shapely.Polygon(RING)] * 2,
        crs=2157,
    )
    root = written(tmp_path / "a.kml", {"coverage_level_1": two})
    folders = {
        folder.findtext("k:name", namespaces=NS): folder.findtext("k:visibility", namespaces=NS)
        for folder in root.iterfind(".//k:Folder", NS)
    }
    assert folders == {
        "Level 1: one parked car, 15 m": None,
        "Level 1: one parked car, 100 m": "0",
    }


def test_texts_of_users_stay_text_and_empty_cells_are_left_out(tmp_path: Path) -> None:
    nasty = "<b>&amp; \x01]]> \u202e"
    columns = {"name": [nasty], "note": [None], "a<b": [np.nan], 'q"': [1.5]}
    root = written(tmp_path / "a.kml", {"my zones & <co>": frame(**columns)})
    mark = root.find(".//k:Placemark", NS)
    assert mark is not None
    assert mark.findtext("k:name", namespaces=NS) == nasty.replace("\x01", "\ufffd")
    data = {
        d.get("name"): d.findtext("k:value", namespaces=NS) for d in mark.iterfind(".//k:Data", NS)
    }
    assert data == {"name": nasty.replace("\x01", "\ufffd"), 'q"': "1.5"}


def test_every_kind_of_geometry_is_drawn(tmp_path: Path) -> None:
    shapes = [
        shapely.Point(695000, 737000),
        shapely.LineString([(695000, 737000), (695010, 737000)]),
        shapely.MultiPoint([(695000, 737000), (695010, 737000)]),
        shapely.MultiPolygon([shapely.box(695000, 737000, 695010, 737010)]),
        shapely.GeometryCollection([shapely.Point(695000, 737000)]),
        None,
    ]
    mixed = gpd.GeoDataFrame({"n": range(len(shapes))}, geometry=shapes, crs=2157)
    root = written(tmp_path / "a.kml", {"mixed": mixed})
    marks = root.findall(".//k:Placemark", NS)
    counts = [len(mark.findall(".//k:coordinates", NS)) for mark in marks]
    assert counts == [1, 1, 2, 1, 1, 0]


def test_the_description_says_where_it_comes_from(tmp_path: Path) -> None:
    told = {"title": "A & B", "synthetic": "yes"}
    root = written(tmp_path / "a.kml", {"transit": frame()}, metadata=told)
    assert root.findtext("k:Document/k:name", namespaces=NS) == "A & B"
    assert "synthetic: yes" in str(root.findtext("k:Document/k:description", namespaces=NS))


def test_an_image_plane_has_no_place_on_a_globe(tmp_path: Path) -> None:
    plane = frame().set_crs(crs_door.IMAGE_PLANE, allow_override=True)
    with pytest.raises(CrsError, match="image plane"):
        write_layers(tmp_path / "a.kml", {"transit": plane})
    assert list(tmp_path.iterdir()) == []


def test_many_placemarks_are_written_with_a_word(tmp_path: Path, caplog) -> None:
    many = gpd.GeoDataFrame(geometry=shapely.points(np.zeros((100_001, 2))), crs=4326)
    with caplog.at_level(logging.WARNING, "covertool"):
        root = written(tmp_path / "a.kml", {"cars": many})
    assert "100001 placemarks" in caplog.text
    assert len(root.findall(".//k:Placemark", NS)) == 100_001


def test_streets_at_rush_hour_are_black_where_occupied_and_yellow_where_free(tmp_path) -> None:
    line = shapely.LineString([(695000, 737000), (695010, 737000)])
    columns = {"kind": ["free", "occupied", "free"], "segment_id": ["a", "b", "c"]}
    streets = gpd.GeoDataFrame(columns, geometry=[line] * 3, crs=2157)
    root = written(tmp_path / "a.kml", {"congestion": streets})
    colours = {
        f"#{style.get('id')}": style.findtext("k:LineStyle/k:color", namespaces=NS)
        for style in root.iterfind("k:Document/k:Style", NS)
    }
    drawn = {
        mark.findtext("k:name", namespaces=NS): colours[str(mark.findtext("k:styleUrl", "", NS))]
        for mark in root.iterfind(".//k:Placemark", NS)
    }
    assert drawn == {"a": "ff2fd9ff", "b": "ff000000", "c": "ff2fd9ff"}

"""OpenStreetMap extracts: every tag, every road, and nothing from a file that is cut off."""

import gzip
import logging
from pathlib import Path
from xml.etree import ElementTree

import pytest
import shapely
from pyproj import Geod

from covertool.errors import FileError, GeometryError
from covertool.gis.osm import read_buildings, read_parking_areas, read_roads

SHARED = Path(__file__).parents[2] / "../shared/data/osm"

TOWN = """<?xml version="1.0" encoding="UTF-8"?>
<osm version="0.6">
 <node id="1" lat="53.380" lon="-6.590"/>
 <node id="2" lat="53.381" lon="-6.590"/>
 <node id="3" lat="53.381" lon="-6.588"/>
 <node id="4" lat="53.380" lon="-6.588"/>
 <way id="10"><nd ref="1"/><nd ref="2"/>
  <tag k="highway" v="residential"/><tag k="name" v="Sráid &quot;Mhór&quot; \\ =&gt; x"/>
  <tag k="parking:both" v="lane"/><tag k="width" v="6.5"/></way>
 <way id="11"><nd ref="2"/><nd ref="3"/><tag k="waterway" v="canal"/></way>
 <way id="12"><nd ref="1"/><nd ref="2"/><nd ref="3"/><nd ref="4"/><nd ref="1"/>
  <tag k="amenity" v="parking"/><tag k="capacity" v="80"/></way>
 <way id="13"><nd ref="1"/><nd ref="2"/><nd ref="3"/><nd ref="1"/><tag k="building" v="yes"/></way>
 <way id="14"><nd ref="1"/><nd ref="2"/><nd ref="3"/><nd ref="4"/><nd ref="1"/>
  <tag k="highway" v="primary"/><tag k="junction" v="roundabout"/></way>
</osm>
"""


def town(path: Path, content: str = TOWN) -> Path:
    if path.suffix == ".gz":
        path.write_bytes(gzip.compress(content.encode()))
    else:
        path.write_text(content, encoding="utf-8")
    return path


@pytest.mark.parametrize("name", ["town.osm", "town.osm.gz"])
def test_roads_come_with_every_tag_and_others_do_not_come(tmp_path: Path, name: str) -> None:
    roads = read_roads(town(tmp_path / name)).set_index("osm_id")
    assert set(roads.index) == {"10", "14"}
    assert roads.loc["10", "tags"] == {
        "highway": "residential",
        "name": 'Sráid "Mhór" \\ => x',
        "parking:both": "lane",
        "width": "6.5",
    }
    assert roads.loc["10", "highway"] == "residential"
    assert roads.loc["14", "name"] is None
    assert roads.crs.to_epsg() == 2157
    ground = Geod(ellps="WGS84").inv(-6.590, 53.380, -6.590, 53.381)[2]
    assert roads.geometry["10"].length == pytest.approx(ground, rel=3e-4)
    assert roads.geometry["14"].geom_type == "LineString"


def test_parking_areas_and_buildings_are_polygons(tmp_path: Path) -> None:
    path = town(tmp_path / "town.osm")
    parking = read_parking_areas(path)
    assert parking["osm_id"].tolist() == ["12"]
    assert parking["tags"][0]["capacity"] == "80"
    outline = [(-6.590, 53.380), (-6.590, 53.381), (-6.588, 53.381), (-6.588, 53.380)]
    ground = abs(Geod(ellps="WGS84").polygon_area_perimeter(*zip(*outline, strict=True))[0])
    assert parking.area[0] == pytest.approx(ground, rel=6e-4)
    assert read_buildings(path)["osm_id"].tolist() == ["13"]


def test_an_extract_without_parking_gives_no_rows(tmp_path: Path) -> None:
    content = TOWN.replace('v="parking"', 'v="school"')
    assert len(read_parking_areas(town(tmp_path / "town.osm", content))) == 0


def test_an_extract_without_roads_is_refused(tmp_path: Path) -> None:
    content = TOWN.replace('k="highway"', 'k="path"')
    with pytest.raises(GeometryError, match="highway"):
        read_roads(town(tmp_path / "town.osm", content))


def test_an_extract_that_is_cut_off_is_refused(tmp_path: Path) -> None:
    whole = TOWN.encode()
    (tmp_path / "a.osm").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "b.osm.gz").write_bytes(gzip.compress(whole)[:-20])
    (tmp_path / "c.osm.gz").write_bytes(gzip.compress(whole[: len(whole) // 2]))
    (tmp_path / "d.osm.gz").write_bytes(b"\x1f\x8b" + b"\x00" * 40)
    (tmp_path / "e.osm").write_text("<osm><way></node></osm>")
    for path in sorted(tmp_path.iterdir()):
        with pytest.raises(FileError) as caught:
            read_roads(path)
        assert str(path) == caught.value.where


def test_entities_that_grow_are_not_expanded(tmp_path: Path) -> None:
    bomb = "".join(
        f'<!ENTITY l{i} "{("&l" + str(i - 1) + ";") * 10 if i else "lol" * 10}">' for i in range(9)
    )
    content = TOWN.replace("<osm", f"<!DOCTYPE osm [{bomb}]><osm", 1).replace("canal", "&l8;")
    with pytest.raises(FileError):
        read_roads(town(tmp_path / "town.osm", content))


def test_a_wrong_extension_or_content_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.osm.pbf").write_text(TOWN)
    (tmp_path / "a.xml").write_text(TOWN)
    for path in tmp_path.iterdir():
        with pytest.raises(FileError):
            read_roads(path)


def real(name: str) -> Path:
    path = SHARED / name
    if not path.exists():
        pytest.skip("the shared real data is not here")
    return path


def test_a_real_extract_matches_a_reading_of_its_xml() -> None:
    path = real("dublin_centre.osm")
    tagged = {
        way.get("id"): {tag.get("k"): tag.get("v") for tag in way.iter("tag")}
        for way in ElementTree.parse(path).getroot().iter("way")
    }
    expected = {key: tags for key, tags in tagged.items() if "highway" in tags}
    roads = read_roads(path).set_index("osm_id")
    # A closed way with area=yes is an area for GDAL and not a line.
    lines = {key: tags for key, tags in expected.items() if tags.get("area") != "yes"}
    assert set(lines) - set(roads.index) == set()
    assert set(roads.index) <= set(expected)
    for key in roads.index:
        tags = roads.loc[key, "tags"]
        assert tags.items() <= expected[key].items()
        missing = set(expected[key]) - set(tags)
        assert not missing & {"highway", "lanes", "width", "oneway", "tunnel", "service", "access"}


@pytest.mark.parametrize(
    ("name", "epsg", "least_km"),
    [("bad_hersfeld.osm.gz", 32632, 300), ("helsinki.osm.pbf", 32635, 40)],
)
def test_real_towns_are_read_in_their_utm_zone(
    name: str, epsg: int, least_km: float, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.WARNING, logger="covertool")
    path = real(name)
    roads, parking = read_roads(path), read_parking_areas(path)
    assert roads.crs.to_epsg() == epsg == parking.crs.to_epsg()
    assert roads.length.sum() / 1000 > least_km
    assert parking.is_valid.all()
    assert len(parking) > 20
    assert all(isinstance(tags, dict) and "highway" in tags for tags in roads["tags"])


def test_a_real_pbf_that_is_cut_off_is_refused(tmp_path: Path) -> None:
    content = real("helsinki.osm.pbf").read_bytes()
    path = tmp_path / "cut.osm.pbf"
    path.write_bytes(content[: len(content) * 2 // 3])
    with pytest.raises(FileError, match="cut off"):
        read_roads(path)


def test_a_broken_ring_is_dropped_and_counted(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.WARNING, logger="covertool")
    logging.getLogger("covertool").propagate = True
    content = TOWN.replace(
        '<way id="13"><nd ref="1"/><nd ref="2"/><nd ref="3"/><nd ref="1"/>',
        '<way id="13"><nd ref="1"/><nd ref="3"/><nd ref="2"/><nd ref="4"/><nd ref="1"/>',
    )
    buildings = read_buildings(town(tmp_path / "town.osm", content))
    assert buildings.is_valid.all()
    assert "1 invalid polygons repaired" in caplog.text
    assert isinstance(buildings.geometry[0], shapely.MultiPolygon)

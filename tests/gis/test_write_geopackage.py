"""GeoPackages as an independent reader (SQLite itself) sees them."""

import sqlite3
from contextlib import closing
from pathlib import Path
from xml.etree import ElementTree

import geopandas as gpd
import numpy as np
import pandas as pd
import pyogrio
import pytest
import shapely

from covertool import crs as crs_door
from covertool.errors import FileError, OptionError
from covertool.gis import geopackage
from covertool.gis.read import read_anchors, read_study
from covertool.gis.write import write_layers
from covertool.model import Anchors, TransitArea, Vehicles

IRISH = crs_door.IRISH_TM


def anchors(count: int = 3, crs: object = IRISH) -> gpd.GeoDataFrame:
    places = np.arange(count, dtype=float)
    return Anchors.from_points(695000 + places, 737000 + places, crs).to_frame()


def transit(crs: object = IRISH) -> gpd.GeoDataFrame:
    shape = shapely.MultiPolygon([shapely.box(695000, 737000, 695100, 737100)])
    return TransitArea(shape, crs).to_frame()


def ask(path: Path, sql: str) -> list[tuple[object, ...]]:
    with closing(sqlite3.connect(f"{path.as_uri()}?mode=ro", uri=True)) as connection:
        return connection.execute(sql).fetchall()


def test_the_same_layers_give_the_same_bytes(tmp_path: Path) -> None:
    layers = {"anchors": anchors(500), "transit": transit(), "coverage_level_1": transit()}
    for name in ("one.gpkg", "two.gpkg"):
        write_layers(tmp_path / name, layers, metadata={"run": "x"})
    assert (tmp_path / "one.gpkg").read_bytes() == (tmp_path / "two.gpkg").read_bytes()


def test_polygons_are_multi_and_every_layer_has_a_spatial_index(tmp_path: Path) -> None:
    path = tmp_path / "s.gpkg"
    write_layers(path, {"anchors": anchors(), "transit": transit()})
    kinds = dict(ask(path, "SELECT table_name, geometry_type_name FROM gpkg_geometry_columns"))
    assert kinds == {"anchors": "POINT", "transit": "MULTIPOLYGON"}
    assert ask(path, "SELECT count(*) FROM rtree_anchors_geom") == [(3,)]
    assert ask(path, "SELECT count(*) FROM rtree_transit_geom") == [(1,)]
    assert ask(path, "PRAGMA integrity_check") == [("ok",)]
    assert path.read_bytes()[18:20] == b"\x01\x01"  # rollback journal, not WAL
    assert ask(path, "SELECT srs_id FROM gpkg_geometry_columns") == [(2157,), (2157,)]


def test_each_layer_carries_the_papers_colour_as_qml_and_sld(tmp_path: Path) -> None:
    path = tmp_path / "s.gpkg"
    names = ["coverage_level_1", "coverage_level_2", "coverage_level_3", "transit"]
    write_layers(path, {**dict.fromkeys(names, transit()), "anchors": anchors(), "mine": anchors()})
    rows = ask(
        path,
        "SELECT f_table_name, f_geometry_column, useAsDefault, styleQML, styleSLD"
        " FROM layer_styles",
    )
    assert sorted(row[0] for row in rows) == sorted([*names, "anchors"])
    colours = {}
    for name, column, default, qml, sld in rows:
        assert (column, default) == ("geom", 1)
        option = ElementTree.fromstring(str(qml)).find(".//Option[@name='color']")
        assert option is not None
        colours[name] = tuple(map(int, option.get("value", "").split(",")[:3]))
        assert "#{:02x}{:02x}{:02x}".format(*colours[name]) in str(sld)
        ElementTree.fromstring(str(sld).encode())
    hue = {name: colours[name] for name in names}
    assert hue["coverage_level_1"][:2] > (200, 200)
    assert hue["coverage_level_1"][2] < 60
    assert hue["coverage_level_2"][0] > 200 > hue["coverage_level_2"][1] > 100
    assert hue["coverage_level_3"][0] > 200 > 60 > max(hue["coverage_level_3"][1:])
    assert hue["transit"][2] == max(hue["transit"])
    assert colours["anchors"] == (0, 0, 0)


def test_into_replaces_its_own_layers_and_leaves_the_others_as_they_are(tmp_path: Path) -> None:
    path = tmp_path / "s.gpkg"
    write_layers(path, {"anchors": anchors(3), "transit": transit()}, metadata={"a": "1"})
    before = ask(path, "SELECT fid, geom, id, area_m2 FROM transit")
    write_layers(path, {"anchors": anchors(5)}, into=True, metadata={"b": "2"})
    assert ask(path, "SELECT count(*) FROM anchors") == [(5,)]
    assert ask(path, "SELECT count(*) FROM rtree_anchors_geom") == [(5,)]
    assert ask(path, "SELECT fid, geom, id, area_m2 FROM transit") == before
    assert ask(path, "SELECT count(*) FROM layer_styles WHERE f_table_name = 'anchors'") == [(1,)]
    assert geopackage.read_metadata(path) == {"a": "1", "b": "2"}
    assert ask(path, "PRAGMA integrity_check") == [("ok",)]


def test_into_a_file_that_is_not_there_makes_it(tmp_path: Path) -> None:
    write_layers(tmp_path / "s.gpkg", {"anchors": anchors()}, into=True)
    assert len(read_anchors(tmp_path / "s.gpkg")) == 3


def test_into_a_file_of_another_program_keeps_its_layers(tmp_path: Path) -> None:
    path = tmp_path / "qgis.gpkg"
    lakes = gpd.GeoDataFrame({"name": ["Erne"]}, geometry=[shapely.box(0, 0, 1, 1)], crs=4326)
    pyogrio.write_dataframe(lakes, path, layer="lakes", driver="GPKG")
    write_layers(path, {"anchors": anchors()}, into=True)
    assert pyogrio.read_dataframe(path, layer="lakes")["name"].tolist() == ["Erne"]
    assert len(read_anchors(path)) == 3


def test_overwrite_leaves_no_stale_layer(tmp_path: Path) -> None:
    path = tmp_path / "s.gpkg"
    write_layers(path, {"old": anchors()})
    with pytest.raises(FileError, match="exists"):
        write_layers(path, {"anchors": anchors()})
    write_layers(path, {"anchors": anchors()}, overwrite=True)
    names = {str(row[0]) for row in ask(path, "SELECT name FROM sqlite_master")}
    assert not any("old" in name for name in names)


def test_an_image_plane_survives_the_round_trip(tmp_path: Path) -> None:
    path = tmp_path / "s.gpkg"
    plane = crs_door.IMAGE_PLANE
    write_layers(path, {"anchors": anchors(crs=plane), "transit": transit(plane)})
    study = read_study(path)
    assert study.anchors is not None
    assert study.transit is not None
    assert study.anchors.crs == plane == study.transit.crs
    assert study.anchors.x_m.tolist() == [695000, 695001, 695002]


def test_true_false_and_unknown_stay_apart_in_the_file(tmp_path: Path) -> None:
    frame = anchors(3).assign(
        parked=np.array([True, False, None], dtype=object),
        site=np.array([None, "lot", None], dtype=object),
        empty=np.array([None, None, None], dtype=object),
        area_m2=np.array([None, 2, 3.5], dtype=object),
    )
    path = tmp_path / "s.gpkg"
    write_layers(path, {"anchors": frame})
    assert ask(path, "SELECT parked, site, empty, area_m2, radius_m FROM anchors") == [
        (1, None, None, None, None),
        (0, "lot", None, 2.0, None),
        (None, None, None, 3.5, None),
    ]
    types = {row[1]: row[2] for row in ask(path, "PRAGMA table_info(anchors)")}
    assert types["parked"] == "BOOLEAN"
    assert types["site"].startswith("TEXT")
    assert types["area_m2"] == "REAL"


def test_a_layer_without_rows_keeps_its_columns_and_types(tmp_path: Path) -> None:
    path = tmp_path / "s.gpkg"
    write_layers(path, {"vehicles": Vehicles.empty(IRISH).to_frame()})
    types = {row[1]: row[2] for row in ask(path, "PRAGMA table_info(vehicles)")}
    assert types["parked"] == "BOOLEAN"
    assert types["heading_deg"] == types["score"] == "REAL"
    assert types["geom"] == "MULTIPOLYGON"
    found = read_study(path).vehicles
    assert found is not None
    assert len(found) == 0


def test_columns_named_fid_geom_and_geometry_are_kept(tmp_path: Path) -> None:
    frame = anchors(2).rename_geometry("place")
    frame = frame.assign(fid=["x", "y"], geom=["p", "q"], geometry=["r", "s"])
    path = tmp_path / "s.gpkg"
    write_layers(path, {"anchors": frame})
    assert ask(path, "SELECT fid, geom, geometry FROM anchors") == [
        ("x", "p", "r"),
        ("y", "q", "s"),
    ]
    assert len(read_anchors(path)) == 2


def test_a_wal_mode_target_is_settled_and_one_in_use_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "s.gpkg"
    write_layers(path, {"anchors": anchors(), "transit": transit()})
    user = sqlite3.connect(path)
    user.execute("PRAGMA journal_mode=WAL")
    user.execute("CREATE TABLE notes (n)")
    user.commit()
    before = path.read_bytes()
    with pytest.raises(FileError, match="another program"):
        write_layers(path, {"anchors": anchors(9)}, into=True)
    assert path.read_bytes() == before
    user.close()
    write_layers(path, {"anchors": anchors(9)}, into=True)
    assert [p.name for p in tmp_path.iterdir()] == ["s.gpkg"]
    assert ask(path, "SELECT count(*) FROM anchors") == [(9,)]
    assert ask(path, "SELECT count(*) FROM notes") == [(0,)]


def test_a_locked_target_is_refused_and_stays_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "s.gpkg"
    write_layers(path, {"anchors": anchors()})
    before = path.read_bytes()
    with closing(sqlite3.connect(path)) as holder:
        holder.execute("BEGIN EXCLUSIVE")
        for how in ({"into": True}, {"overwrite": True}):
            with pytest.raises(FileError, match="another program"):
                write_layers(path, {"anchors": anchors(9)}, **how)
    assert path.read_bytes() == before


def test_garbage_is_not_written_into_but_may_be_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "s.gpkg"
    path.write_bytes(b"garbage" * 100)
    with pytest.raises(FileError, match="content is not"):
        write_layers(path, {"anchors": anchors()}, into=True)
    write_layers(path, {"anchors": anchors()}, overwrite=True)
    assert len(read_anchors(path)) == 3


def test_a_write_that_fails_leaves_the_old_file_and_nothing_beside_it(tmp_path: Path) -> None:
    path = tmp_path / "s.gpkg"
    write_layers(path, {"anchors": anchors()})
    before = path.read_bytes()
    bad = anchors().assign(odd=[complex(1, 2)] * 3)
    with pytest.raises(Exception, match=r"complex|odd"):
        write_layers(path, {"transit": transit(), "anchors": bad}, overwrite=True)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("name", ["layer_styles", "metadata", "gpkg_contents", "sqlite_x", ""])
def test_names_that_the_format_keeps_for_itself_are_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(OptionError):
        write_layers(tmp_path / "s.gpkg", {name: anchors()})
    assert list(tmp_path.iterdir()) == []


def test_a_table_of_times_and_numbers_keeps_them(tmp_path: Path) -> None:
    times = pd.to_datetime(["2024-03-04T08:00:00Z", None, "2024-03-04T09:30:00Z"])
    path = tmp_path / "s.gpkg"
    write_layers(path, {"segments": anchors().assign(time=times, count=[1, 2, 3])})
    rows = ask(path, 'SELECT time, "count" FROM segments')
    assert [count for _, count in rows] == [1, 2, 3]
    assert pd.Timestamp(str(rows[0][0])) == times[0]
    assert rows[1][0] is None

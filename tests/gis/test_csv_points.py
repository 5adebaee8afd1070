"""Points in CSV tables: delimiters, encodings, decimal commas, column names."""

import logging
from pathlib import Path

import numpy as np
import pytest

from covertool.errors import ColumnError, CrsError, FileError, GeometryError
from covertool.gis.read import read_anchors

CLEAN = "id,x,y,radius_m,device_class\na,695000.5,737000.25,15,A\nb,695010,737020,,\n"


def anchors_of(path: Path, content: str | bytes, crs: str | None = "EPSG:2157") -> list[object]:
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    found = read_anchors(path, crs=crs)
    return [list(found.id), found.x_m.tolist(), found.y_m.tolist(), list(found.device_class)]


@pytest.mark.parametrize(
    "content",
    [
        CLEAN.replace("\n", "\r\n"),
        b"\xef\xbb\xbf" + CLEAN.encode(),
        CLEAN.encode("utf-16"),
        CLEAN.replace(".", ",,").replace(",", ";").replace(";;", ","),
        CLEAN.replace(",", "\t"),
        CLEAN.replace("id,x,y", "ID, X ,Y"),
        CLEAN.replace("x,y", "Easting,Northing"),
        CLEAN.replace(",737020,", ', "737020",'),
        CLEAN + "\n\n",
    ],
    ids=["crlf", "bom", "utf-16", "decimal comma", "tab", "case", "names", "quotes", "blank"],
)
def test_the_dress_of_a_table_does_not_change_its_points(
    tmp_path: Path, content: str | bytes
) -> None:
    clean = anchors_of(tmp_path / "clean.csv", CLEAN)
    assert clean[:3] == [["a", "b"], [695000.5, 695010.0], [737000.25, 737020.0]]
    assert anchors_of(tmp_path / "dressed.csv", content) == clean


def test_lon_lat_needs_no_crs_and_takes_only_a_geographic_one(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("lon,lat\n-8.0,53.5\n")
    anchors = read_anchors(path)
    assert anchors.crs.to_epsg() == 2157
    assert (anchors.x_m[0], anchors.y_m[0]) == pytest.approx((600000, 750000), abs=1e-3)
    assert len(read_anchors(path, crs="EPSG:4258")) == 1
    with pytest.raises(CrsError, match="degrees"):
        read_anchors(path, crs="EPSG:2157")


def test_x_y_without_a_crs_is_refused_with_the_option(tmp_path: Path) -> None:
    with pytest.raises(CrsError) as caught:
        anchors_of(tmp_path / "a.csv", CLEAN, crs=None)
    assert "--crs" in caught.value.mend


def test_lon_lat_beside_x_y_serves_where_no_crs_is_named(tmp_path: Path) -> None:
    content = "x,y,lon,lat\n1,2,-8.0,53.5\n"
    assert anchors_of(tmp_path / "a.csv", content, crs=None)[1][0] == pytest.approx(
        600000, abs=1e-3
    )
    assert anchors_of(tmp_path / "a.csv", content)[1] == [1]


def test_misspelt_coordinate_columns_are_recognised(tmp_path: Path) -> None:
    with pytest.raises(ColumnError) as caught:
        anchors_of(tmp_path / "a.csv", "lon,lattitude\n1,2\n", crs=None)
    assert "'lattitude' for 'latitude'" in caught.value.mend


def test_swapped_latitude_and_longitude_beyond_the_pole_are_refused(tmp_path: Path) -> None:
    with pytest.raises(CrsError, match="not degrees"):
        anchors_of(tmp_path / "a.csv", "lon,lat\n-36.8,174.7\n-36.9,174.8\n", crs=None)


def test_rows_without_a_number_are_dropped_and_counted(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.WARNING, logger="covertool")
    logging.getLogger("covertool").propagate = True
    content = "x,y\n695000,737000\n,737000\nnan,1\ninf,2\nfar,away\n695001,737001\n"
    assert anchors_of(tmp_path / "a.csv", content)[1] == [695000, 695001]
    assert "4 geometries with NaN or infinite" in caplog.text


def test_a_table_without_one_good_place_is_refused(tmp_path: Path) -> None:
    with pytest.raises(GeometryError, match="none of the 2"):
        anchors_of(tmp_path / "a.csv", "x,y\n,\nfar,away\n")


def test_a_table_that_is_not_utf8_is_read_with_a_warning(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.WARNING, logger="covertool")
    logging.getLogger("covertool").propagate = True
    content = "id,x,y\nStraße,695000,737000\n".encode("cp1252")
    assert anchors_of(tmp_path / "a.csv", content)[0] == ["Straße"]
    assert "Windows-1252" in caplog.text


@pytest.mark.parametrize(
    "content",
    [
        "x,y\n695000,5,737000,2\n",  # decimal commas between commas
        "x,y\n1,2\n1,2,3,4\n",
        b"x,y\n\x00\x01\x02\x03",
        b"\x00\x01\x02\x03",
        '"x,y\n1,2\n',
    ],
)
def test_a_table_that_is_none_is_refused(tmp_path: Path, content: str | bytes) -> None:
    with pytest.raises((FileError, ColumnError, GeometryError)):
        anchors_of(tmp_path / "a.csv", content)


def test_a_header_alone_gives_no_anchors(tmp_path: Path) -> None:
    assert anchors_of(tmp_path / "a.csv", "x,y\n")[0] == []


def test_a_long_table_is_read_whole(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    x = rng.uniform(695000, 696000, 20_000)
    rows = "\n".join(f"{value!r},737000" for value in x.tolist())
    assert anchors_of(tmp_path / "a.csv", f"x,y\n{rows}\n")[1] == x.tolist()

"""What a Shapefile would lose is refused with a word; what it holds comes back."""

from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely

from covertool.errors import CovertoolError, FileError, GeometryError
from covertool.gis import shapefile
from covertool.gis.write import write_layers


def cars(**columns: object) -> gpd.GeoDataFrame:
    count = len(next(iter(columns.values()))) if columns else 1  # type: ignore[arg-type]
    return gpd.GeoDataFrame(columns, geometry=shapely.points(np.zeros((count, 2))), crs=2157)


def refused(path: Path, frame: gpd.GeoDataFrame, kind: type[CovertoolError]) -> str:
    with pytest.raises(kind) as caught:
        write_layers(path, {"cars": frame})
    assert list(path.parent.iterdir()) == []
    assert "gpkg" in caught.value.mend
    return caught.value.what


def test_text_that_would_be_cut_is_refused_and_the_longest_that_fits_is_kept(tmp_path) -> None:
    path = tmp_path / "a.shp"
    assert "note (256 bytes)" in refused(path, cars(note=["é" * 128]), FileError)
    write_layers(path, {"cars": cars(note=["é" * 127])})
    assert gpd.read_file(path)["note"].tolist() == ["é" * 127]


def test_mixed_geometry_is_refused(tmp_path: Path) -> None:
    shapes = [shapely.Point(0, 0), shapely.box(0, 0, 1, 1)]
    mixed = gpd.GeoDataFrame(geometry=shapes, crs=2157)
    assert "points, lines or areas" in refused(tmp_path / "a.shp", mixed, GeometryError)


def test_more_columns_than_the_format_has_are_refused(tmp_path: Path) -> None:
    wide = cars(**{f"c{number}": [1] for number in range(256)})
    assert "255" in refused(tmp_path / "a.shp", wide, FileError)


def test_a_layer_beyond_the_limit_is_refused_before_anything_is_written() -> None:
    frame = cars(note=["x" * 100] * 1000)
    shapefile.require_fits(shapefile.plain(frame), "a.shp")
    with pytest.raises(FileError, match="2 GB"):
        shapefile.require_fits(shapefile.plain(frame), "a.shp", limit=100_000)


def test_moments_keep_their_time_of_day(tmp_path: Path) -> None:
    times = pd.to_datetime(["2024-03-04T08:00:30Z", None])
    write_layers(tmp_path / "a.shp", {"cars": cars(time=times)})
    back = gpd.read_file(tmp_path / "a.shp")["time"].tolist()
    assert pd.Timestamp(back[0]) == times[0]
    assert back[1] is None or back[1] != back[1]


def test_the_same_layer_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        write_layers(tmp_path / name / "a.shp", {"cars": cars(id=["1", "2"])})
    for part in (tmp_path / "one").iterdir():
        assert part.read_bytes() == (tmp_path / "two" / part.name).read_bytes(), part.name


def test_provenance_lies_beside_a_format_that_cannot_hold_it(tmp_path: Path) -> None:
    write_layers(tmp_path / "a.shp", {"cars": cars(id=["1"])}, metadata={"title": "é"})
    assert (tmp_path / "a.shp.provenance.json").read_text() == '{"title": "é"}\n'

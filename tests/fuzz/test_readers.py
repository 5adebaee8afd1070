"""What hypothesis writes is read again, or refused; damaged files of every format are refused."""

from __future__ import annotations

import contextlib
import csv
import io
import json
import math
import warnings
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import rasterio
import shapely
from affine import Affine
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from covertool.errors import CovertoolError, FileError
from covertool.gis.geotiff import open_raster
from covertool.gis.read import read_anchors, read_transit
from covertool.traffic.trace import read_fcd

QUIET = settings(max_examples=30, deadline=None, suppress_health_check=list(HealthCheck))
CRS = "EPSG:2157"

near = st.floats(-500, 500).map(lambda metres: round(metres, 3))
texts = st.text(st.characters(exclude_categories=["Cs", "Cc"]), max_size=12)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("fuzz")


@QUIET
@given(
    rows=st.lists(st.tuples(texts, near, near), min_size=1, max_size=8),
    dress=st.sampled_from([(",", "."), (";", ","), ("\t", "."), (";", ".")]),
    mark=st.booleans(),
)
def test_points_come_back_whatever_their_ids_and_dress(
    folder: Path, rows: list[tuple[str, float, float]], dress: tuple[str, str], mark: bool
) -> None:
    delimiter, point = dress
    out = io.StringIO()
    writer = csv.writer(out, delimiter=delimiter, quoting=csv.QUOTE_NONNUMERIC)
    writer.writerow(["id", "x", "y"])
    for name, x, y in rows:
        writer.writerow([name, *(repr(v).replace(".", point) for v in (693_500 + x, 737_000 + y))])
    path = folder / "points.csv"
    path.write_text(out.getvalue(), encoding="utf-8-sig" if mark else "utf-8", newline="")
    found = read_anchors(path, crs=CRS, dst_crs=CRS)
    np.testing.assert_allclose(found.x_m, [693_500 + x for _, x, _ in rows], atol=1e-6)
    np.testing.assert_allclose(found.y_m, [737_000 + y for _, _, y in rows], atol=1e-6)


anything = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers(-200, 200) | texts,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(texts, inner, max_size=3),
    max_leaves=12,
)
places = st.lists(st.tuples(st.floats(-6.31, -6.29), st.floats(53.29, 53.31)), max_size=7)
shapes = st.builds(
    lambda kind, points: {"type": kind, "coordinates": points},
    st.sampled_from(["Polygon", "MultiPolygon", "Point", "LineString", "Nonsense"]),
    places.map(lambda ring: [ring]) | places.map(lambda ring: [[[*ring, *ring[:1]]]]) | anything,
)


@QUIET
@given(st.lists(shapes, max_size=4), anything)
def test_geojson_of_any_shapes_is_a_valid_area_or_refused(
    folder: Path, found: list[object], extra: object
) -> None:
    features = [{"type": "Feature", "properties": {"a": extra}, "geometry": g} for g in found]
    path = folder / "area.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    with warnings.catch_warnings(), contextlib.suppress(CovertoolError):
        warnings.simplefilter("ignore")
        area = read_transit(path).polygons
        assert area.is_valid
        assert area.area > 0


@QUIET
@given(
    st.lists(
        st.tuples(
            st.integers(0, 4), st.sampled_from(["a", "b", "=1+1"]), st.floats(), st.floats(),
            st.floats(), st.floats(),
        ),
        max_size=8,
    )
)  # fmt: skip
def test_a_trace_of_any_numbers_is_finite_or_refused(
    folder: Path, rows: list[tuple[object, ...]]
) -> None:
    path = folder / "fcd.csv"
    lines = [",".join(map(str, row)) for row in rows]
    path.write_text("\n".join(["time,id,x,y,angle,speed", *lines]) + "\n")
    with warnings.catch_warnings(), contextlib.suppress(CovertoolError):
        warnings.simplefilter("ignore")
        trace = read_fcd(path)
        for values in (trace.time_s, trace.x_m, trace.y_m, trace.vx, trace.vy):
            assert np.isfinite(values).all()


def whole_file(name: str, folder: Path) -> bytes:
    path = folder / f"whole_{name}"
    if path.suffix in (".tif", ".png"):
        driver = {".tif": "GTiff", ".png": "PNG"}[path.suffix]
        with rasterio.open(
            path, "w", driver=driver, width=40, height=40, count=1, dtype="uint8", crs=CRS,
            transform=Affine(0.2, 0, 693_500, 0, -0.2, 737_000),
        ) as target:  # fmt: skip
            target.write(np.arange(1600, dtype=np.uint8).reshape(1, 40, 40))
    else:
        points = shapely.points(693_500 + np.arange(9.0), 737_000 + np.arange(9.0))
        frame = gpd.GeoDataFrame({"id": [f"car {i}" for i in range(9)]}, geometry=points, crs=CRS)
        frame.to_parquet(path) if path.suffix == ".parquet" else frame.to_file(path)
    return path.read_bytes()


@pytest.mark.parametrize("name", ["a.gpkg", "a.fgb", "a.parquet", "a.shp", "a.tif", "a.png"])
def test_bytes_changed_in_a_binary_file_are_read_or_refused(name: str, folder: Path) -> None:
    whole = whole_file(name, folder)

    @QUIET
    @given(
        st.lists(st.tuples(st.floats(0, 0.9999), st.integers(0, 255)), min_size=1, max_size=12),
        st.floats(0.5, 1.0),
    )
    def damaged(changes: list[tuple[float, int]], kept: float) -> None:
        content = bytearray(whole)
        for place, value in changes:
            content[int(place * len(content))] = value
        path = folder / name
        path.write_bytes(content[: math.ceil(kept * len(content))])
        with warnings.catch_warnings(), contextlib.suppress(CovertoolError):
            warnings.simplefilter("ignore")
            if path.suffix in (".tif", ".png"):
                open_raster(path, gsd_m=0.2).read(0, 0, 40, 40)
            else:
                found = read_anchors(path, crs=CRS if path.suffix == ".shp" else None)
                assert np.isfinite(found.x_m).all()

    damaged()


def test_a_layer_whose_name_is_no_text_is_refused(folder: Path) -> None:
    content = whole_file("a.fgb", folder).replace(b"whole_a", b"whole\x80a")
    path = folder / "named.fgb"
    path.write_bytes(content)
    with pytest.raises(FileError, match="cannot be read"):
        read_anchors(path)

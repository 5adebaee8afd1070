"""Anchors read by bounding box from GeoParquet: the same rows as a scan, little of the file."""

import pickle
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from covertool.crs import IMAGE_PLANE, IRISH_TM
from covertool.errors import ColumnError, CrsError, FileError
from covertool.gis.parquet import ParquetAnchors, write_anchors
from covertool.gis.read import read_anchors
from covertool.gis.write import write_layers
from covertool.model import Anchors, AnchorSource

COUNT = 100_000
BOX = (696000.0, 737000.0, 696500.0, 738200.0)


def anchors(count: int = COUNT) -> Anchors:
    rng = np.random.default_rng(11)
    return Anchors.from_points(
        rng.uniform(690000, 700000, count), rng.uniform(730000, 740000, count), IRISH_TM
    )


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Anchors]:
    path = tmp_path_factory.mktemp("parquet") / "a.parquet"
    write_anchors(path, anchors())
    return path, anchors()


def count_in_box(source: AnchorSource) -> int:
    return len(source.read(BOX))


def test_a_box_gives_the_rows_of_a_scan_edges_included(stored: tuple[Path, Anchors]) -> None:
    path, whole = stored
    edge = (whole.x_m[0], whole.y_m[0], whole.x_m[0] + 50, whole.y_m[0] + 50)
    for x0, y0, x1, y1 in (BOX, edge, (0.0, 0.0, 1.0, 1.0)):
        inside = (whole.x_m >= x0) & (whole.x_m <= x1) & (whole.y_m >= y0) & (whole.y_m <= y1)
        found = ParquetAnchors(path).read((x0, y0, x1, y1))
        assert sorted(found.id) == sorted(whole.id[inside])
    assert whole.id[0] in ParquetAnchors(path).read(edge).id


def test_the_whole_source_is_every_anchor_with_its_columns(stored: tuple[Path, Anchors]) -> None:
    path, whole = stored
    source = ParquetAnchors(path)
    found = source.read()
    order = np.argsort(found.id.astype(int))
    np.testing.assert_array_equal(found.x_m[order], whole.x_m)
    np.testing.assert_array_equal(found.y_m[order], whole.y_m)
    assert np.isnan(found.radius_m).all()
    assert set(found.device_class) == {None}
    assert source.crs == IRISH_TM
    np.testing.assert_allclose(
        source.bounds, (whole.x_m.min(), whole.y_m.min(), whole.x_m.max(), whole.y_m.max())
    )


def test_most_row_groups_lie_outside_a_small_box(stored: tuple[Path, Anchors]) -> None:
    metadata = pq.ParquetFile(stored[0]).metadata
    names = [metadata.schema.column(i).path for i in range(metadata.num_columns)]
    x, y = names.index("x_m"), names.index("y_m")
    touched = 0
    for group in range(metadata.num_row_groups):
        row_group = metadata.row_group(group)
        sx, sy = row_group.column(x).statistics, row_group.column(y).statistics
        touched += sx.max >= BOX[0] and sx.min <= BOX[2] and sy.max >= BOX[1] and sy.min <= BOX[3]
    assert metadata.num_row_groups >= 6
    assert touched <= 3


def test_a_file_without_statistics_gives_the_same_rows(
    stored: tuple[Path, Anchors], tmp_path: Path
) -> None:
    bare = tmp_path / "bare.parquet"
    pq.write_table(pq.read_table(stored[0]), bare, write_statistics=False)
    assert pq.ParquetFile(bare).metadata.row_group(0).column(1).statistics is None
    told, untold = (ParquetAnchors(path).read(BOX) for path in (stored[0], bare))
    assert sorted(told.id) == sorted(untold.id)


def test_a_file_that_was_written_anew_is_read_anew(tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    write_anchors(path, anchors(50_000))
    source = ParquetAnchors(path)
    before = len(source.read(BOX))
    write_anchors(path, anchors(100), overwrite=True)
    assert len(source.read()) == 100
    assert len(source.read(BOX)) < before


def test_the_source_travels_to_another_process(stored: tuple[Path, Anchors]) -> None:
    source = ParquetAnchors(stored[0])
    assert pickle.loads(pickle.dumps(source)) == source
    with ProcessPoolExecutor(1) as pool:
        assert pool.submit(count_in_box, source).result() == count_in_box(source) > 0


def test_the_file_is_an_ordinary_geoparquet_and_the_same_each_time(tmp_path: Path) -> None:
    few = anchors(50)
    write_anchors(tmp_path / "a.parquet", few)
    write_anchors(tmp_path / "b.parquet", few)
    assert (tmp_path / "a.parquet").read_bytes() == (tmp_path / "b.parquet").read_bytes()
    assert sorted(read_anchors(tmp_path / "a.parquet").x_m) == sorted(few.x_m)
    with pytest.raises(FileError, match="exists"):
        write_anchors(tmp_path / "a.parquet", few)


@pytest.mark.parametrize("count", [0, 1])
def test_none_and_one_anchor_are_stored_too(tmp_path: Path, count: int) -> None:
    path = tmp_path / "a.parquet"
    write_anchors(path, Anchors.from_points(np.zeros(count), np.zeros(count), IMAGE_PLANE))
    source = ParquetAnchors(path)
    assert source.crs == IMAGE_PLANE
    assert len(source.read()) == count
    assert len(source.read((-1, -1, 1, 1))) == count


def test_a_file_that_is_not_of_anchors_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    frame = anchors(5).to_frame().drop(columns="x_m")
    write_layers(path, {"zones": frame})
    with pytest.raises(ColumnError, match="x_m"):
        ParquetAnchors(path)
    path.write_bytes(b"PAR1garbage")
    with pytest.raises(FileError):
        ParquetAnchors(path)


def test_a_parquet_of_degrees_is_no_source_of_metres(tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    write_layers(path, {"anchors": anchors(5).to_frame().to_crs(4326)})
    with pytest.raises(CrsError):
        ParquetAnchors(path)

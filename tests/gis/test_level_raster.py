"""The level map as an independent reader and rio-cogeo see it."""

from pathlib import Path

import numpy as np
import pytest
import rasterio
from rio_cogeo import cog_validate

from covertool.crs import IRISH_TM
from covertool.errors import FileError
from covertool.gis.geotiff import write_level_raster

SHAPE = (1300, 1100)
AFFINE = (0.5, 0.0, 695000.0, 0.0, -0.5, 738000.0)


def levels() -> np.ndarray:
    rng = np.random.default_rng(3)
    coarse = rng.integers(0, 4, (26, 22)).astype(np.uint8)
    data = np.kron(coarse, np.ones((50, 50), dtype=np.uint8))
    data[:, 1000:] = 255
    return data


def blocks(data: np.ndarray) -> list[tuple[int, int, np.ndarray]]:
    return [
        (row, column, data[row : row + 400, column : column + 300])
        for row in range(0, 1300, 400)
        for column in range(0, 1000, 300)
    ]


def test_the_map_is_a_valid_cog_with_the_levels_and_their_colours(tmp_path: Path) -> None:
    path, data = tmp_path / "levels.tif", levels()
    write_level_raster(path, blocks(data), SHAPE, AFFINE, IRISH_TM)
    valid, errors, warnings = cog_validate(path)
    assert (valid, errors, warnings) == (True, [], [])
    with rasterio.open(path) as dataset:
        np.testing.assert_array_equal(dataset.read(1), data)
        assert dataset.nodata == 255
        assert dataset.crs.to_epsg() == 2157
        assert tuple(dataset.transform)[:6] == AFFINE
        assert dataset.dtypes == ("uint8",)
        assert dataset.block_shapes == [(512, 512)]
        assert dataset.overviews(1)
        yellow, orange, red = (dataset.colormap(1)[level][:3] for level in (1, 2, 3))
        assert min(yellow[:2]) > 200 > 60 > yellow[2]
        assert orange[0] > 200 > orange[1] > 100 > orange[2]
        assert red[0] > 200 > 60 > max(red[1:])
        tags = dataset.tags(1)
        assert float(tags["STATISTICS_MEAN"]) == pytest.approx(data[data < 255].mean(), abs=1e-3)
    assert list(tmp_path.iterdir()) == [path]


def test_overviews_hold_the_most_common_level_not_a_mean(tmp_path: Path) -> None:
    path = tmp_path / "levels.tif"
    data = np.zeros(SHAPE, dtype=np.uint8)
    data[:, ::4] = 3
    write_level_raster(path, [(0, 0, data)], SHAPE, AFFINE, IRISH_TM)
    with rasterio.open(path, overview_level=0) as dataset:
        assert set(np.unique(dataset.read(1))) <= {0, 3}


def test_what_no_block_covers_is_nodata(tmp_path: Path) -> None:
    path = tmp_path / "levels.tif"
    write_level_raster(path, [(10, 20, np.ones((5, 6), np.uint8))], (40, 50), AFFINE, IRISH_TM)
    with rasterio.open(path) as dataset:
        assert int((dataset.read(1) == 1).sum()) == 30
        assert int((dataset.read(1) == 255).sum()) == 40 * 50 - 30


def test_a_failure_on_the_way_leaves_no_file(tmp_path: Path) -> None:
    def broken() -> object:
        yield (0, 0, np.ones((5, 6), np.uint8))
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        write_level_raster(tmp_path / "levels.tif", broken(), (40, 50), AFFINE, IRISH_TM)
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(FileError):
        write_level_raster(tmp_path / "levels.png", [], (4, 5), AFFINE, IRISH_TM)

"""Level raster against GDAL: 4541 discs of 100 m at 0.5 m, side by side in one run.

python -m benchmarks.raster [--quick]
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np
import shapely
from rasterio.features import MergeAlg, rasterize
from rasterio.transform import from_origin

from benchmarks.rows import Row, main, side_by_side
from covertool.coverage import level_areas
from covertool.coverage.raster import RasterGrid, grid_over, level_rows
from covertool.coverage.scanlines import depth_profile
from covertool.gis.read import read_anchors, read_transit
from covertool.gis.sample import SAMPLE_STUDY, sample_folder

GSD_M = 0.5


def each_disc_alone(discs: np.ndarray, radius_m: float, grid: RasterGrid) -> None:
    """Rasterise each disc in its own window and add the window to the counts."""
    counts = np.zeros((grid.height, grid.width), dtype=np.int32)
    size = int(2 * radius_m / GSD_M) + 2
    for disc in discs:
        x0, _, _, y1 = disc.bounds
        column, row = int((x0 - grid.left_m) // GSD_M), int((grid.top_m - y1) // GSD_M)
        left, top = grid.left_m + column * GSD_M, grid.top_m - row * GSD_M
        window = rasterize([disc], (size, size), transform=from_origin(left, top, GSD_M, GSD_M))
        r0, c0 = max(row, 0), max(column, 0)
        part = counts[r0 : max(row + size, 0), c0 : max(column + size, 0)]
        part += window[r0 - row :, c0 - column :][: part.shape[0], : part.shape[1]]


def all_discs_added(discs: np.ndarray, grid: RasterGrid) -> None:
    """Let GDAL add all discs in one call, its fastest way."""
    rasterize(
        [(disc, 1) for disc in discs],
        (grid.height, grid.width),
        transform=from_origin(grid.left_m, grid.top_m, GSD_M, GSD_M),
        merge_alg=MergeAlg.add,
        dtype="int32",
    )


def rows(quick: bool) -> Iterator[Row]:
    """Yield ratios to GDAL, and how far the fractions lie from the exact ones."""
    study = sample_folder() / SAMPLE_STUDY
    transit = read_transit(f"{study}:transit")
    anchors = read_anchors(f"{study}:anchors", dst_crs=transit.crs)
    polygons, x, y = transit.polygons, anchors.x_m, anchors.y_m
    grid = grid_over(polygons, GSD_M)
    for radius_m in (15.0,) if quick else (15.0, 100.0):
        each = np.full(x.size, radius_m)
        discs = shapely.buffer(shapely.points(x, y), radius_m, quad_segs=16)
        name = f"{x.size} discs of {radius_m:g} m, {grid.width} x {grid.height} pixels"
        ours = partial(_level_raster, x, y, each, polygons, grid)
        ours()
        turns = 1 if quick else 3
        yield side_by_side(
            f"level raster: {name}",
            "GDAL: each disc rasterised in its window and added",
            ours,
            partial(each_disc_alone, discs, radius_m, grid),
            turns,
            at_least=30 if radius_m == 100 else None,
            repeats=3,
        )
        yield side_by_side(
            f"level raster: {name}",
            "GDAL: all discs added in one call",
            ours,
            partial(all_discs_added, discs, grid),
            turns,
            repeats=3,
        )
        yield from _accuracy(x, y, each, polygons, grid)


def _level_raster(
    x: np.ndarray, y: np.ndarray, each: np.ndarray, polygons: shapely.MultiPolygon, grid: RasterGrid
) -> np.ndarray:
    return np.concatenate([block.ravel() for _, block in level_rows(x, y, each, polygons, grid)])


def _accuracy(
    x: np.ndarray, y: np.ndarray, each: np.ndarray, polygons: shapely.MultiPolygon, grid: RasterGrid
) -> Iterator[Row]:
    exact = np.array(level_areas(x, y, each, polygons).areas_m2) / polygons.area
    profile = depth_profile(x, y, each, polygons, GSD_M).fractions
    pixels = _level_raster(x, y, each, polygons, grid)
    counted = np.bincount(pixels, minlength=256)[:4] / np.sum(pixels != 255)
    found = {"depth profile": np.array([*profile[:3], profile[3:].sum()]), "pixels": counted}
    for name, fractions in found.items():
        off = float(np.abs(fractions - exact).max())
        limit = 5e-5 if name == "depth profile" else None
        work = f"{name}, {each[0]:g} m: greatest error of a level's share"
        yield Row(work, "the exact areas", (off,), "of 1", False, limit)


if __name__ == "__main__":
    main(rows, __doc__)

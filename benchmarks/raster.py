"""Level raster against GDAL: 4541 discs of 100 m at 0.5 m, side by side in one run.

python benchmarks/raster.py [--quick]
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import numpy as np
import shapely
from rasterio.features import MergeAlg, rasterize
from rasterio.transform import from_origin

from covertool.coverage import level_areas
from covertool.coverage.raster import RasterGrid, grid_over, level_rows
from covertool.coverage.scanlines import depth_profile
from covertool.gis.read import read_anchors, read_transit
from covertool.gis.sample import SAMPLE_STUDY, sample_folder

GSD_M = 0.5


def seconds(work: Callable[[], object], runs: int = 3) -> float:
    """Return the least time of some runs."""
    times = []
    for _ in range(runs):
        begun = time.perf_counter()
        work()
        times.append(time.perf_counter() - begun)
    return min(times)


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


def main() -> None:
    quick = "--quick" in sys.argv
    study = sample_folder() / SAMPLE_STUDY
    transit = read_transit(f"{study}:transit")
    anchors = read_anchors(f"{study}:anchors", dst_crs=transit.crs)
    polygons, x, y = transit.polygons, anchors.x_m, anchors.y_m
    grid = grid_over(polygons, GSD_M)
    print(f"{len(x)} discs, {grid.width} x {grid.height} pixels of {GSD_M} m")
    for radius_m in (15.0,) if quick else (15.0, 100.0):
        each = np.full(x.size, radius_m)
        discs = shapely.buffer(shapely.points(x, y), radius_m, quad_segs=16)
        list(level_rows(x, y, each, polygons, grid))
        ours = seconds(lambda r=each: list(level_rows(x, y, r, polygons, grid)))
        shares = seconds(lambda r=each: depth_profile(x, y, r, polygons, GSD_M))
        alone = seconds(lambda r=radius_m, d=discs: each_disc_alone(d, r, grid), 1)
        added = seconds(lambda d=discs: all_discs_added(d, grid), 1)
        profile = depth_profile(x, y, each, polygons, GSD_M).fractions
        exact = np.array(level_areas(x, y, each, polygons).areas_m2) / polygons.area
        found = np.array([*profile[:3], profile[3:].sum()])
        pixels = np.concatenate(
            [block.ravel() for _, block in level_rows(x, y, each, polygons, grid)]
        )
        counted = np.bincount(pixels, minlength=256)[:4] / np.sum(pixels != 255)
        print(
            f"{radius_m:5g} m: raster {ours:.3f} s, depth profile {shares:.3f} s; "
            f"GDAL disc by disc {alone:.2f} s ({alone / ours:.0f}x), "
            f"GDAL in one call {added:.2f} s ({added / ours:.0f}x); "
            f"fractions differ from the exact ones by {np.abs(found - exact).max():.1e} (profile), "
            f"{np.abs(counted - exact).max():.1e} (pixels)"
        )


if __name__ == "__main__":
    main()

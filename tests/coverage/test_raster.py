"""Pixels against the exact engine and against GDAL."""

import numpy as np
import pytest
import shapely
from rasterio.features import MergeAlg, rasterize
from rasterio.transform import from_origin
from scipy.stats import poisson

from covertool.coverage import level_areas
from covertool.coverage.raster import OUTSIDE, grid_over, level_rows
from covertool.coverage.scanlines import bucket_sort, depth_profile
from covertool.errors import OptionError


def town(seed, discs=1500, size=1200.0):
    """Return discs along slanted roads that cross, and the roads."""
    rng = np.random.default_rng(seed)
    lines = []
    for i in range(12):
        a, b = rng.uniform(-30, 30, 2) + i * size / 12
        lines += [
            shapely.LineString([(a, 0), (b, size)]),
            shapely.LineString([(0, b), (size, a)]),
        ]
    roads = shapely.union_all(shapely.buffer(lines, 4.0))
    line = rng.integers(0, len(lines), discs)
    along = shapely.line_interpolate_point(
        np.array(lines)[line], rng.random(discs), normalized=True
    )
    xy = shapely.get_coordinates(along) + rng.normal(0, 5, (discs, 2))
    return xy[:, 0], xy[:, 1], shapely.MultiPolygon(shapely.get_parts(roads).tolist())


def stacked(x, y, radius, polygons, gsd):
    grid = grid_over(polygons, gsd)
    blocks = list(level_rows(x, y, radius, polygons, grid))
    assert [first for first, _ in blocks] == np.cumsum(
        [0, *(len(b) for _, b in blocks[:-1])]
    ).tolist()
    return grid, np.vstack([block for _, block in blocks])


def test_the_levels_are_those_that_gdal_counts_but_on_the_rims():
    x, y, roads = town(1)
    radius = np.full(x.size, 15.0)
    grid, levels = stacked(x, y, radius, roads, 0.5)
    transform = from_origin(grid.left_m, grid.top_m, 0.5, 0.5)
    shape = (grid.height, grid.width)
    discs = shapely.buffer(shapely.points(x, y), 15.0, quad_segs=64)
    counts = rasterize(
        [(disc, 1) for disc in discs], shape, transform=transform, merge_alg=MergeAlg.add,
        dtype="int32",
    )  # fmt: skip
    inside = rasterize([roads], shape, transform=transform, dtype="uint8") == 1
    assert np.mean(inside != (levels != OUTSIDE)) < 1e-5
    both = inside & (levels != OUTSIDE)
    assert np.mean(np.minimum(counts, 3)[both] != levels[both]) < 1e-3


@pytest.mark.parametrize(("seed", "radius_m"), [(2, 15.0), (3, 15.0), (4, 100.0)])
def test_fractions_at_half_a_metre_agree_with_the_exact_ones(seed, radius_m):
    x, y, roads = town(seed)
    radius = np.full(x.size, radius_m)
    exact = np.array(level_areas(x, y, radius, roads).areas_m2) / roads.area
    fractions, error = depth_profile(x, y, radius, roads, 0.5).levels()
    assert fractions == pytest.approx(exact, abs=5e-5)
    assert np.all(error < 2e-4)


def test_a_transit_edge_along_a_row_does_not_shift_the_fractions():
    # The upper edge lies at 0.07 m into a row: without exact row areas the share would be off.
    road = shapely.MultiPolygon([shapely.box(0, 0, 1000, 2.07)])
    profile = depth_profile(np.array([500.0]), np.array([1.0]), np.array([100.0]), road, 0.5)
    exact = level_areas([500.0], [1.0], 100.0, road).areas_m2[1] / road.area
    assert profile.fractions[1] == pytest.approx(exact, abs=1e-6)


def test_the_profile_counts_depths_without_a_cap():
    square = shapely.MultiPolygon([shapely.box(0, 0, 10, 10)])
    five = np.full(7, 5.0)
    profile = depth_profile(five, five, np.full(7, 100.0), square)
    assert profile.fractions == pytest.approx([0] * 7 + [1])


def test_a_field_at_random_has_the_tails_of_the_poisson_law():
    # P(depth >= k); places a diameter apart are independent, which bounds the chance deviation.
    random = np.random.default_rng(21)
    side, radius, density = 1200.0, 15.0, 0.003
    wide = side + 2 * radius
    x, y = random.uniform(-radius, side + radius, (2, random.poisson(density * wide**2)))
    square = shapely.MultiPolygon([shapely.box(0, 0, side, side)])
    found = depth_profile(x, y, np.full(x.size, radius), square).fractions
    tails = np.cumsum(found[::-1])[::-1]
    expected = poisson.sf(np.arange(tails.size) - 1, density * np.pi * radius**2)
    spread = np.sqrt(expected * (1 - expected) * (2 * radius / side) ** 2)
    assert np.all(np.abs(tails - expected) <= 4 * spread + 1e-4)


def test_pixels_lie_on_multiples_of_their_size():
    grid = grid_over(shapely.MultiPolygon([shapely.box(10.3, 20.2, 15.1, 22.9)]), 2.0)
    assert (grid.left_m, grid.top_m, grid.width, grid.height) == (10.0, 24.0, 3, 2)


@pytest.mark.parametrize("gsd", [0.0, -1.0, np.nan, 1e-5])
def test_a_pixel_size_that_cannot_be_is_refused(gsd):
    with pytest.raises(OptionError):
        grid_over(shapely.MultiPolygon([shapely.box(0, 0, 1000, 1000)]), gsd)


@pytest.mark.parametrize("values", [[], [3.0], [2.0, 1.0, 2.0], [1.0] * 5, [0.0, 1e9, 1.0, 2.0]])
def test_bucket_sort_sorts(values):
    array = np.array(values)
    bucket_sort(array, np.empty(array.size), np.empty(array.size + 2, dtype=np.int64))
    assert array.tolist() == sorted(values)

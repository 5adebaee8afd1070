"""A mask's transit pixels as outlines in pixel coordinates, read window by window."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from covertool.errors import GeometryError
from covertool.model import Objects, RasterSource

_BLOCK_PX = 2048
_MOST_BETWEEN = 0.05
"""A mask with a larger share of values between its ends is a picture or a map of classes."""


def mask_outlines(raster: RasterSource) -> Objects:
    """Return the transit pixels as disjoint polygons with holes, in pixel coordinates.

    Masks of 0 and 1, 0 and 255, or white on black in colour are read alike: a pixel is transit
    when its brightest band is above half of the greatest value in the mask.

    Raises
    ------
    GeometryError
        When no pixel is transit, or the raster is no mask.
    """
    import rasterio.features
    from rasterio.transform import Affine

    half = _half(raster)
    found: list[shapely.Geometry] = []
    for x, y, width, height in _blocks(raster):
        on = _brightest(raster, x, y, width, height) > half
        shapes = rasterio.features.shapes(
            on.astype(np.uint8), mask=on, connectivity=4, transform=Affine.translation(x, y)
        )
        found += [shapely.Polygon(g["coordinates"][0], g["coordinates"][1:]) for g, _ in shapes]
    united = shapely.union_all(np.array(found, dtype=object))
    parts: Objects = np.array(
        [part for part in shapely.get_parts(united) if part.geom_type == "Polygon"], dtype=object
    )
    return parts


def _half(raster: RasterSource) -> float:
    """Return half of the mask's greatest value, after a look at what values it holds."""
    greatest = max(float(_brightest(raster, *block).max()) for block in _blocks(raster))
    if greatest <= 0:
        raise GeometryError(
            "the mask holds no transit pixel", raster.name, "draw the carriageway in white on black"
        )
    between = total = 0
    for block in _blocks(raster):
        top = _brightest(raster, *block)
        between += int(((top > 0.1 * greatest) & (top < 0.9 * greatest)).sum())
        total += top.size
    if between > _MOST_BETWEEN * total:
        raise GeometryError(
            f"{between / total:.0%} of the mask's pixels are neither black nor white",
            raster.name,
            "give a mask of two values: 0, and 1 or 255 for the carriageway",
        )
    return greatest / 2


def _blocks(raster: RasterSource) -> list[tuple[int, int, int, int]]:
    """Return x, y, width and height of the windows in which a mask is read."""
    return [
        (x, y, min(_BLOCK_PX, raster.width - x), min(_BLOCK_PX, raster.height - y))
        for y in range(0, raster.height, _BLOCK_PX)
        for x in range(0, raster.width, _BLOCK_PX)
    ]


def _brightest(
    raster: RasterSource, x: int, y: int, width: int, height: int
) -> npt.NDArray[np.float32]:
    """Return the greatest of the first three bands; missing pixels are 0."""
    values: npt.NDArray[Any] = raster.read(x, y, width, height)[:3]
    top: npt.NDArray[np.float32] = values.max(axis=0).astype(np.float32)
    np.nan_to_num(top, copy=False, posinf=0.0)
    top[~raster.valid(x, y, width, height)] = 0
    return top

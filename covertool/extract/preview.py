"""A picture of what was found: oriented rectangles over the image."""

from __future__ import annotations

import math

import numpy as np
import shapely

from covertool.extract.detectors.protocol import MIN_HALO_PX, Pixels
from covertool.extract.stretch import Stretch
from covertool.extract.windows import WorkingGrid, cut
from covertool.model import Objects, RasterSource, TransitArea, Vehicles

_LONGEST_PX = 4000
_PARKED, _DRIVING, _UNKNOWN, _EDGE = (255, 160, 0), (0, 200, 255), (255, 0, 255), (90, 255, 90)


def preview(raster: RasterSource, vehicles: Vehicles, transit: TransitArea | None = None) -> Pixels:
    """Return (H, W, 3) colours: parked cars orange, driving ones blue, others magenta.

    The picture has the image's own resolution, or less so that its longer side has at most 4000
    pixels; the edge of the transit area is green.

    Parameters
    ----------
    raster : the image
    vehicles : of this image, in the CRS of the raster
    transit : drawn when given, in the CRS of the raster
    """
    grid = _grid(raster)
    picture = _picture(raster, grid)
    if transit is not None:
        rings = shapely.get_parts(shapely.get_rings(list(transit.polygons.geoms)))
        _draw(picture, raster, grid, rings, _EDGE)
    footprints = vehicles.footprints()
    for flag, colour in ((True, _PARKED), (False, _DRIVING), (None, _UNKNOWN)):
        chosen = np.array([parked is flag for parked in vehicles.parked], dtype=bool)
        _draw(picture, raster, grid, shapely.get_exterior_ring(footprints[chosen]), colour)
    return picture


def _picture(raster: RasterSource, grid: WorkingGrid) -> Pixels:
    """Return the image on the grid, put together window by window."""
    stretch = Stretch.of(raster)
    picture = np.zeros((grid.height, grid.width, 3), dtype=np.uint8)
    for window in grid.windows(MIN_HALO_PX):
        rgb, _ = cut(raster, grid, window, stretch)
        left, top = window.x0 - window.outer[0], window.y0 - window.outer[1]
        wide, high = window.x1 - window.x0, window.y1 - window.y0
        picture[window.y0 : window.y1, window.x0 : window.x1] = rgb[
            top : top + high, left : left + wide
        ]
    return picture


def _grid(raster: RasterSource) -> WorkingGrid:
    """Return a grid of square pixels for the whole image, no finer than the image itself."""
    along, down = raster.gsd_m(raster.width / 2, raster.height / 2)
    longest_m = max(raster.width * along, raster.height * down)
    return WorkingGrid.of(raster, max(along, down, longest_m / _LONGEST_PX))


def _draw(
    picture: Pixels,
    raster: RasterSource,
    grid: WorkingGrid,
    rings: Objects,
    colour: tuple[int, int, int],
) -> None:
    """Draw outlines on the picture, smoothed to a sixteenth of a pixel."""
    import cv2

    fraction = 4
    width_px = max(1, math.ceil(max(picture.shape[:2]) / 2500))
    for ring in rings:
        corners = shapely.get_coordinates(ring)
        x, y = raster.to_pixels(corners[:, 0], corners[:, 1])
        drawn = np.column_stack([x * grid.scale_x - 0.5, y * grid.scale_y - 0.5])
        points = np.rint(drawn * 2**fraction).astype(np.int32)[None]
        cv2.polylines(picture, points, True, colour, width_px, cv2.LINE_AA, fraction)

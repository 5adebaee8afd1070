"""An image cut into overlapping windows of the detector's GSD; each detection has one owner.

All windows lie on one working grid of square ground pixels, so a place looks the same in
whichever window it is seen, and memory is bounded by the window. A window is a core with a halo
around it: the detector sees both, and keeps only what has its centre in the core. Where the halo
is as wide as what the detector looks at, a window finds exactly what the whole image would.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from covertool.extract.detectors.protocol import (
    MIN_HALO_PX,
    Detections,
    Detector,
    Mask,
    Pixels,
)
from covertool.extract.stretch import Stretch
from covertool.model import Floats, RasterSource

CORE_PX = 1536
"""With a halo of 128 pixels a window costs 36 % more than its core alone, and half a gigabyte."""

SOURCE_PX = 4096
"""A core takes at most this many image pixels along either axis: finer images, smaller cores."""

RIM_PX = 32
"""How far a window reaches beyond the image's edge: a car's length, mirrored, and no more."""

ALIGN_PX = 16
"""Cores and halos are multiples of it, so that a detector's own cells lie alike in all windows."""


@dataclass(frozen=True)
class Window:
    """A core (x0 <= x < x1, y0 <= y < y1) in pixels of the working grid.

    Attributes
    ----------
    x0, y0, x1, y1 : the core
    outer : x0, y0, x1, y1 of the core with its halo
    """

    x0: int
    y0: int
    x1: int
    y1: int
    outer: tuple[int, int, int, int]

    def owns(self, x: Floats, y: Floats) -> Mask:
        """Return True for the places that lie in the core."""
        inside: Mask = (x >= self.x0) & (x < self.x1) & (y >= self.y0) & (y < self.y1)
        return inside


@dataclass(frozen=True)
class WorkingGrid:
    """The image resampled to square ground pixels, never held as a whole.

    Attributes
    ----------
    gsd_m : ground size of a working pixel
    scale_x, scale_y : working pixels for each image pixel along the image's axes
    width, height : of the working image in working pixels
    """

    gsd_m: float
    scale_x: float
    scale_y: float
    width: int
    height: int

    @classmethod
    def of(cls, raster: RasterSource, gsd_m: float) -> WorkingGrid:
        """Return the working grid of an image; its scale is that in the middle of the image."""
        ground_x, ground_y = raster.gsd_m(raster.width / 2, raster.height / 2)
        scale_x, scale_y = ground_x / gsd_m, ground_y / gsd_m
        width, height = math.ceil(raster.width * scale_x), math.ceil(raster.height * scale_y)
        return cls(gsd_m, scale_x, scale_y, max(width, 1), max(height, 1))

    def windows(self, halo_px: int, core_px: int = CORE_PX) -> list[Window]:
        """Return the windows whose cores tile the working image, row by row.

        The halo is widened, and the core narrowed, to a multiple of ``ALIGN_PX``.
        """
        halo = -(-max(halo_px, MIN_HALO_PX) // ALIGN_PX) * ALIGN_PX
        widest = min(core_px, int(SOURCE_PX * min(self.scale_x, self.scale_y)))
        core = max(widest // ALIGN_PX, 1) * ALIGN_PX
        return [
            Window(x0, y0, x1, y1, (outer_x0, outer_y0, outer_x1, outer_y1))
            for y0, y1, outer_y0, outer_y1 in _spans(self.height, core, halo)
            for x0, x1, outer_x0, outer_x1 in _spans(self.width, core, halo)
        ]

    def to_image(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Return working pixel coordinates as image pixel coordinates."""
        return x / self.scale_x, y / self.scale_y


def _spans(extent: int, core: int, halo: int) -> list[tuple[int, int, int, int]]:
    """Return start and end of the cores along one axis, and of each core with its halo."""
    return [
        (
            start,
            min(start + core, extent),
            max(start - halo, -RIM_PX),
            min(start + core + halo, extent + RIM_PX),
        )
        for start in range(0, extent, core)
    ]


def cut(
    raster: RasterSource, grid: WorkingGrid, window: Window, stretch: Stretch
) -> tuple[Pixels, Mask]:
    """Return the colours and the validity of a window with its halo, on the working grid.

    Finer images are averaged as an area mean would do it (a Gaussian of the same variance,
    ``(f^2 - 1) / 12`` for f image pixels a working pixel), coarser ones interpolated linearly.
    Beyond the image's edge the picture is mirrored and not valid.

    Parameters
    ----------
    raster : the image
    grid : its working grid
    window : of the grid
    stretch : from the image's values to colours

    Returns
    -------
    rgb : (H, W, 3) uint8 colours
    valid : (H, W) True where the image holds data
    """
    x0, y0, x1, y1 = window.outer
    blur_x, blur_y = _blur_px(grid.scale_x), _blur_px(grid.scale_y)
    left, right = _span(x0, x1, grid.scale_x, blur_x, raster.width)
    top, bottom = _span(y0, y1, grid.scale_y, blur_y, raster.height)
    known = raster.valid(left, top, right - left, bottom - top)
    if not known.any():
        return np.zeros((y1 - y0, x1 - x0, 3), np.uint8), np.zeros((y1 - y0, x1 - x0), np.bool_)
    values = raster.read(left, top, right - left, bottom - top)
    rgb = stretch.apply(values, known)
    return _resample(rgb, known, (x0, y0, x1, y1), (left, top), grid)


def detect_in_window(
    raster: RasterSource,
    detector: Detector,
    grid: WorkingGrid,
    stretch: Stretch,
    window: Window,
    threshold: float,
) -> Detections:
    """Return the detections that a window owns, in pixels of the working grid.

    Parameters
    ----------
    raster, grid, stretch, window : as in `cut`
    detector : looks at the window with its halo
    threshold : least score, 0 to 1
    """
    rgb, valid = cut(raster, grid, window, stretch)
    if not valid.any():
        return Detections.empty()
    found = detector.detect(rgb, valid)
    x0, y0, _, _ = window.outer
    x, y = found.x_px + x0, found.y_px + y0
    placed = replace(found, x_px=x, y_px=y)
    on_data = _at(valid, found.x_px, found.y_px)
    return placed.take(window.owns(x, y) & on_data & (found.score >= threshold))


def _blur_px(scale: float) -> float:
    """Return the standard deviation in image pixels that makes linear sampling an area mean."""
    return math.sqrt(max(1 / scale**2 - 1, 0.0) / 12)


def _span(start: int, stop: int, scale: float, blur_px: float, size: int) -> tuple[int, int]:
    """Return the image pixels that a stretch of working pixels needs, within the image."""
    rim = math.ceil(4 * blur_px) + 2
    first = min(max(math.floor(start / scale) - rim, 0), size - 1)
    last = min(max(math.ceil(stop / scale) + rim, first + 1), size)
    return first, last


def _resample(
    rgb: Pixels,
    known: Mask,
    outer: tuple[int, int, int, int],
    corner: tuple[int, int],
    grid: WorkingGrid,
) -> tuple[Pixels, Mask]:
    """Return a part of the image on the working grid, and where it holds data."""
    import cv2

    x0, y0, x1, y1 = outer
    blur_x, blur_y = _blur_px(grid.scale_x), _blur_px(grid.scale_y)
    if max(blur_x, blur_y) > 0.05:
        blurred = cv2.GaussianBlur(
            rgb,
            (_odd(blur_x), _odd(blur_y)),
            sigmaX=max(blur_x, 1e-3),
            sigmaY=max(blur_y, 1e-3),
            borderType=cv2.BORDER_REFLECT_101,
        )
        rgb = np.asarray(blurred, dtype=np.uint8)
    # Centres of working pixels in the window, as centres of pixels of the part that was read.
    inverse = np.array(
        [
            [1 / grid.scale_x, 0, (x0 + 0.5) / grid.scale_x - corner[0] - 0.5],
            [0, 1 / grid.scale_y, (y0 + 0.5) / grid.scale_y - corner[1] - 0.5],
        ]
    )
    size = (x1 - x0, y1 - y0)
    flags = cv2.WARP_INVERSE_MAP
    colours = cv2.warpAffine(
        rgb, inverse, size, flags=flags | cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT_101
    )
    valid = cv2.warpAffine(
        known.astype(np.uint8), inverse, size, flags=flags | cv2.INTER_NEAREST, borderValue=0
    )
    return np.asarray(colours, dtype=np.uint8), np.asarray(valid, dtype=np.bool_)


def _odd(sigma_px: float) -> int:
    return 2 * math.ceil(4 * sigma_px) + 1


def _at(valid: Mask, x_px: Floats, y_px: Floats) -> Mask:
    """Return whether each place lies on a valid pixel."""
    height, width = valid.shape
    column = np.clip(np.floor(x_px).astype(int), 0, width - 1)
    row = np.clip(np.floor(y_px).astype(int), 0, height - 1)
    here: Mask = valid[row, column]
    return here

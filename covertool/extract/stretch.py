"""Any raster's values as 8-bit colours: one stretch for the whole image, so that tiles agree."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from covertool.extract.detectors.protocol import Mask, Pixels
from covertool.model import RasterSource

_BLOCK_PX = 256
_BLOCKS_ALONG = 8
_STEP_PX = 2
"""Of a block every second pixel of every second row: a million values settle a percentile."""

_TAILS_PERCENT = (0.5, 99.5)
_DULL_SPAN = 96
"""8-bit pictures whose middle 99 % span fewer grey levels than this are stretched too."""


@dataclass(frozen=True)
class Stretch:
    """A linear map from raster values to 0-255, one for each of three colours.

    ``colour = clip(255 (value - low) / (high - low))``

    Attributes
    ----------
    bands : the raster's bands that become red, green and blue (counted from 0)
    low, high : the values that become 0 and 255
    fill : the colour that stands in for missing pixels: the image's mean
    """

    bands: tuple[int, int, int]
    low: tuple[float, float, float]
    high: tuple[float, float, float]
    fill: tuple[int, int, int]

    @classmethod
    def of(cls, raster: RasterSource) -> Stretch:
        """Return the stretch of an image, from an even sample of blocks all over it.

        8-bit pictures of fair contrast keep their values; others are stretched between the 0.5
        and 99.5 percentiles of each band.
        """
        bands = (0, 1, 2) if raster.bands >= 3 else (0, 0, 0)
        sample = _sample(raster)
        if sample.shape[1] == 0:
            return cls(bands, (0.0,) * 3, (255.0,) * 3, (0, 0, 0))
        colours = sample[list(bands)].astype(np.float64)
        ends = np.percentile(colours, _TAILS_PERCENT, axis=1)
        if sample.dtype == np.uint8 and (ends[1] - ends[0]).max() >= _DULL_SPAN:
            ends = np.array([[0.0] * 3, [255.0] * 3])
        ends[1] = np.maximum(ends[1], ends[0] + 1e-9)
        mean = np.clip(255 * (colours.mean(axis=1) - ends[0]) / (ends[1] - ends[0]), 0, 255)
        return cls(bands, _three(ends[0]), _three(ends[1]), _levels(mean))

    def apply(self, values: npt.NDArray[Any], valid: Mask) -> Pixels:
        """Return (H, W, 3) colours of (bands, H, W) values; missing pixels get the fill colour."""
        rgb = np.empty((*values.shape[1:], 3), dtype=np.uint8)
        for i, band in enumerate(self.bands):
            low, high = self.low[i], self.high[i]
            if values.dtype == np.uint8 and (low, high) == (0.0, 255.0):
                rgb[..., i] = values[band]
                continue
            scaled = (values[band].astype(np.float32) - np.float32(low)) * (255 / (high - low))
            np.nan_to_num(scaled, copy=False)
            rgb[..., i] = np.clip(np.rint(scaled), 0, 255)
        if not valid.all():
            rgb[~valid] = self.fill
        return rgb


def _sample(raster: RasterSource) -> npt.NDArray[Any]:
    """Return (bands, N) valid values of up to 8 x 8 blocks spread evenly over the image."""
    lefts = _starts(raster.width)
    tops = _starts(raster.height)
    parts = []
    for top in tops:
        for left in lefts:
            width, height = min(_BLOCK_PX, raster.width), min(_BLOCK_PX, raster.height)
            values = raster.read(left, top, width, height)
            valid = raster.valid(left, top, width, height) & np.isfinite(values).all(axis=0)
            thin = values[:, ::_STEP_PX, ::_STEP_PX]
            parts.append(thin[:, valid[::_STEP_PX, ::_STEP_PX]])
    return np.concatenate(parts, axis=1)


def _starts(size: int) -> list[int]:
    count = min(_BLOCKS_ALONG, -(-size // _BLOCK_PX))
    return [int(start) for start in np.linspace(0, max(size - _BLOCK_PX, 0), count)]


def _three(values: npt.NDArray[np.float64]) -> tuple[float, float, float]:
    first, second, third = (float(v) for v in values)
    return (first, second, third)


def _levels(values: npt.NDArray[np.float64]) -> tuple[int, int, int]:
    first, second, third = (round(float(v)) for v in values)
    return (first, second, third)

"""The shipped detector: a small convolutional network that finds centres, sizes and angles.

The network sees the picture at 0.20 m a pixel and gives eight maps at a quarter of its size: the
logits that a car, or a truck or bus, has its centre in a cell; the offset from the cell's centre in
cells; the logarithm of length and width over those of a usual car; and the cosine and sine of twice
the heading, which are the same for both directions of the axis. It was trained on rendered pictures
alone; ``training/MODEL_CARD.md`` tells how, and what it gets wrong.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from importlib import resources
from typing import Any

import numpy as np
import numpy.typing as npt

from covertool.extract.detectors.nms import without_doubles
from covertool.extract.detectors.protocol import Detections, Mask, Pixels
from covertool.extract.detectors.runtime import Network, load_network

Maps = npt.NDArray[np.float32]

WEIGHTS, CARD = "cars.onnx", "cars.json"
STRIDE = 4
_MULTIPLE = 16
_FIELD_PX = 128
"""A cell looks at 127 pixels to either side, the convolutions of all four levels together."""

_MAX_LOG_SIZE = 2.5
_HEAT, _OFFSET, _SIZE, _ANGLE = slice(0, 2), slice(2, 4), slice(4, 6), slice(6, 8)


@dataclass(frozen=True)
class NetworkDetector:
    """A detector that runs network weights.

    Parameters
    ----------
    weights : an ONNX file as bytes
    name : what is written of it in logs and provenance
    gsd_m : ground size of the pixels that the network was trained for
    threshold, tta_threshold : default score thresholds, without and with test-time augmentation
    mean, scale : the network sees ``(value - mean) * scale``
    length_px, width_px : the size that a log size of zero stands for
    tta : average the maps of four views of the picture
    floor : scores below it are not even looked at

    Examples
    --------
    >>> import numpy as np
    >>> grey = np.full((96, 96, 3), 128, dtype=np.uint8)
    >>> len(NetworkDetector.shipped().detect(grey, np.ones((96, 96), dtype=bool)))
    0
    """

    weights: bytes
    name: str
    gsd_m: float
    plain_threshold: float
    tta_threshold: float
    mean: float
    scale: float
    length_px: float
    width_px: float
    tta: bool = False
    floor: float = 0.1

    @classmethod
    def shipped(cls, *, tta: bool = False) -> NetworkDetector:
        """Return the network that comes with the package."""
        folder = resources.files(__package__)
        card = json.loads((folder / CARD).read_text(encoding="utf-8"))
        return cls(
            weights=(folder / WEIGHTS).read_bytes(),
            name=card["name"],
            gsd_m=card["gsd_m"],
            plain_threshold=card["threshold"],
            tta_threshold=card["tta_threshold"],
            mean=card["mean"],
            scale=card["scale"],
            length_px=card["length_px"],
            width_px=card["width_px"],
            tta=tta,
        )

    @property
    def threshold(self) -> float:
        """Return the default score threshold, chosen on rendered pictures."""
        return self.tta_threshold if self.tta else self.plain_threshold

    @property
    def halo_px(self) -> int:
        """Return the width of the rim that a window's edge may alter: the receptive field's."""
        return _FIELD_PX

    def __getstate__(self) -> dict[str, Any]:
        """Leave the loaded network behind: a worker loads its own."""
        return {key: value for key, value in self.__dict__.items() if key != "_net"}

    @cached_property
    def _net(self) -> Network:
        return load_network(self.weights)

    def detect(self, rgb: Pixels, valid: Mask) -> Detections:
        """Return the vehicles of a picture at the detector's GSD, best first."""
        maps = self._averaged_maps(rgb) if self.tta else self._maps(rgb)
        found = self._decode(maps)
        height, width = valid.shape
        inside = (found.x_px < width) & (found.y_px < height)
        found = found.take(inside)
        seen = valid[found.y_px.astype(int), found.x_px.astype(int)]
        return without_doubles(found.take(seen), self.gsd_m)

    def _maps(self, rgb: Pixels) -> Maps:
        """Return the (8, H/4, W/4) maps of a picture, logits turned into scores."""
        import cv2

        padded = _padded(rgb)
        blob = cv2.dnn.blobFromImage(padded, self.scale, mean=(self.mean,) * 3)
        maps: Maps = np.array(self._net(np.asarray(blob, dtype=np.float32))[0])
        maps[_HEAT] = 1 / (1 + np.exp(-maps[_HEAT]))
        return maps

    def _averaged_maps(self, rgb: Pixels) -> Maps:
        """Return the mean of the maps of four views, each turned back to the picture's own.

        The views (as it is, turned by 180 degrees, and mirrored at either diagonal) are a group:
        turning or mirroring the picture so turns or mirrors the mean, exactly.
        """
        whole = _padded(rgb)
        diagonal = np.ascontiguousarray(whole.transpose(1, 0, 2))
        upright = self._maps(whole) + _half_turned(self._maps(_half_turn(whole)))
        mirrored = self._maps(diagonal) + _half_turned(self._maps(_half_turn(diagonal)))
        mean: Maps = (upright + _transposed(mirrored)) * np.float32(0.25)
        return mean

    def _decode(self, maps: Maps) -> Detections:
        """Return one detection for each cell that is the highest of its 3 x 3 neighbours."""
        import cv2

        heat = maps[_HEAT]
        highest = np.stack([cv2.dilate(plane, np.ones((3, 3), np.uint8)) for plane in heat])
        kind, row, column = np.nonzero((heat >= highest) & (heat >= self.floor))
        picked = maps[:, row, column].astype(np.float64)
        size = np.exp(np.clip(picked[_SIZE], -_MAX_LOG_SIZE, _MAX_LOG_SIZE))
        cosine, sine = picked[_ANGLE]
        x = np.maximum((column + 0.5 + picked[_OFFSET][0]) * STRIDE, 0.0)
        y = np.maximum((row + 0.5 + picked[_OFFSET][1]) * STRIDE, 0.0)
        return Detections.of_cars(
            x,
            y,
            np.degrees(np.arctan2(sine, cosine)) / 2,
            size[0] * self.length_px,
            size[1] * self.width_px,
            heat[kind, row, column],
            np.array(["car", "truck"], dtype=object)[kind],
        )


def _padded(rgb: Pixels) -> Pixels:
    """Return the picture with its last pixels repeated up to a multiple of the coarsest cell."""
    height, width = rgb.shape[:2]
    if height % _MULTIPLE == width % _MULTIPLE == 0:
        return rgb
    return np.pad(rgb, ((0, -height % _MULTIPLE), (0, -width % _MULTIPLE), (0, 0)), mode="edge")


def _half_turn(rgb: Pixels) -> Pixels:
    return np.ascontiguousarray(rgb[::-1, ::-1])


def _half_turned(maps: Maps) -> Maps:
    """Return the maps that a picture turned by 180 degrees would give: the offsets change sign."""
    turned: Maps = maps[:, ::-1, ::-1] * _factors([1, 1, -1, -1, 1, 1, 1, 1])
    return turned


def _transposed(maps: Maps) -> Maps:
    """Return the maps that a transposed picture would give.

    The offsets change places; a heading h becomes -90 - h, so the cosine of 2 h changes its sign.
    """
    swapped = maps.transpose(0, 2, 1)[[0, 1, 3, 2, 4, 5, 6, 7]]
    mirrored: Maps = swapped * _factors([1, 1, 1, 1, 1, 1, -1, 1])
    return mirrored


def _factors(of_maps: list[int]) -> Maps:
    return np.array(of_maps, dtype=np.float32)[:, None, None]

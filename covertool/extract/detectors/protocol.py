"""What a detector is: a function from a picture of known ground size to oriented rectangles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np
import numpy.typing as npt

from covertool.model import Floats, Objects
from covertool.model.tables import Table

Pixels = npt.NDArray[np.uint8]
Mask = npt.NDArray[np.bool_]

CAR = "car"
"""The kind of detections that are counted; a van is a car, a truck or a bus is none."""

MIN_HALO_PX = 64
"""A car of 5 m at 0.20 m is 25 px long: 64 px show it and its surroundings whole."""


@dataclass(frozen=True)
class Detections(Table):
    """Vehicles found in one picture, in pixels of that picture.

    Attributes
    ----------
    x_px, y_px : (N,) centre; x right, y down, the corner of the first pixel is (0, 0)
    heading_deg : (N,) direction of the long axis, clockwise from the picture's up, 0 <= h < 180
    length_px, width_px : (N,) size along and across the heading
    score : (N,) confidence, 0 to 1
    kind : (N,) object array of str: ``car``, ``truck`` or ``bus``
    """

    x_px: Floats
    y_px: Floats
    heading_deg: Floats
    length_px: Floats
    width_px: Floats
    score: Floats
    kind: Objects

    @classmethod
    def of_cars(
        cls,
        x_px: npt.ArrayLike,
        y_px: npt.ArrayLike,
        heading_deg: npt.ArrayLike,
        length_px: npt.ArrayLike,
        width_px: npt.ArrayLike,
        score: npt.ArrayLike,
        kind: npt.ArrayLike | None = None,
    ) -> Self:
        """Return detections from anything array-like; the kind is ``car`` unless it is given.

        >>> Detections.of_cars([10.0], [20.0], [190.0], [22.0], [9.0], [0.8]).heading_deg
        array([10.])
        """
        x, y, heading, length, width, confidence = (
            np.asarray(values, dtype=np.float64).ravel()
            for values in (x_px, y_px, heading_deg, length_px, width_px, score)
        )
        kinds = np.full(x.size, CAR, dtype=object)
        if kind is not None:
            kinds[:] = np.asarray(kind, dtype=object).ravel()
        return cls(x, y, np.mod(heading, 180.0), length, width, confidence, kinds)

    @classmethod
    def concatenate(cls, parts: Sequence[Self]) -> Self:
        """Return the rows of several detections, in order, as one.

        >>> len(Detections.concatenate([Detections.empty(), Detections.empty()]))
        0
        """
        return cls(**cls.joined([cls.empty(), *parts]))

    @classmethod
    def empty(cls) -> Self:
        """Return no detections.

        >>> len(Detections.empty())
        0
        """
        return cls.of_cars([], [], [], [], [], [])


class Detector(Protocol):
    """Finds vehicles in a picture that was resampled to the detector's own GSD; picklable.

    The picture is isotropic in true ground metres: each pixel is ``gsd_m`` by ``gsd_m``.

    Attributes
    ----------
    name : what is written of it in logs and provenance
    gsd_m : ground size in metres of the pixels that `detect` wants
    halo_px : pixels around a place that its detections depend on; at least ``MIN_HALO_PX``
    threshold : the score from which on a detection counts, unless the user names another
    """

    @property
    def name(self) -> str:
        """Return the detector's name."""
        ...

    @property
    def gsd_m(self) -> float:
        """Return the ground size of a pixel in metres."""
        ...

    @property
    def halo_px(self) -> int:
        """Return the width of the rim in pixels whose detections are not to be trusted."""
        ...

    @property
    def threshold(self) -> float:
        """Return the default score threshold."""
        ...

    def detect(self, rgb: Pixels, valid: Mask) -> Detections:
        """Return the vehicles of a picture, with all scores above a low floor.

        Parameters
        ----------
        rgb : (H, W, 3) uint8, already stretched to 0-255; grey pictures have three equal bands
        valid : (H, W) bool, False where the picture holds no data (there `rgb` is its mirror image
            or its mean colour, so that no dark edge is seen)
        """
        ...

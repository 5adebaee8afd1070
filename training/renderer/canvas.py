"""The canvas: metres in, pixels out, blended polygons, shadows and occlusion."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
import numpy.typing as npt

Image = npt.NDArray[np.float32]
Points = npt.NDArray[np.float64]
Colour = npt.NDArray[np.floating] | tuple[float, float, float]

_SHIFT = 4


@dataclass(frozen=True)
class Sun:
    """Where the light comes from and how hard its shadows are.

    Attributes
    ----------
    offset : (2,) metres that the shadow of a point 1 m above the ground lies from its foot
    strength : 0 (overcast) to 1 (black shadows)
    lean : (2,) metres that a point 1 m above the ground is displaced in the picture, because the
        camera does not look straight down
    """

    offset: Points
    strength: float
    lean: Points


@dataclass(frozen=True)
class Pose:
    """A place and a heading (clockwise from the image's up) that carries a local frame.

    Local coordinates are (ahead, right) in metres.
    """

    x_m: float
    y_m: float
    heading_deg: float

    def place(self, local: npt.ArrayLike) -> Points:
        """Return (N, 2) local points as image points in metres, x to the right and y down.

        >>> Pose(5.0, 5.0, 0.0).place([[2.0, 1.0]]).tolist()
        [[6.0, 3.0]]
        """
        points = np.asarray(local, dtype=float).reshape(-1, 2)
        angle = np.radians(self.heading_deg)
        ahead = np.array([np.sin(angle), -np.cos(angle)])
        right = np.array([np.cos(angle), np.sin(angle)])
        return np.array([self.x_m, self.y_m]) + points[:, :1] * ahead + points[:, 1:] * right

    def moved(self, ahead_m: float, right_m: float, turn_deg: float = 0.0) -> Pose:
        """Return the pose that lies so far ahead and to the right, turned by so much."""
        x, y = self.place([[ahead_m, right_m]])[0]
        return Pose(float(x), float(y), self.heading_deg + turn_deg)


def box(u0: float, u1: float, v0: float, v1: float) -> Points:
    """Return the corners of a rectangle in local coordinates."""
    return np.array([[u0, v0], [u1, v0], [u1, v1], [u0, v1]], dtype=float)


def rounded(length: float, width: float, front: float, rear: float, power: float = 3.0) -> Points:
    """Return a rounded rectangle whose two ends are drawn in by superellipses of given depth."""
    t = np.linspace(-np.pi / 2, np.pi / 2, 9)
    across = np.sign(np.sin(t)) * np.abs(np.sin(t)) ** (2 / power) * width / 2
    bulge = np.abs(np.cos(t)) ** (2 / power)
    head = np.stack([length / 2 - front + front * bulge, across], axis=1)
    tail = np.stack([-length / 2 + rear - rear * bulge, across], axis=1)[::-1]
    return np.concatenate([head, tail])


def shifted(points: Points, ahead_m: float, right_m: float) -> Points:
    """Return local points moved ahead and to the right."""
    return points + np.array([ahead_m, right_m])


class Canvas:
    """A picture in metres: an RGB image, what hides the ground, and what shades it, as bytes.

    Parameters
    ----------
    size_m : side of the square picture in metres
    px_per_m : pixels a metre

    Attributes
    ----------
    image : (S, S, 3) uint8 RGB
    cover, shade : (S, S) uint8; 255 = hidden from above, or in full shadow
    """

    def __init__(self, size_m: float, px_per_m: float) -> None:
        self.size_m = size_m
        self.px_per_m = px_per_m
        side = round(size_m * px_per_m)
        self.image = np.zeros((side, side, 3), np.uint8)
        self.cover = np.zeros((side, side), np.uint8)
        self.shade = np.zeros((side, side), np.uint8)

    def _fixed(self, points_m: Points, x0: int = 0, y0: int = 0) -> npt.NDArray[np.int32]:
        """Return points as the fixed-point pixel-centre coordinates of OpenCV's drawing."""
        pixels = points_m * self.px_per_m - (x0 + 0.5, y0 + 0.5)
        return np.round(pixels * (1 << _SHIFT)).astype(np.int32)

    def mask(self, points_m: Points) -> tuple[tuple[slice, slice], npt.NDArray[np.uint8]] | None:
        """Return the window of a polygon and its anti-aliased coverage there, None when outside."""
        pixels = points_m * self.px_per_m
        side = self.image.shape[0]
        x0, y0 = (max(int(low) - 1, 0) for low in np.floor(pixels.min(axis=0)))
        x1, y1 = (min(int(high) + 2, side) for high in np.ceil(pixels.max(axis=0)))
        if x0 >= x1 or y0 >= y1:
            return None
        stencil = np.zeros((y1 - y0, x1 - x0), np.uint8)
        cv2.fillPoly(stencil, [self._fixed(points_m, x0, y0)], 255, cv2.LINE_AA, _SHIFT)
        return (slice(y0, y1), slice(x0, x1)), stencil

    def in_sight(self, x_m: float, y_m: float, reach_m: float) -> bool:
        """Tell whether a thing of given reach may touch the picture."""
        low, high = -reach_m, self.size_m + reach_m
        return low < x_m < high and low < y_m < high

    def polygon(self, points_m: Points, colour: Colour, alpha: float = 1.0) -> None:
        """Fill a polygon with a colour of 0 to 1."""
        ink = np.clip(np.asarray(colour, np.float64) * 255, 0, 255)
        if alpha > 0.99:
            cv2.fillPoly(self.image, [self._fixed(points_m)], ink.tolist(), cv2.LINE_AA, _SHIFT)
            return
        found = self.mask(points_m)
        if found is not None:
            window, stencil = found
            part = self.image[window]
            weight = stencil[..., None] * np.float32(max(alpha, 0.0) / 255)
            part[...] = part + weight * (ink.astype(np.float32) - part)

    def cover_with(self, points_m: Points, texture: npt.NDArray[np.uint8]) -> None:
        """Fill a polygon with the same place of a picture-wide texture."""
        found = self.mask(points_m)
        if found is not None:
            window, stencil = found
            np.copyto(self.image[window], texture[window], where=(stencil > 127)[..., None])

    def line(self, points_m: Points, width_m: float, colour: Colour, alpha: float = 1.0) -> None:
        """Draw a polyline of a given width, segment by segment."""
        for start, end in pairwise(points_m):
            along = end - start
            reach = float(np.hypot(*along))
            if reach > 0:
                side = np.array([-along[1], along[0]]) / reach * width_m / 2
                corners = np.stack([start + side, end + side, end - side, start - side])
                self.polygon(corners, colour, alpha)

    def hide(self, points_m: Points, alpha: float = 1.0) -> None:
        """Note that something tall covers this polygon."""
        cv2.fillPoly(self.cover, [self._fixed(points_m)], 255 * alpha, cv2.LINE_AA, _SHIFT)

    def cast(self, points_m: Points, depth: float = 1.0) -> None:
        """Note that this polygon lies in the shadow of something tall."""
        cv2.fillPoly(self.shade, [self._fixed(points_m)], 255 * depth, cv2.LINE_AA, _SHIFT)

    def hidden(self, points_m: Points) -> float:
        """Return the share of a polygon that is hidden or outside the picture."""
        found = self.mask(points_m)
        if found is None:
            return 1.0
        window, stencil = found
        x, y = points_m[:, 0], points_m[:, 1]
        area = 0.5 * abs(float(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1))))
        open_share = (255.0 - self.cover[window]) / 255
        seen = float((stencil / 255 * open_share).sum()) / self.px_per_m**2
        return float(np.clip(1 - seen / max(area, 1e-6), 0, 1))


def sweep(points_m: Points, by_m: Points) -> Points:
    """Return the convex hull of a polygon and its copy moved by a vector: a shadow or a wall."""
    both = np.concatenate([points_m, points_m + by_m]).astype(np.float32)
    return cv2.convexHull(both)[:, 0].astype(float)

"""A scene: the canvas, what has been put on it, where the cars are, and what waits to be drawn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from renderer import palette
from renderer.buildings import building_shadow, draw_building
from renderer.canvas import Canvas, Image, Points, Pose, Sun, box, rounded
from renderer.palette import Rng, car_paint, grey
from renderer.vegetation import draw_tree, tree_shadow
from renderer.vehicles import (
    CAR,
    TRUCK,
    CarShape,
    draw_bus,
    draw_car,
    draw_tram,
    draw_truck,
    random_shape,
)

_TEXTURES: dict[str, Callable[[Rng, int], Image]] = {
    "road": palette.asphalt,
    "lot": palette.asphalt,
    "pavement": palette.paving,
    "square": palette.paving,
    "green": palette.green,
    "soil": palette.soil,
    "water": palette.water,
}


@dataclass(frozen=True)
class Label:
    """One vehicle: centre in metres from the upper left corner, size, class, hidden share."""

    x_m: float
    y_m: float
    heading_deg: float
    length_m: float
    width_m: float
    kind: int
    hidden: float


def random_sun(rng: Rng) -> Sun:
    """Return a sun: overcast in a third of the scenes, low and long-shadowed in some."""
    azimuth = rng.uniform(0, 2 * np.pi)
    elevation = np.radians(rng.uniform(22, 68))
    strength = rng.uniform(0.0, 0.25) if rng.random() < 0.3 else rng.uniform(0.45, 1.0)
    offset = np.array([np.cos(azimuth), np.sin(azimuth)]) / np.tan(elevation)
    tilt = rng.uniform(0, 2 * np.pi)
    lean = np.tan(np.radians(abs(rng.normal(0, 11)))) * np.array([np.cos(tilt), np.sin(tilt)])
    return Sun(offset, strength, lean)


class Scene:
    """A place under construction: flat things are drawn at once, tall ones when it is finished."""

    def __init__(self, rng: Rng, size_m: float, px_per_m: float, *, kept: float = 1.0) -> None:
        """Start a scene in which each vehicle comes only with the chance ``kept``."""
        self.rng = rng
        self.kept = kept
        self.sun = random_sun(rng)
        self.canvas = Canvas(size_m, px_per_m)
        self.centre = Pose(size_m / 2, size_m / 2, rng.uniform(0, 360))
        self.ink = grey(rng, 0.7, 1.0, 0.01)
        self._textures: dict[str, npt.NDArray[np.uint8]] = {}
        self._labels: list[tuple[Pose, float, float, int]] = []
        self._discs: list[Points] = []
        self._tall: list[tuple[float, Callable[[], None]]] = []
        self._taken = np.zeros((round(size_m * 2), round(size_m * 2)), np.uint8)

    def texture(self, name: str) -> npt.NDArray[np.uint8]:
        """Return the scene's texture of a ground, made when first asked for."""
        if name not in self._textures:
            texture = _TEXTURES[name](self.rng, self.canvas.image.shape[0])
            self._textures[name] = np.clip(texture * 255, 0, 255).astype(np.uint8)
        return self._textures[name]

    def ground(self, points_m: Points, name: str) -> None:
        """Cover a polygon with a ground texture."""
        self.canvas.cover_with(points_m, self.texture(name))

    def reserve(self, points_m: Points) -> None:
        """Keep buildings, trees and clutter out of a polygon."""
        cv2.fillPoly(self._taken, [np.round(points_m * 2).astype(np.int32)], 1)

    def is_free(self, points_m: Points) -> bool:
        """Tell whether no part of a polygon is reserved."""
        stencil = np.zeros_like(self._taken)
        cv2.fillPoly(stencil, [np.round(points_m * 2).astype(np.int32)], 1)
        return not bool((stencil & self._taken).any())

    def _claim(self, pose: Pose, length_m: float, width_m: float) -> bool:
        """Reserve the ground of a vehicle as a row of discs; False when another stands there."""
        count = max(3, round(length_m / (0.55 * width_m)))
        reach = (length_m - width_m) / 2
        centres = pose.place(np.stack([np.linspace(-reach, reach, count), np.zeros(count)], axis=1))
        discs = np.column_stack([centres, np.full(count, width_m / 2)])
        if self._discs:
            others = np.concatenate(self._discs)
            apart = np.hypot(*(discs[:, None, :2] - others[None, :, :2]).transpose(2, 0, 1))
            if (apart < discs[:, None, 2] + others[None, :, 2] + 0.1).any():
                return False
        self._discs.append(discs)
        return True

    def _stays_away(self) -> bool:
        return self.kept < 1.0 and bool(self.rng.random() >= self.kept)

    def add_car(self, pose: Pose, paint: Image | None = None) -> CarShape | None:
        """Draw a labelled car where the ground is free; return its shape, or None."""
        shape = random_shape(self.rng)
        if self._stays_away():
            return None
        if not self.canvas.in_sight(pose.x_m, pose.y_m, 6.0):
            return None
        if not self._claim(pose, shape.length_m, shape.width_m):
            return None
        if paint is None:
            van = shape.body == "van" and self.rng.random() < 0.5
            paint = grey(self.rng, 0.75, 1.0, 0.015) if van else car_paint(self.rng)
        draw_car(self.canvas, pose, shape, paint, self.sun, self.rng)
        self._labels.append((pose, shape.length_m, shape.width_m, CAR))
        return shape

    def add_heavy(self, pose: Pose, kind: str) -> bool:
        """Draw a labelled truck, bus or tram where the ground is free."""
        ranges = {"truck": (6.5, 16.0), "bus": (9.5, 18.0), "tram": (18.0, 36.0)}
        draw = {"truck": draw_truck, "bus": draw_bus, "tram": draw_tram}[kind]
        length = self.rng.uniform(*ranges[kind])
        if self._stays_away():
            return False
        if not self.canvas.in_sight(pose.x_m, pose.y_m, 24.0):
            return False
        if not self._claim(pose, length, 2.5):
            return False
        draw(self.canvas, pose, length, self.sun, self.rng)
        self._labels.append((pose, length, 2.5, TRUCK))
        return True

    def add_tree(self, x_m: float, y_m: float, radius_m: float) -> None:
        """Plant a tree: its shadow falls on all that is low, its crown hides what is below."""
        height = radius_m * self.rng.uniform(1.8, 3.5) + 1.5
        if not self.canvas.in_sight(x_m, y_m, 2.5 * height):
            return
        args = (self.canvas, x_m, y_m, radius_m, height, self.sun, self.rng)
        tree_shadow(*args)
        self._tall.append((height, lambda: draw_tree(*args)))

    def add_building(
        self, pose: Pose, length_m: float, depth_m: float, height_m: float, *, pitched: bool
    ) -> bool:
        """Build a house where the ground is free."""
        outline = pose.place(box(-length_m / 2, length_m / 2, -depth_m / 2, depth_m / 2))
        if not self.canvas.in_sight(pose.x_m, pose.y_m, length_m + depth_m + 2.5 * height_m):
            return False
        if not self.is_free(outline):
            return False
        self.reserve(outline)
        building_shadow(self.canvas, pose, length_m, depth_m, height_m, self.sun)

        def build() -> None:
            draw_building(
                self.canvas, pose, length_m, depth_m, height_m, self.sun, self.rng, pitched=pitched
            )

        self._tall.append((height_m, build))
        return True

    def finish(self) -> tuple[Image, list[Label]]:
        """Lay the tall shadows, draw the tall things, low ones first; return picture and labels."""
        shade = cv2.GaussianBlur(self.canvas.shade, (0, 0), self.rng.uniform(0.6, 2.5))
        dark = np.float32(self.rng.uniform(0.55, 0.85) / 255) * shade[..., None]
        sky = np.float32([1.0, 0.97, 0.90])
        self.canvas.image[...] = self.canvas.image * (1 - dark * sky)
        for _, draw in sorted(self._tall, key=lambda item: item[0]):
            draw()
        image = self.canvas.image.astype(np.float32) / 255
        return image, [self._label(*entry) for entry in self._labels]

    def _label(self, pose: Pose, length_m: float, width_m: float, kind: int) -> Label:
        lift = self.sun.lean * (0.8 if kind == CAR else 1.6)
        outline = pose.place(rounded(length_m, width_m, 0.3, 0.2)) + lift
        x, y = np.array([pose.x_m, pose.y_m]) + lift
        hidden = self.canvas.hidden(outline)
        heading = pose.heading_deg % 360
        return Label(float(x), float(y), heading, length_m, width_m, kind, hidden)

"""Trees, thin young trees, bushes and hedges."""

from __future__ import annotations

import numpy as np

from renderer.canvas import Canvas, Points, Sun, sweep
from renderer.palette import Rng, hsv

_ANGLES = np.linspace(0, 2 * np.pi, 14, endpoint=False)
_CIRCLE = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=1)


def _blob(rng: Rng, x: float, y: float, radius: float, rough: float) -> Points:
    """Return a ragged circle."""
    reach = radius * (1 + rough * rng.standard_normal(len(_CIRCLE)))
    return _CIRCLE * reach[:, None] + (x, y)


def tree_shadow(
    canvas: Canvas, x_m: float, y_m: float, radius_m: float, height_m: float, sun: Sun, rng: Rng
) -> None:
    """Cast the shadow of a crown, detached from its foot when the sun is low, and of the trunk."""
    foot = np.array([x_m, y_m])
    middle = foot + sun.offset * height_m * 0.7
    stretch = sun.offset * height_m * 0.2
    crown = _blob(rng, *middle, radius_m * 0.95, 0.12)
    canvas.cast(sweep(crown - stretch, 2 * stretch), sun.strength * rng.uniform(0.7, 1))
    trunk = np.array([[-0.12, 0.0], [0.12, 0.0], [0.0, 0.12], [0.0, -0.12]]) + foot
    canvas.cast(sweep(trunk, middle - foot), sun.strength)


def draw_tree(
    canvas: Canvas, x_m: float, y_m: float, radius_m: float, height_m: float, sun: Sun, rng: Rng
) -> None:
    """Draw a crown above the ground from many leaf clusters, bright towards the sun.

    It also notes what the crown hides.
    """
    centre = np.array([x_m, y_m]) + sun.lean * height_m * 0.7
    hue = rng.normal(0.25, 0.035) if rng.random() < 0.88 else rng.uniform(0.0, 0.16)
    base = hsv(hue, rng.uniform(0.15, 0.6), rng.uniform(0.16, 0.5))
    thin = rng.random() < 0.25
    toward = -sun.offset / (float(np.hypot(*sun.offset)) + 1e-6)
    if not thin:
        core = _blob(rng, *centre, radius_m * 0.88, 0.1)
        canvas.polygon(core, base * 0.6)
        canvas.hide(core)
    clusters = int(np.clip(14 * radius_m * (0.5 if thin else 1.2), 8, 90))
    contrast = rng.uniform(0.25, 0.7)
    for _ in range(clusters):
        angle, reach = rng.uniform(0, 2 * np.pi), radius_m * np.sqrt(rng.random()) * 0.95
        offset = reach * np.array([np.cos(angle), np.sin(angle)])
        lit = float(np.dot(offset, toward)) / radius_m
        gain = 0.85 + contrast * lit * (0.3 + sun.strength) + rng.normal(0, 0.14)
        size = rng.uniform(0.12, 0.34) * radius_m**0.6
        leaf = _blob(rng, *(centre + offset), size, 0.25)
        alpha = rng.uniform(0.3, 0.8) if thin else 0.9
        canvas.polygon(leaf, np.clip(base * max(gain, 0.2) * 1.15, 0, 1), alpha)
        canvas.hide(leaf, alpha)


def draw_bush(canvas: Canvas, x_m: float, y_m: float, radius_m: float, sun: Sun, rng: Rng) -> None:
    """Draw a bush on the ground with its short shadow."""
    outline = _blob(rng, x_m, y_m, radius_m, 0.15)
    canvas.polygon(sweep(outline, sun.offset * radius_m), (0.02, 0.03, 0.03), 0.7 * sun.strength)
    hue = rng.normal(0.24, 0.05) if rng.random() < 0.75 else rng.uniform(-0.06, 0.12)
    base = hsv(hue, rng.uniform(0.1, 0.6), rng.uniform(0.12, 0.5))
    canvas.polygon(outline, base * 0.75)
    for _ in range(int(4 + 8 * radius_m)):
        dx, dy = rng.normal(0, 0.4 * radius_m, 2)
        leaf = _blob(rng, x_m + dx, y_m + dy, 0.3 * radius_m, 0.25)
        canvas.polygon(leaf, np.clip(base * rng.uniform(0.6, 1.4), 0, 1))


def draw_hedge(canvas: Canvas, line_m: Points, width_m: float, sun: Sun, rng: Rng) -> None:
    """Draw a hedge along a line of two points."""
    start, end = line_m[0], line_m[-1]
    reach = float(np.hypot(*(end - start)))
    for share in np.linspace(0, 1, max(2, int(reach / (0.6 * width_m)))):
        x, y = start + share * (end - start)
        draw_bush(canvas, float(x), float(y), width_m * rng.uniform(0.45, 0.6), sun, rng)


def draw_shrubs(canvas: Canvas, area_m: Points, count: int, sun: Sun, rng: Rng) -> None:
    """Draw a bed of low shrubs scattered along the diagonal of a quadrilateral's middle line."""
    start, end = area_m[[0, 3]].mean(axis=0), area_m[[1, 2]].mean(axis=0)
    side = (area_m[3] - area_m[0]) / 2
    for _ in range(count):
        x, y = start + rng.random() * (end - start) + rng.uniform(-0.9, 0.9) * side
        draw_bush(canvas, float(x), float(y), rng.uniform(0.25, 1.1), sun, rng)

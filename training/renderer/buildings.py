"""Buildings: pitched and flat roofs, and all that stands on them."""

from __future__ import annotations

import numpy as np

from renderer.canvas import Canvas, Image, Pose, Sun, box, sweep
from renderer.palette import Rng, grey, hsv, noise, roof_colour


def building_shadow(
    canvas: Canvas, pose: Pose, length_m: float, depth_m: float, height_m: float, sun: Sun
) -> None:
    """Cast the shadow of a building on the ground and on the cars."""
    ground = pose.place(box(-length_m / 2, length_m / 2, -depth_m / 2, depth_m / 2))
    canvas.cast(sweep(ground, sun.offset * height_m), sun.strength)


def draw_building(
    canvas: Canvas,
    pose: Pose,
    length_m: float,
    depth_m: float,
    height_m: float,
    sun: Sun,
    rng: Rng,
    *,
    pitched: bool,
) -> None:
    """Draw walls that lean and a roof with its furniture; note what it hides."""
    outline = box(-length_m / 2, length_m / 2, -depth_m / 2, depth_m / 2)
    ground = pose.place(outline)
    lift = sun.lean * height_m
    walls = sweep(ground, lift)
    canvas.polygon(walls, grey(rng, 0.25, 0.8, 0.04))
    _draw_windows(canvas, ground, lift, rng)
    canvas.hide(walls)
    top = roof_colour(rng)
    canvas.polygon(ground + lift, top)
    if pitched:
        _pitched_roof(canvas, pose, length_m, depth_m, top, lift, sun, rng)
    else:
        _flat_roof(canvas, pose, length_m, depth_m, top, lift, sun, rng)
    _weather(canvas, ground + lift, rng)


def _draw_windows(canvas: Canvas, ground: np.ndarray, lift: np.ndarray, rng: Rng) -> None:
    """Draw rows of windows on the walls that the camera sees."""
    if float(np.hypot(*lift)) < 1.0:
        return
    pane = grey(rng, 0.05, 0.4)
    for start, end in zip(ground, np.roll(ground, -1, axis=0), strict=True):
        reach = float(np.hypot(*(end - start)))
        for share in np.arange(1.5, reach - 1, 2.5) / max(reach, 1e-6):
            foot = start + share * (end - start)
            along = (end - start) / reach * 0.5
            for low in (0.2, 0.55):
                corners = np.stack([foot - along, foot + along])
                pane_box = np.concatenate(
                    [corners + lift * low, (corners + lift * (low + 0.22))[::-1]]
                )
                canvas.polygon(pane_box, pane)


def _weather(canvas: Canvas, outline: np.ndarray, rng: Rng) -> None:
    """Stain the roof with noise."""
    found = canvas.mask(outline)
    if found is None:
        return
    window, stencil = found
    height, width = stencil.shape
    stain = noise(rng, max(height, width), rng.uniform(4, 40))[:height, :width]
    part = canvas.image[window]
    gain = 1 + np.float32(rng.uniform(0.01, 0.06) / 255) * stain * stencil
    part[...] = np.clip(part * gain[..., None], 0, 255)


def _pitched_roof(
    canvas: Canvas,
    pose: Pose,
    length: float,
    depth: float,
    colour: Image,
    lift: np.ndarray,
    sun: Sun,
    rng: Rng,
) -> None:
    """Draw two slopes of different light, the ridge, tile rows, and furniture on both slopes."""
    right = pose.place([[0.0, 1.0]])[0] - pose.place([[0.0, 0.0]])[0]
    facing = -float(np.dot(right, sun.offset)) / (float(np.hypot(*sun.offset)) + 1e-6)
    hip = rng.uniform(0, 0.4) * depth if rng.random() < 0.35 else 0.0
    for side in (-1, 1):
        slope = np.array(
            [[-length / 2, side * depth / 2], [length / 2, side * depth / 2],
             [length / 2 - hip, 0.0], [-length / 2 + hip, 0.0]]
        )  # fmt: skip
        light = 1 + side * facing * (0.05 + 0.3 * sun.strength)
        canvas.polygon(pose.place(slope) + lift, np.clip(colour * light, 0, 1))
    pitch = rng.uniform(0.4, 1.2)
    for v in np.arange(-depth / 2, depth / 2, pitch):
        row = pose.place([[-length / 2, v], [length / 2, v]]) + lift
        canvas.line(row, 0.1, colour * 0.8, rng.uniform(0.05, 0.35))
    canvas.line(
        pose.place([[-length / 2 + hip, 0.0], [length / 2 - hip, 0.0]]) + lift, 0.3, colour * 1.15
    )
    for side in (-1, 1):
        if rng.random() < 0.6:
            _roof_row(canvas, pose, length, depth, side, colour, lift, sun, rng)
    for _ in range(int(rng.integers(0, 4))):
        u, v = rng.uniform(-0.45, 0.45) * length, rng.uniform(-0.2, 0.2) * depth
        _stack(
            canvas, pose.moved(u, v), rng.uniform(0.5, 1.4), rng.uniform(0.5, 0.9), lift, sun, rng
        )


def _roof_row(
    canvas: Canvas,
    pose: Pose,
    length: float,
    depth: float,
    side: int,
    colour: Image,
    lift: np.ndarray,
    sun: Sun,
    rng: Rng,
) -> None:
    """Draw a row of roof windows, dormers or solar panels on one slope.

    Such rows look like parked cars: boxes of about their size, bright or dark, each with a shadow.
    """
    kind = rng.choice(["window", "dormer", "solar"], p=[0.4, 0.4, 0.2])
    across = {"window": 0.9, "dormer": rng.uniform(1.2, 2.4), "solar": 1.0}[kind]
    along = {"window": 1.3, "dormer": rng.uniform(1.8, 4.2), "solar": 1.7}[kind]
    gap = 0.06 if kind == "solar" else rng.uniform(0.7, 4.0)
    v = side * rng.uniform(0.2, 0.32) * depth
    tones = {
        "window": grey(rng, 0.05, 0.6),
        "dormer": grey(rng, 0.1, 0.95) if rng.random() < 0.7 else colour * rng.uniform(0.6, 1.3),
        "solar": hsv(0.62, rng.uniform(0.2, 0.6), rng.uniform(0.1, 0.35)),
    }
    keep = rng.uniform(0.5, 1.0)
    ends = rng.uniform(-0.5, 0.2) * length, rng.uniform(0.1, 0.5) * length
    for u in np.arange(ends[0] + 1, ends[1] - across, across + gap):
        if rng.random() > keep:
            continue
        here = pose.moved(u, v)
        shape = box(-across / 2, across / 2, -along / 2, along / 2)
        if kind == "dormer":
            shadow = sweep(here.place(shape), sun.offset * 1.2) + lift
            canvas.polygon(shadow, (0.02, 0.02, 0.03), 0.6 * sun.strength)
        canvas.polygon(here.place(shape * 1.15) + lift, grey(rng, 0.2, 0.9), 0.7)
        canvas.polygon(here.place(shape) + lift, np.clip(tones[kind], 0, 1))
        if kind == "dormer" and rng.random() < 0.6:
            half = box(-across / 2, 0, -along / 2, along / 2)
            canvas.polygon(here.place(half) + lift, np.clip(tones[kind] * 0.75, 0, 1))


def _stack(
    canvas: Canvas, pose: Pose, length: float, width: float, lift: np.ndarray, sun: Sun, rng: Rng
) -> None:
    """Draw a chimney, a vent or a cooler: a small box with a shadow on the roof."""
    shape = pose.place(box(-length / 2, length / 2, -width / 2, width / 2)) + lift
    height = rng.uniform(0.4, 1.8)
    canvas.polygon(sweep(shape, sun.offset * height), (0.02, 0.02, 0.03), 0.7 * sun.strength)
    tone = grey(rng, 0.1, 1.0, 0.04)
    canvas.polygon(sweep(shape, sun.lean * height), tone * 0.6)
    canvas.polygon(shape + sun.lean * height, tone)
    if rng.random() < 0.5:
        inner = pose.place(box(-length / 3, length / 3, -width / 3, width / 3))
        canvas.polygon(inner + lift + sun.lean * height, tone * rng.uniform(0.3, 0.9))


def _flat_roof(
    canvas: Canvas,
    pose: Pose,
    length: float,
    depth: float,
    colour: Image,
    lift: np.ndarray,
    sun: Sun,
    rng: Rng,
) -> None:
    """Draw a parapet, seams, skylights in rows, coolers and vents."""
    inner = pose.place(box(-length / 2 + 0.4, length / 2 - 0.4, -depth / 2 + 0.4, depth / 2 - 0.4))
    canvas.polygon(
        pose.place(box(-length / 2, length / 2, -depth / 2, depth / 2)) + lift, grey(rng, 0.3, 0.95)
    )
    canvas.polygon(inner + lift, colour)
    if rng.random() < 0.5:
        for v in np.arange(-depth / 2 + 0.4, depth / 2 - 0.4, rng.uniform(0.8, 3)):
            seam = pose.place([[-length / 2 + 0.4, v], [length / 2 - 0.4, v]]) + lift
            canvas.line(seam, 0.1, colour * rng.uniform(0.7, 1.2), 0.5)
    if rng.random() < 0.5:
        _skylights(canvas, pose, length, depth, lift, sun, rng)
    for _ in range(int(rng.integers(0, 9))):
        u = rng.uniform(-0.42, 0.42) * length
        v = rng.uniform(-0.38, 0.38) * depth
        size = rng.uniform(0.4, 4.5), rng.uniform(0.4, 2.2)
        turn = float(rng.choice([0, 90])) if rng.random() < 0.9 else rng.uniform(0, 90)
        _stack(canvas, pose.moved(u, v, turn), *size, lift, sun, rng)


def _skylights(
    canvas: Canvas, pose: Pose, length: float, depth: float, lift: np.ndarray, sun: Sun, rng: Rng
) -> None:
    """Draw a grid of equal skylights."""
    size = rng.uniform(0.9, 2.2), rng.uniform(0.9, 3.8)
    step = size[0] + rng.uniform(0.6, 4), size[1] + rng.uniform(0.6, 4)
    tone = grey(rng, 0.3, 1.0)
    for u in np.arange(-0.4 * length, 0.4 * length, step[0]):
        for v in np.arange(-0.35 * depth, 0.3 * depth, step[1]):
            here = pose.moved(u, v)
            shape = here.place(box(0, size[0], 0, size[1])) + lift
            canvas.polygon(sweep(shape, sun.offset * 0.4), (0.02, 0.02, 0.03), 0.6 * sun.strength)
            canvas.polygon(shape, tone)
            pane = here.place(box(0.2, size[0] - 0.2, 0.2, size[1] - 0.2)) + lift
            canvas.polygon(pane, tone * 0.85)

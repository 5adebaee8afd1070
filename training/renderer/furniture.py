"""Things that networks take for cars: containers, boats, planters, shelters, stairs, shadows."""

from __future__ import annotations

import numpy as np

from renderer.canvas import Canvas, Pose, Sun, box, rounded, sweep
from renderer.palette import Rng, grey, hsv
from renderer.vegetation import draw_bush
from renderer.vehicles import draw_motorbike, draw_shadow, draw_trailer

DARK = (0.03, 0.03, 0.04)


def draw_box(
    canvas: Canvas,
    pose: Pose,
    length: float,
    width: float,
    height: float,
    colour: np.ndarray,
    sun: Sun,
) -> None:
    """Draw a plain box with its shadow and walls."""
    ground = pose.place(box(-length / 2, length / 2, -width / 2, width / 2))
    draw_shadow(canvas, ground, height, sun)
    canvas.polygon(sweep(ground, sun.lean * height), np.clip(colour * 0.6, 0, 1))
    canvas.polygon(ground + sun.lean * height, np.clip(colour, 0, 1))


def draw_container(canvas: Canvas, pose: Pose, sun: Sun, rng: Rng) -> None:
    """Draw a shipping container, a skip or a site cabin with ribs."""
    length = float(rng.choice([2.4, 3.4, 6.06, 12.19]))
    width = 2.44 if length > 4 else rng.uniform(1.5, 2.0)
    colour = hsv(rng.random(), rng.uniform(0.1, 0.8), rng.uniform(0.25, 0.9))
    height = rng.uniform(1.2, 2.6)
    draw_box(canvas, pose, length, width, height, colour, sun)
    lift = sun.lean * height
    for u in np.arange(-length / 2, length / 2 - 0.1, rng.uniform(0.3, 0.8)):
        canvas.polygon(
            pose.place(box(u, u + 0.12, -width / 2, width / 2)) + lift, colour * 0.8, 0.5
        )
    if length < 4 and rng.random() < 0.7:
        inside = box(-0.42 * length, 0.42 * length, -0.4 * width, 0.4 * width)
        canvas.polygon(pose.place(inside) + lift, grey(rng, 0.05, 0.5, 0.06))


def draw_boat(canvas: Canvas, pose: Pose, sun: Sun, rng: Rng) -> None:
    """Draw a boat: pointed bow, deck, cockpit or cabin."""
    length = rng.uniform(3.5, 9)
    width = length * rng.uniform(0.28, 0.4)
    t = np.linspace(0, 1, 9)
    half = width / 2 * np.clip(1.35 * np.cos(t * np.pi / 2) ** 0.6, 0, 1)
    side = np.stack([t * length - length / 2, half], axis=1)
    hull = np.concatenate([side, (side * [1, -1])[::-1]])
    ground = pose.place(hull)
    draw_shadow(canvas, ground, 0.9, sun)
    colour = grey(rng, 0.7, 1.0) if rng.random() < 0.7 else hsv(rng.random(), 0.6, 0.6)
    canvas.polygon(ground, colour)
    canvas.polygon(pose.place(hull * [0.8, 0.72]), colour * rng.uniform(0.6, 0.95))
    cockpit = rounded(length * rng.uniform(0.25, 0.5), width * 0.6, 0.3, 0.1)
    canvas.polygon(pose.place(cockpit - [rng.uniform(0, 0.15) * length, 0]), grey(rng, 0.05, 0.7))


def draw_planter(canvas: Canvas, pose: Pose, sun: Sun, rng: Rng) -> None:
    """Draw a planter: a kerb, soil and bushes; round or oblong."""
    length, width = rng.uniform(1.2, 6), rng.uniform(1.0, 2.4)
    outline = rounded(length, width, 0.3, 0.3, rng.choice([2.0, 6.0]))
    ground = pose.place(outline)
    draw_shadow(canvas, ground, 0.6, sun)
    canvas.polygon(ground, grey(rng, 0.4, 0.9, 0.03))
    canvas.polygon(pose.place(outline * 0.82), hsv(0.1, 0.3, rng.uniform(0.15, 0.4)))
    for _ in range(int(rng.integers(0, 5))):
        u, v = rng.uniform(-0.35, 0.35, 2) * (length, width)
        x, y = pose.place([[u, v]])[0]
        draw_bush(canvas, float(x), float(y), rng.uniform(0.3, 0.8), sun, rng)


def draw_shelter(canvas: Canvas, pose: Pose, sun: Sun, rng: Rng) -> None:
    """Draw a bus shelter, a carport or a kiosk: a thin roof that casts a shadow."""
    length, width, height = rng.uniform(2, 8), rng.uniform(1.3, 3), rng.uniform(2.2, 3)
    ground = pose.place(box(-length / 2, length / 2, -width / 2, width / 2))
    draw_shadow(canvas, ground, 0.4, sun, lift=height)
    roof = ground + sun.lean * height
    alpha = rng.uniform(0.5, 1)
    canvas.polygon(roof, grey(rng, 0.1, 0.95, 0.04), alpha)
    if alpha > 0.8:
        canvas.hide(roof)
    for u in np.arange(-length / 2, length / 2, rng.uniform(0.8, 2)):
        rib = pose.place([[u, -width / 2], [u, width / 2]]) + sun.lean * height
        canvas.line(rib, 0.1, grey(rng, 0.2, 0.9), 0.7)


def draw_stairs(canvas: Canvas, pose: Pose, rng: Rng) -> None:
    """Draw stairs, a grating or a ramp: a rectangle with narrow stripes and a wall."""
    length, width = rng.uniform(2.5, 12), rng.uniform(1.5, 5)
    canvas.polygon(
        pose.place(box(-length / 2 - 0.25, length / 2 + 0.25, -width / 2 - 0.25, width / 2 + 0.25)),
        grey(rng, 0.3, 0.95, 0.04),
    )
    tone = grey(rng, 0.1, 0.6)
    canvas.polygon(pose.place(box(-length / 2, length / 2, -width / 2, width / 2)), tone)
    step = rng.uniform(0.3, 0.8)
    for u in np.arange(-length / 2, length / 2, step):
        canvas.polygon(
            pose.place(box(u, u + step / 2, -width / 2, width / 2)),
            tone * rng.uniform(1.1, 1.7),
            0.7,
        )


def draw_island(canvas: Canvas, pose: Pose, sun: Sun, rng: Rng) -> None:
    """Draw a traffic island: a kerb, paving or green, and signs, lamps, bushes or people on it."""
    length, width = rng.uniform(2.5, 14), rng.uniform(1.0, 3.0)
    outline = rounded(length, width, width / 2, width / 2, 2.0)
    canvas.polygon(pose.place(outline), grey(rng, 0.55, 0.95))
    inside = hsv(rng.choice([0.02, 0.1, 0.24]), rng.uniform(0, 0.5), rng.uniform(0.25, 0.8))
    canvas.polygon(pose.place(outline * [1 - 0.4 / length, 1 - 0.4 / width]), inside)
    for _ in range(int(rng.integers(0, 6))):
        u, v = rng.uniform(-0.4, 0.4) * length, rng.uniform(-0.3, 0.3) * width
        x, y = (float(value) for value in pose.place([[u, v]])[0])
        kind = rng.random()
        if kind < 0.35:
            draw_person(canvas, x, y, sun, rng)
        elif kind < 0.6:
            draw_pole(canvas, x, y, sun, rng)
        elif kind < 0.8:
            draw_bush(canvas, x, y, rng.uniform(0.2, 0.9), sun, rng)
        else:
            draw_box(canvas, pose.moved(u, v), 0.5, 0.5, 1.0, grey(rng, 0.3, 1.0, 0.1), sun)


def draw_cycles(canvas: Canvas, pose: Pose, sun: Sun, rng: Rng) -> None:
    """Draw cycles side by side in a rack: thin dark frames and their shadows, with gaps."""
    for v in np.arange(0, rng.uniform(2, 7), rng.uniform(0.35, 0.7)):
        if rng.random() < 0.2:
            continue
        frame = pose.moved(rng.normal(0, 0.08), v, rng.normal(0, 5)).place(
            np.array([[-0.85, 0.0], [0.85, 0.0]])
        )
        canvas.line(frame + sun.offset * 0.6, 0.2, DARK, 0.6 * sun.strength)
        tone = grey(rng, 0.05, 0.5, 0.1)
        canvas.line(frame + sun.lean, rng.uniform(0.08, 0.25), tone, 0.9)
        bar = pose.moved(0.5, v).place(np.array([[0.0, -0.28], [0.0, 0.28]]))
        canvas.line(bar + sun.lean, 0.1, tone, 0.9)


def draw_pole(canvas: Canvas, x_m: float, y_m: float, sun: Sun, rng: Rng) -> None:
    """Draw a street lamp: pole, arm, head and their long shadow."""
    height, reach = rng.uniform(5, 10), rng.uniform(0, 3)
    angle = rng.uniform(0, 2 * np.pi)
    foot = np.array([x_m, y_m])
    arm = reach * np.array([np.cos(angle), np.sin(angle)])
    for direction, colour, strength in (
        (sun.offset, DARK, 0.6 * sun.strength),
        (sun.lean, grey(rng, 0.3, 0.95), 0.9),
    ):
        top = foot + direction * height
        canvas.line(np.stack([foot, top, top + arm]), rng.uniform(0.1, 0.25), colour, strength)
        head = rounded(0.9, 0.35, 0.1, 0.1) @ np.array([[0.0, 1.0], [1.0, 0.0]])
        canvas.polygon(head + top + arm, colour, strength)


def draw_person(canvas: Canvas, x_m: float, y_m: float, sun: Sun, rng: Rng) -> None:
    """Draw a pedestrian with a shadow."""
    body = Pose(x_m, y_m, 0.0).place(rounded(0.45, 0.55, 0.2, 0.2, 2))
    canvas.polygon(sweep(body, sun.offset * 1.7), DARK, 0.6 * sun.strength)
    colour = hsv(rng.random(), rng.uniform(0, 0.7), rng.uniform(0.05, 0.9))
    canvas.polygon(sweep(body, sun.lean * 1.6), colour)


def draw_stain(canvas: Canvas, pose: Pose, rng: Rng) -> None:
    """Draw what lies flat: a patch of other asphalt, an oil stain, a manhole, a lone shadow."""
    kind = rng.random()
    if kind < 0.45:
        size = box(0, rng.uniform(0.8, 7), 0, rng.uniform(0.6, 2.6))
        canvas.polygon(pose.place(size), grey(rng, 0.05, 0.8), rng.uniform(0.1, 0.75))
    elif kind < 0.75:
        shape = rounded(rng.uniform(1.5, 5.5), rng.uniform(0.6, 2), 0.4, 0.4, 2)
        canvas.polygon(pose.place(shape), DARK, rng.uniform(0.15, 0.7))
    else:
        shape = rounded(rng.uniform(0.5, 1.2), rng.uniform(0.5, 1.0), 0.3, 0.3, 2)
        canvas.polygon(pose.place(shape), grey(rng, 0.08, 0.6))


def draw_clutter(canvas: Canvas, pose: Pose, sun: Sun, rng: Rng) -> None:
    """Draw one thing at random that is not a car."""
    kind = int(rng.integers(0, 12))
    if kind == 0:
        draw_container(canvas, pose, sun, rng)
    elif kind == 1:
        draw_boat(canvas, pose, sun, rng)
    elif kind in (2, 3):
        draw_planter(canvas, pose, sun, rng)
    elif kind == 4:
        draw_shelter(canvas, pose, sun, rng)
    elif kind == 5:
        draw_stairs(canvas, pose, rng)
        for _ in range(int(rng.integers(0, 6))):
            x, y = pose.place([rng.uniform(-4, 4, 2)])[0]
            draw_person(canvas, float(x), float(y), sun, rng)
    elif kind == 6:
        draw_trailer(canvas, pose, sun, rng)
    elif kind == 7:
        draw_motorbike(canvas, pose, sun, rng)
    elif kind == 8:
        for step in range(int(rng.integers(2, 7))):
            colour = hsv(rng.random(), rng.uniform(0, 0.7), rng.uniform(0.1, 0.7))
            draw_box(canvas, pose.moved(0, 1.5 * step), 1.1, 1.2, 1.3, colour, sun)
    elif kind == 9:
        size = rng.uniform(0.6, 5), rng.uniform(0.5, 2.2)
        draw_box(canvas, pose, *size, rng.uniform(0.3, 2.2), grey(rng, 0.05, 1, 0.08), sun)
    elif kind == 10:
        draw_cycles(canvas, pose, sun, rng)
    else:
        draw_stain(canvas, pose, rng)

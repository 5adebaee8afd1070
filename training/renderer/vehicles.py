"""Vehicles from above: cars, vans, trucks, buses, trams, trailers, motorbikes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from renderer.canvas import Canvas, Colour, Image, Points, Pose, Sun, box, rounded, shifted, sweep
from renderer.palette import Rng, car_paint, grey, hsv

CAR, TRUCK = 0, 1
"""Classes of the labels: cars and vans up to 6 m; trucks, buses and trams."""

BODIES = ("hatchback", "saloon", "estate", "suv", "van", "pickup", "open")
_SHARES = (0.28, 0.20, 0.15, 0.18, 0.15, 0.02, 0.02)


@dataclass(frozen=True)
class CarShape:
    """The make of a car: its size in metres and where its glass begins and ends (shares)."""

    body: str
    length_m: float
    width_m: float
    height_m: float
    windscreen: float
    roof_front: float
    roof_rear: float
    rear_window: float


def random_shape(rng: Rng) -> CarShape:
    """Return a car shape drawn from what stands in European streets."""
    body = str(rng.choice(BODIES, p=_SHARES))
    ranges = {
        "hatchback": (3.5, 4.4, 1.45, 0.20, 0.04, -0.36, -0.45),
        "saloon": (4.3, 5.0, 1.43, 0.19, 0.04, -0.22, -0.34),
        "estate": (4.3, 4.95, 1.47, 0.20, 0.06, -0.40, -0.47),
        "suv": (4.1, 4.9, 1.65, 0.22, 0.08, -0.38, -0.46),
        "van": (4.6, 6.0, 2.1, 0.34, 0.24, -0.46, -0.49),
        "pickup": (4.9, 5.4, 1.75, 0.20, 0.07, -0.10, -0.14),
        "open": (3.9, 4.5, 1.3, 0.16, 0.10, -0.20, -0.22),
    }
    low, high, height, screen, front, rear, window = ranges[body]
    length = rng.uniform(low, high)
    width = np.clip(1.72 + 0.10 * (length - 4.2) + rng.normal(0, 0.05), 1.58, 1.98)
    wider = 0.12 if body == "van" else 0.0
    nudge = rng.normal(0, 0.012, 4)
    return CarShape(
        body,
        length,
        float(width) + wider,
        height * rng.uniform(0.95, 1.05),
        screen + nudge[0],
        front + nudge[1],
        rear + nudge[2],
        window + 0.5 * nudge[3],
    )


def draw_shadow(
    canvas: Canvas, outline: Points, height_m: float, sun: Sun, lift: float = 0.0
) -> None:
    """Darken the ground where a body of given height throws its shadow."""
    start = outline + sun.offset * lift
    depth = sun.strength
    canvas.polygon(sweep(start, sun.offset * height_m), (0.02, 0.025, 0.035), 0.75 * depth)


def draw_car(
    canvas: Canvas,
    pose: Pose,
    shape: CarShape,
    colour: Colour,
    sun: Sun,
    rng: Rng,
) -> None:
    """Draw a car with its shadow: body, glass, roof, lamps and highlights."""
    length, width = shape.length_m, shape.width_m
    paint = np.asarray(colour, np.float32)
    outline = rounded(length, width, rng.uniform(0.25, 0.55), rng.uniform(0.12, 0.35), 3.0)
    ground = pose.place(outline)
    draw_shadow(canvas, pose.place(outline * [1.0, 0.96]), 0.8 * shape.height_m, sun)
    halo = pose.place(outline * [1 + 0.14 / length, 1 + 0.2 / width])
    canvas.polygon(halo, (0.03, 0.03, 0.04), rng.uniform(0.1, 0.55))
    lift = sun.lean * 0.75
    flank = paint * rng.uniform(0.45, 0.75)
    canvas.polygon(sweep(ground, lift), flank)
    canvas.polygon(ground + lift, paint)
    _shade_sides(canvas, pose, length, width, paint, sun, lift)
    _draw_cabin(canvas, pose, shape, paint, sun, rng)
    _draw_lamps(canvas, pose, length, width, lift, rng)


def _shade_sides(
    canvas: Canvas, pose: Pose, length: float, width: float, paint: Image, sun: Sun, lift: Points
) -> None:
    """Brighten the edge of the body that faces the sun and darken the other."""
    right = pose.place([[0.0, 1.0]])[0] - pose.place([[0.0, 0.0]])[0]
    facing = -float(np.dot(right, sun.offset)) / (float(np.hypot(*sun.offset)) + 1e-6)
    for side in (-1, 1):
        strip = box(-0.44 * length, 0.40 * length, side * 0.40 * width, side * 0.49 * width)
        glow = side * facing * sun.strength
        ink = paint + 0.35 * glow if glow > 0 else paint * (1 + 0.6 * glow)
        canvas.polygon(pose.place(strip) + lift, np.clip(ink, 0, 1), 0.7)


def _draw_cabin(
    canvas: Canvas, pose: Pose, shape: CarShape, paint: Image, sun: Sun, rng: Rng
) -> None:
    """Draw the glass and the roof above the body."""
    length, width = shape.length_m, shape.width_m
    waist, top = sun.lean * 0.95, sun.lean * shape.height_m
    glass = grey(rng, 0.03, 0.22, 0.015) + np.float32([0, 0.01, 0.03])
    if rng.random() < 0.25:
        glass = glass + rng.uniform(0.1, 0.45)
    if shape.body == "open":
        glass = grey(rng, 0.05, 0.3, 0.05)
    screen, front = shape.windscreen * length, shape.roof_front * length
    rear, window = shape.roof_rear * length, shape.rear_window * length
    half = 0.46 * width
    greenhouse = np.array(
        [
            [screen + 0.03 * length, 0.0],
            [screen, half * 0.85],
            [front, half],
            [rear, half],
            [window, half * 0.86],
            [window, -half * 0.86],
            [rear, -half],
            [front, -half],
            [screen, -half * 0.85],
        ]
    )
    canvas.polygon(pose.place(greenhouse) + waist, glass)
    roof_half = (
        width * rng.uniform(0.33, 0.38) * (rng.uniform(1.1, 1.3) if shape.body == "van" else 1.0)
    )
    roof = np.array(
        [
            [front + 0.02 * length, 0.0],
            [front, roof_half * 0.93],
            [rear, roof_half * 0.93],
            [rear - 0.01 * length, 0.0],
            [rear, -roof_half * 0.93],
            [front, -roof_half * 0.93],
        ]
    )
    _draw_roof(canvas, pose, roof, roof_half, paint, top, sun, rng, shape)
    if rng.random() < 0.35 * sun.strength + 0.1:
        glare = rng.choice([screen, 0.38 * length, rear, 0.5 * (front + screen)])
        across = rng.uniform(-0.3, 0.3) * width
        spot = rounded(rng.uniform(0.25, 0.9), rng.uniform(0.25, 0.9), 0.1, 0.1)
        canvas.polygon(
            pose.place(shifted(spot, glare, across)) + waist, (1, 1, 1), rng.uniform(0.3, 1)
        )


def _draw_roof(
    canvas: Canvas,
    pose: Pose,
    roof: Points,
    half: float,
    paint: Image,
    top: Points,
    sun: Sun,
    rng: Rng,
    shape: CarShape,
) -> None:
    """Draw the roof: painted, black, of glass, with rails, a box or a taxi sign; or a bed."""
    front, rear = float(roof[1, 0]), float(roof[2, 0])
    kind = rng.random()
    if shape.body == "open":
        return
    ink = np.clip(paint * rng.uniform(0.9, 1.08) + 0.06 * sun.strength, 0, 1)
    if kind < 0.06:
        ink = grey(rng, 0.03, 0.12)
    canvas.polygon(pose.place(roof) + top, ink)
    if 0.06 < kind < 0.16:
        pane = box(front - 0.35, 0.5 * (front + rear), -0.7 * half, 0.7 * half)
        canvas.polygon(pose.place(pane) + top, grey(rng, 0.03, 0.2))
    elif 0.16 < kind < 0.26:
        for side in (-0.85, 0.85):
            rail = box(rear + 0.1, front - 0.1, side * half - 0.05, side * half + 0.05)
            canvas.polygon(pose.place(rail) + top, grey(rng, 0.1, 0.9))
    elif 0.26 < kind < 0.29:
        load = shifted(rounded(1.7, 0.7, 0.3, 0.1), 0.5 * (front + rear), rng.uniform(-0.3, 0.3))
        canvas.polygon(pose.place(load) + top, grey(rng, 0.05, 0.6))
    elif 0.29 < kind < 0.33:
        sign = box(front - 0.5, front - 0.25, -0.25, 0.25)
        canvas.polygon(pose.place(sign) + top, hsv(0.14, 0.8, 1.0))
    if shape.body == "pickup":
        bed = box(-0.47 * shape.length_m, rear - 0.2, -0.4 * shape.width_m, 0.4 * shape.width_m)
        canvas.polygon(pose.place(bed) + top * 0.6, grey(rng, 0.03, 0.35, 0.05))


def _draw_lamps(
    canvas: Canvas, pose: Pose, length: float, width: float, lift: Points, rng: Rng
) -> None:
    """Draw head and tail lamps, number plate and bumper gaps, each only sometimes."""
    lamps, tails, bonnet = rng.random(3)
    for side in (-1, 1):
        if lamps < 0.6:
            lamp = box(0.42 * length, 0.47 * length, side * 0.28 * width, side * 0.42 * width)
            canvas.polygon(pose.place(lamp) + lift, (0.92, 0.93, 0.95), 0.8)
        if tails < 0.5:
            lamp = box(-0.49 * length, -0.46 * length, side * 0.26 * width, side * 0.44 * width)
            canvas.polygon(pose.place(lamp) + lift, (0.6, 0.08, 0.08), 0.8)
        if rng.random() < 0.4:
            mirror = box(
                0.16 * length, 0.16 * length + 0.2, side * width / 2, side * (width / 2 + 0.18)
            )
            canvas.polygon(pose.place(mirror) + lift * 1.2, (0.1, 0.1, 0.1), 0.7)
    if bonnet < 0.5:
        seam = box(0.30 * length, 0.44 * length, -0.32 * width, 0.32 * width)
        shift = rng.uniform(-0.12, 0.16)
        canvas.polygon(pose.place(seam) + lift, (0.5 + np.sign(shift) * 0.5,) * 3, abs(shift))


def draw_random_car(canvas: Canvas, pose: Pose, sun: Sun, rng: Rng) -> tuple[CarShape, Points]:
    """Draw a car of random shape and colour; return the shape and its footprint in metres."""
    shape = random_shape(rng)
    paint = car_paint(rng)
    if shape.body == "van" and rng.random() < 0.5:
        paint = grey(rng, 0.75, 1.0, 0.015)
    draw_car(canvas, pose, shape, paint, sun, rng)
    return shape, pose.place(rounded(shape.length_m, shape.width_m, 0.3, 0.2))


def _draw_block(
    canvas: Canvas, pose: Pose, outline: Points, height_m: float, colour: Image, sun: Sun
) -> None:
    """Draw a prism: shadow, walls that lean, top."""
    ground = pose.place(outline)
    draw_shadow(canvas, ground, height_m, sun)
    canvas.polygon(sweep(ground, sun.lean * height_m), colour * 0.55)
    canvas.polygon(ground + sun.lean * height_m, colour)


def draw_truck(canvas: Canvas, pose: Pose, length_m: float, sun: Sun, rng: Rng) -> None:
    """Draw a lorry: a cab and a box, a tarpaulin or an open bed."""
    width, height = rng.uniform(2.2, 2.55), rng.uniform(2.6, 3.9)
    cab = rng.uniform(1.7, 2.4)
    body = hsv(rng.uniform(0, 1), rng.uniform(0, 0.7) * rng.integers(0, 2), rng.uniform(0.3, 1))
    front, rear = length_m / 2, -length_m / 2
    tone = car_paint(rng)
    _draw_block(
        canvas, pose, box(rear, front - cab - 0.3, -width / 2, width / 2), height, body, sun
    )
    cabin = shifted(rounded(cab, width * 0.96, 0.4, 0.1), front - cab / 2, 0.0)
    _draw_block(canvas, pose, cabin, height * 0.8, tone, sun)
    lift = sun.lean * height
    pane = box(front - 0.45, front - 0.15, -0.42 * width, 0.42 * width)
    canvas.polygon(pose.place(pane) + lift * 0.7, grey(rng, 0.03, 0.25))
    if rng.random() < 0.3:
        bed = box(rear + 0.2, front - cab - 0.5, -0.42 * width, 0.42 * width)
        canvas.polygon(pose.place(bed) + lift, grey(rng, 0.1, 0.6, 0.06))
    for u in np.arange(rear + 0.8, front - cab - 0.6, rng.uniform(0.6, 2.0)):
        rib = box(u, u + 0.08, -width / 2, width / 2)
        canvas.polygon(pose.place(rib) + lift, body * 0.8, 0.6)


def draw_bus(canvas: Canvas, pose: Pose, length_m: float, sun: Sun, rng: Rng) -> None:
    """Draw a bus or, when longer than 14 m, an articulated one: hatches and cooling on the roof."""
    width, height = 2.5, rng.uniform(2.9, 3.3)
    body = hsv(rng.uniform(0, 1), rng.uniform(0, 0.8) * rng.integers(0, 2), rng.uniform(0.4, 1))
    outline = rounded(length_m, width, 0.3, 0.2, 5.0)
    _draw_block(canvas, pose, outline, height, body, sun)
    lift = sun.lean * height
    roof = hsv(0.6, 0.03, rng.uniform(0.7, 1.0)) if rng.random() < 0.6 else body
    canvas.polygon(pose.place(outline * [0.97, 0.86]) + lift, roof)
    for _ in range(int(rng.integers(1, 6))):
        u = rng.uniform(-0.42, 0.4) * length_m
        size, half = rng.uniform(0.5, 2.4), rng.uniform(0.3, 0.85)
        canvas.polygon(pose.place(box(u, u + size, -half, half)) + lift, grey(rng, 0.1, 0.95))
    if length_m > 14:
        u = rng.uniform(-0.1, 0.1) * length_m
        canvas.polygon(pose.place(box(u, u + 0.9, -1.2, 1.2)) + lift, grey(rng, 0.1, 0.3))


def draw_tram(canvas: Canvas, pose: Pose, length_m: float, sun: Sun, rng: Rng) -> None:
    """Draw a tram of several short buses in a row."""
    parts = max(2, round(length_m / 8))
    step = length_m / parts
    colour = hsv(rng.uniform(0, 1), rng.uniform(0, 0.8), rng.uniform(0.4, 0.95))
    for part in range(parts):
        here = pose.moved((part + 0.5) * step - length_m / 2, 0)
        _draw_block(canvas, here, rounded(step - 0.4, 2.4, 0.3, 0.3, 5), 3.4, colour, sun)
        lift = sun.lean * 3.4
        for _ in range(int(rng.integers(1, 4))):
            u, size = rng.uniform(-0.4, 0.2) * step, rng.uniform(0.6, 2.4)
            canvas.polygon(here.place(box(u, u + size, -0.8, 0.8)) + lift, grey(rng, 0.15, 0.9))


def draw_trailer(canvas: Canvas, pose: Pose, sun: Sun, rng: Rng) -> None:
    """Draw a caravan or a car trailer with its drawbar; it is not a car."""
    length, width = rng.uniform(2.0, 6.0), rng.uniform(1.5, 2.3)
    bar = box(length / 2, length / 2 + 1.1, -0.06, 0.06)
    canvas.polygon(pose.place(bar), grey(rng, 0.05, 0.3))
    colour = grey(rng, 0.1, 0.95)
    outline = box(-length / 2, length / 2, -width / 2, width / 2)
    _draw_block(canvas, pose, outline, rng.uniform(0.7, 2.5), colour, sun)
    if rng.random() < 0.5:
        inside = pose.place(outline * 0.85)
        canvas.polygon(inside, grey(rng, 0.1, 0.6, 0.06))


def draw_motorbike(canvas: Canvas, pose: Pose, sun: Sun, rng: Rng) -> None:
    """Draw a motorbike or a bicycle, with a rider or without."""
    length = rng.uniform(1.6, 2.2)
    outline = rounded(length, rng.uniform(0.3, 0.7), 0.6, 0.6, 2)
    _draw_block(canvas, pose, outline, rng.uniform(0.9, 1.6), grey(rng, 0.05, 0.4, 0.08), sun)
    if rng.random() < 0.6:
        rider = rounded(0.5, 0.5, 0.25, 0.25, 2)
        canvas.polygon(pose.place(rider), hsv(rng.random(), rng.random(), rng.random()))

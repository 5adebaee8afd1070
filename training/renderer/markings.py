"""What is painted on the road: lines, arrows, zebras, bays, tram rails."""

from __future__ import annotations

import numpy as np

from renderer.canvas import Canvas, Colour, Pose, box
from renderer.palette import Rng


def lane_line(
    canvas: Canvas,
    pose: Pose,
    u0: float,
    u1: float,
    v: float,
    rng: Rng,
    *,
    dash_m: float,
    ink: Colour,
) -> None:
    """Paint a line along the street at offset v; dash_m of 0 makes it solid."""
    width, alpha = rng.uniform(0.10, 0.18), rng.uniform(0.55, 1.0)
    if dash_m <= 0:
        canvas.line(pose.place([[u0, v], [u1, v]]), width, ink, alpha)
        return
    gap = dash_m * rng.choice([1.0, 1.5, 2.0])
    for u in np.arange(u0, u1 - dash_m / 2, dash_m + gap):
        canvas.line(pose.place([[u, v], [min(u + dash_m, u1), v]]), width, ink, alpha)


def arrow(canvas: Canvas, pose: Pose, rng: Rng, ink: Colour) -> None:
    """Paint a lane arrow, straight or turning, about 5 m long."""
    canvas.polygon(pose.place(box(-2.5, 1.2, -0.08, 0.08)), ink, 0.9)
    turn = rng.integers(-1, 2)
    if turn == 0:
        head = np.array([[1.2, -0.35], [2.6, 0.0], [1.2, 0.35]])
    else:
        canvas.polygon(pose.place(box(1.0, 1.25, min(0, turn * 0.6), max(0, turn * 0.6))), ink, 0.9)
        head = np.array([[0.5, turn * 0.5], [1.1, turn * 1.2], [1.75, turn * 0.5]])
    canvas.polygon(pose.place(head), ink, 0.9)


def zebra(
    canvas: Canvas, pose: Pose, half_m: float, rng: Rng, ink: Colour, *, depth_m: float = 3.0
) -> None:
    """Paint a crossing over the street: bars, or two rows of blocks."""
    pitch = rng.uniform(0.8, 1.2)
    rows = [(-depth_m / 2, depth_m / 2)]
    if rng.random() < 0.5:
        rows = [(-depth_m / 2, -depth_m / 2 + 0.45), (depth_m / 2 - 0.45, depth_m / 2)]
    for v in np.arange(-half_m, half_m, pitch):
        for u0, u1 in rows:
            canvas.polygon(pose.place(box(u0, u1, v, v + pitch / 2)), ink, 0.9)


def stop_line(canvas: Canvas, pose: Pose, v0: float, v1: float, ink: Colour) -> None:
    """Paint a stop line over the lanes from v0 to v1."""
    canvas.polygon(pose.place(box(-0.25, 0.25, v0, v1)), ink, 0.9)


def hatching(
    canvas: Canvas, pose: Pose, length: float, width: float, rng: Rng, ink: Colour
) -> None:
    """Paint a blocked area of slanting bars, or a filled triangle before an island."""
    if rng.random() < 0.3:
        corners = np.array([[-length / 2, -width / 2], [length / 2, 0], [-length / 2, width / 2]])
        canvas.polygon(pose.place(corners), ink, 0.9)
        return
    for u in np.arange(-length / 2, length / 2, 1.2):
        bar = np.array(
            [[u, -width / 2], [u + 0.4, -width / 2], [u + 1.2, width / 2], [u + 0.8, width / 2]]
        )
        canvas.polygon(pose.place(bar), ink, 0.85)


def bay_lines(
    canvas: Canvas, pose: Pose, length: float, width: float, rng: Rng, ink: Colour, *, end: bool
) -> None:
    """Paint the two sides of one bay, its far end or only corner marks."""
    style = 0.10
    for v in (-width / 2, width / 2):
        canvas.line(pose.place([[-length / 2, v], [length / 2, v]]), style, ink, 0.85)
    if end:
        canvas.line(
            pose.place([[-length / 2, -width / 2], [-length / 2, width / 2]]), style, ink, 0.85
        )
    if rng.random() < 0.03:
        sign = box(-0.6, 0.6, -0.5, 0.5)
        canvas.polygon(pose.place(sign), rng.uniform(0, 1, 3), 0.6)


def rails(canvas: Canvas, pose: Pose, u0: float, u1: float, v: float, rng: Rng) -> None:
    """Draw one tram track: two rails 1.435 m apart, on a bed of its own or in the road."""
    tone = np.float32(rng.uniform(0.15, 0.8))
    if rng.random() < 0.4:
        bed = pose.place(box(u0, u1, v - 1.3, v + 1.3))
        canvas.polygon(bed, rng.uniform(0.25, 0.6) + np.array([0.06, 0.02, 0.0]), 0.8)
    for side in (-0.72, 0.72):
        canvas.line(pose.place([[u0, v + side], [u1, v + side]]), 0.14, np.full(3, tone), 0.8)


def teeth(
    canvas: Canvas, pose: Pose, half_m: float, rng: Rng, ink: Colour, *, size_m: float = 0.6
) -> None:
    """Paint a row of triangles or squares over the street: give way, or a cycle crossing."""
    squares = rng.random() < 0.5
    for v in np.arange(-half_m, half_m, 2 * size_m):
        shape = np.array(
            [[-size_m / 2, v], [size_m / 2, v + size_m / 2], [-size_m / 2, v + size_m]]
        )
        corners = box(-size_m / 2, size_m / 2, v, v + size_m) if squares else shape
        canvas.polygon(pose.place(corners), ink, 0.9)

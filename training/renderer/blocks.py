"""What fills the land beside the streets: parks, squares, houses, terraces, car parks, yards."""

from __future__ import annotations

import numpy as np

from renderer.canvas import Pose, box
from renderer.furniture import (
    draw_boat,
    draw_clutter,
    draw_container,
    draw_person,
    draw_pole,
    draw_stain,
)
from renderer.scene import Scene
from renderer.streets import park_row
from renderer.vegetation import draw_bush, draw_hedge, draw_shrubs

Region = tuple[Pose, float, float]
"""A rectangle: the pose of its centre, its length ahead and its width to the right in metres."""


def _spot(scene: Scene, region: Region, margin_m: float = 1.0) -> tuple[float, float]:
    pose, length, width = region
    u = scene.rng.uniform(-length / 2 + margin_m, length / 2 - margin_m)
    v = scene.rng.uniform(-width / 2 + margin_m, width / 2 - margin_m)
    x, y = pose.place([[u, v]])[0]
    return float(x), float(y)


def _area(region: Region) -> np.ndarray:
    pose, length, width = region
    return pose.place(box(-length / 2, length / 2, -width / 2, width / 2))


def _free_spot(scene: Scene, x: float, y: float, radius_m: float) -> bool:
    return scene.is_free(Pose(x, y, 0).place(box(-radius_m, radius_m, -radius_m, radius_m)))


def _scatter(scene: Scene, region: Region, count: int) -> None:
    """Scatter clutter, stains, people, lamps and low bushes over free ground."""
    rng = scene.rng
    for _ in range(count):
        x, y = _spot(scene, region)
        if not scene.canvas.in_sight(x, y, 8.0) or not _free_spot(scene, x, y, 1.5):
            continue
        kind = rng.random()
        if kind < 0.55:
            aligned = rng.choice([0, 90]) + rng.normal(0, 3)
            turn = aligned if rng.random() < 0.7 else rng.uniform(0, 180)
            pose = Pose(x, y, region[0].heading_deg + turn)
            draw_clutter(scene.canvas, pose, scene.sun, rng)
        elif kind < 0.7:
            draw_person(scene.canvas, x, y, scene.sun, rng)
        elif kind < 0.8:
            draw_pole(scene.canvas, x, y, scene.sun, rng)
        else:
            draw_bush(scene.canvas, x, y, rng.uniform(0.3, 1.5), scene.sun, rng)


def _plant(scene: Scene, region: Region, count: int) -> None:
    """Plant trees on free ground."""
    for _ in range(count):
        x, y = _spot(scene, region)
        if _free_spot(scene, x, y, 0.5):
            scene.add_tree(x, y, scene.rng.uniform(0.7, 5.0))


def park_land(scene: Scene, region: Region) -> None:
    """Grass or soil with trees, bushes, paths and now and then a parked car."""
    rng = scene.rng
    for _ in range(int(rng.integers(0, 3))):
        start, end = _spot(scene, region), _spot(scene, region)
        tone = rng.uniform(0.45, 0.85)
        scene.canvas.line(np.array([start, end]), rng.uniform(0.8, 3), (tone, tone, tone * 0.95))
    if rng.random() < 0.4:
        pose, length, width = region
        where = pose.moved(rng.uniform(-0.3, 0.3) * length, rng.uniform(-0.3, 0.3) * width)
        bed = where.place(box(-9, 9, -rng.uniform(1, 6), rng.uniform(1, 6)))
        draw_shrubs(scene.canvas, bed, int(rng.integers(20, 120)), scene.sun, rng)
    _scatter(scene, region, int(rng.integers(0, 10)))
    if rng.random() < 0.25:
        x, y = _spot(scene, region)
        if _free_spot(scene, x, y, 2.5):
            scene.add_car(Pose(x, y, rng.uniform(0, 360)))
    _plant(scene, region, int(rng.integers(2, 18)))


def square(scene: Scene, region: Region) -> None:
    """Paving full of things that are not cars."""
    rng = scene.rng
    scene.ground(_area(region), str(rng.choice(["square", "pavement", "lot"])))
    _scatter(scene, region, int(rng.integers(5, 26)))
    _plant(scene, region, int(rng.integers(0, 5)))


def houses(scene: Scene, region: Region) -> None:
    """Detached houses with drives, hedges, sheds and gardens."""
    rng = scene.rng
    pose, length, width = region
    plot, drive_ground = rng.uniform(11, 20), str(rng.choice(["pavement", "square", "lot"]))
    for u in np.arange(-length / 2 + plot / 2, length / 2, plot):
        for v in np.arange(-width / 2 + 9, width / 2 - 3, rng.uniform(18, 26)):
            home = pose.moved(u, v + rng.normal(0, 1), rng.normal(0, 3) + rng.choice([0, 90]))
            size = rng.uniform(7, 12), rng.uniform(6.5, 10)
            built = scene.add_building(home, *size, rng.uniform(4, 9), pitched=rng.random() < 0.85)
            if not built:
                continue
            drive = pose.moved(u + plot / 2 - 2, v - 3 * np.sign(v))
            scene.ground(drive.place(box(-1.6, 1.6, -6, 6)), drive_ground)
            for ahead in (-3.0, 2.6):
                spot = drive.moved(0, ahead, 90 + rng.normal(0, 3))
                if rng.random() < 0.4 and _free_spot(scene, spot.x_m, spot.y_m, 1):
                    scene.add_car(spot)
            if rng.random() < 0.5:
                line = pose.place([[u - plot / 2, v - 8], [u - plot / 2, v + 8]])
                draw_hedge(scene.canvas, line, rng.uniform(0.5, 1.5), scene.sun, rng)
    _scatter(scene, region, int(rng.integers(2, 14)))
    _plant(scene, region, int(rng.integers(1, 10)))


def terrace(scene: Scene, region: Region) -> None:
    """A closed row of houses with steep roofs, and a yard behind with cars and clutter."""
    rng = scene.rng
    pose, length, width = region
    depth, height = rng.uniform(9, 14), rng.uniform(7, 20)
    scene.ground(_area(region), str(rng.choice(["lot", "pavement", "green", "square"])))
    for end in (-1, 1):
        u = -length / 2
        while u < length / 2:
            part = rng.uniform(9, 30)
            row = pose.moved(u + part / 2, end * (width / 2 - depth / 2 - 0.3))
            scene.add_building(
                row, part, depth, height + rng.normal(0, 0.8), pitched=rng.random() < 0.75
            )
            u += part + (rng.uniform(3, 7) if rng.random() < 0.2 else 0.0)
        if rng.random() < 0.5:
            break
    if width > 2 * depth + 8:
        line = pose.moved(0, rng.uniform(-0.1, 0.1) * width)
        if rng.random() < 0.6:
            angle = float(rng.choice([90, -90, 0.1 + 60]))
            _guarded_row(scene, line, (-length / 2, length / 2), angle, rng.uniform(0.1, 0.9))
    _scatter(scene, region, int(rng.integers(2, 12)))
    _plant(scene, region, int(rng.integers(0, 4)))


def _guarded_row(
    scene: Scene, line: Pose, span: tuple[float, float], angle: float, occupied: float
) -> None:
    """Park a row only where its ground is free."""
    row = line.place(box(span[0], span[1], -2.8, 2.8))
    if scene.is_free(row):
        park_row(scene, line, span, angle, occupied)
        scene.reserve(row)


def hall(scene: Scene, region: Region) -> None:
    """One large flat roof, with parking and clutter around it."""
    rng = scene.rng
    pose, length, width = region
    scene.ground(_area(region), str(rng.choice(["lot", "pavement", "green"])))
    size = length * rng.uniform(0.5, 0.9), width * rng.uniform(0.35, 0.75)
    scene.add_building(pose, *size, rng.uniform(4, 25), pitched=rng.random() < 0.15)
    for side in (-1, 1):
        line = pose.moved(0, side * (size[1] / 2 + 3.5))
        if rng.random() < 0.6:
            _guarded_row(scene, line, (-length / 2, length / 2), side * 90.0, rng.uniform(0, 1))
    _scatter(scene, region, int(rng.integers(2, 14)))
    _plant(scene, region, int(rng.integers(0, 5)))


def car_park(scene: Scene, region: Region) -> None:
    """Rows of bays with aisles between, anything from empty to full."""
    rng = scene.rng
    pose, length, width = region
    scene.ground(
        _area(region), str(rng.choice(["lot", "road", "soil", "square"], p=[0.5, 0.2, 0.1, 0.2]))
    )
    occupied = float(
        rng.choice([rng.uniform(0, 0.35), rng.uniform(0.3, 0.95), 1.0], p=[0.35, 0.5, 0.15])
    )
    angle = float(rng.choice([90, 60, 45], p=[0.75, 0.15, 0.1]))
    aisle, v = rng.uniform(5, 7), -width / 2 + 2.8
    while v < width / 2 - 2.5:
        for side in (-1, 1):
            if v > width / 2 - 2.5:
                break
            _guarded_row(scene, pose.moved(0, v), (-length / 2, length / 2), side * angle, occupied)
            if side < 0 and rng.random() < 0.25:
                strip = pose.place(box(-length / 2, length / 2, v - 4.2, v - 2.9))
                scene.ground(strip, "green")
                for u in np.arange(-length / 2, length / 2, rng.uniform(5, 16)):
                    x, y = pose.place([[u, v - 3.5]])[0]
                    scene.add_tree(x, y, rng.uniform(0.7, 3.0))
            v += 5.2 if side > 0 else 5.2 + aisle
    for _ in range(int(rng.integers(0, 5))):
        x, y = _spot(scene, region)
        scene.add_car(Pose(x, y, pose.heading_deg + rng.choice([0.0, 180.0, rng.uniform(0, 360)])))
    for _ in range(int(rng.integers(0, 8))):
        x, y = _spot(scene, region)
        draw_stain(scene.canvas, Pose(x, y, pose.heading_deg + rng.choice([0, 90])), rng)


def yard(scene: Scene, region: Region) -> None:
    """A depot, a marina or a building site: containers, boats, lorries in rows; few cars."""
    rng = scene.rng
    pose, length, width = region
    ground = str(rng.choice(["soil", "lot", "water", "square"]))
    scene.ground(_area(region), ground)
    afloat = ground == "water" or rng.random() < 0.3
    for v in np.arange(-width / 2 + 3, width / 2 - 3, rng.uniform(6, 16)):
        u, step = -length / 2 + 2, rng.uniform(2.7, 5)
        while u < length / 2 - 2:
            here = pose.moved(u, v, 90 + rng.normal(0, 2))
            kind = rng.random()
            if not scene.is_free(here.place(box(-3, 3, -1.3, 1.3))) or kind < 0.2:
                u += step
                continue
            if afloat:
                draw_boat(scene.canvas, here, scene.sun, rng)
            elif kind < 0.65:
                draw_container(scene.canvas, here, scene.sun, rng)
            elif kind < 0.8:
                scene.add_heavy(here, "truck")
            elif ground != "water":
                scene.add_car(here)
            u += step
    if ground != "water":
        _scatter(scene, region, int(rng.integers(3, 16)))


FILLINGS = (park_land, square, houses, terrace, hall, car_park, yard)
SHARES = (0.2, 0.15, 0.16, 0.17, 0.12, 0.14, 0.06)


def fill(scene: Scene, region: Region) -> None:
    """Fill a region with one kind of land use drawn at random."""
    FILLINGS[int(scene.rng.choice(len(FILLINGS), p=SHARES))](scene, region)

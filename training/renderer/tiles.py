"""Tiles: one seed, one picture at the working GSD with the labels of its vehicles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from renderer import blocks, streets
from renderer.camera import WORKING_GSD_M, photograph
from renderer.palette import noise
from renderer.scene import Label, Scene

TILE_M = 64.0
SCENE_PX_PER_M = 10.0
SPARSE = 0.35
"""Share of the tiles with few or no vehicles: real pictures are mostly what is not a car."""

COLUMNS = ("x_px", "y_px", "heading_deg", "length_px", "width_px", "kind", "hidden")


@dataclass(frozen=True)
class Tile:
    """A rendered picture and its vehicles.

    Attributes
    ----------
    image : (H, W, 3) uint8 RGB at 0.20 m a pixel
    labels : (N, 7) float32, columns ``COLUMNS``; the corner of the first pixel is (0, 0)
    """

    image: npt.NDArray[np.uint8]
    labels: npt.NDArray[np.float32]


def _street_scene(scene: Scene) -> None:
    street = streets.single_street(scene, 0.75 * TILE_M)
    low, high = street.edges(streets.DRIVABLE + streets.KERBSIDE)
    for edge, side in ((low, -1), (high, 1)):
        width = scene.rng.uniform(18, 40)
        where = street.pose.moved(0, edge + side * width / 2)
        blocks.fill(scene, (where, 1.5 * TILE_M, width))
        beyond = street.pose.moved(0, edge + side * (width + 12))
        blocks.fill(scene, (beyond, 1.5 * TILE_M, 24))


def _junction_scene(scene: Scene) -> None:
    main, minor = streets.junction(scene, 0.8 * TILE_M)
    kinds = streets.DRIVABLE + streets.KERBSIDE
    wide = [max(abs(edge) for edge in s.edges(kinds)) for s in (main, minor)]
    for ahead in (-1, 1):
        for side in (-1, 1):
            length, width = scene.rng.uniform(18, 34, 2)
            u, v = ahead * (wide[1] + 3 + length / 2), side * (wide[0] + width / 2)
            blocks.fill(scene, (main.pose.moved(u, v), length, width))


def _land_scene(scene: Scene) -> None:
    whole = (scene.centre, 1.45 * TILE_M, 1.45 * TILE_M)
    kinds = [blocks.car_park, blocks.car_park, blocks.yard, blocks.square, blocks.terrace]
    kinds += [blocks.houses, blocks.park_land]
    kinds[int(scene.rng.integers(len(kinds)))](scene, whole)


def render_tile(seed: int | tuple[int, ...], tile_m: float = TILE_M) -> Tile:
    """Return the tile of a seed: the same seed gives the same bytes.

    >>> bool((render_tile(7).image == render_tile(7).image).all())
    True
    """
    rng = np.random.default_rng(seed)
    size = rng.uniform(0.87, 1.15)
    kept = rng.uniform(0.0, 0.4) if rng.random() < SPARSE else 1.0
    scene = Scene(rng, tile_m, SCENE_PX_PER_M, kept=kept)
    ground = str(rng.choice(["green", "soil", "pavement", "lot"], p=[0.5, 0.1, 0.25, 0.15]))
    scene.canvas.image[:] = scene.texture(ground)
    kind = rng.choice([_street_scene, _junction_scene, _land_scene], p=[0.5, 0.22, 0.28])
    kind(scene)
    image, labels = scene.finish()
    image *= 1 + rng.uniform(0, 0.04) * noise(rng, image.shape[0], 250)[..., None]
    picture, gsd_m = photograph(image, 1 / SCENE_PX_PER_M, WORKING_GSD_M / size, rng)
    return Tile(picture, _table(labels, tile_m, gsd_m))


def _table(labels: list[Label], tile_m: float, gsd_m: float) -> npt.NDArray[np.float32]:
    rows = [
        (
            label.x_m / gsd_m,
            label.y_m / gsd_m,
            label.heading_deg,
            label.length_m / gsd_m,
            label.width_m / gsd_m,
            label.kind,
            label.hidden,
        )
        for label in labels
        if 0 <= label.x_m < tile_m and 0 <= label.y_m < tile_m
    ]
    return np.array(rows, np.float32).reshape(-1, len(COLUMNS))

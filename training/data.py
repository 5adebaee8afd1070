"""Rendered tiles in memory, cut, turned and recoloured at random, with the maps to learn."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
from model import REFERENCE_LENGTH_PX, REFERENCE_WIDTH_PX, STRIDE
from torch.utils.data import Dataset

Rng = np.random.Generator
Floats = npt.NDArray[np.float32]

MEAN, SCALE = 0.45 * 255, 1 / (0.25 * 255)
"""The network sees (value - MEAN) * SCALE."""

DOUBTFUL_FROM, UNSEEN_FROM = 0.50, 0.88
"""Hidden shares: below the first a car, between the two it teaches nothing, above it is none."""

SCALES = (0.85, 1.18)
"""How much smaller or larger half of the crops are shown: a stated GSD is seldom exact."""

SIGMA_CELLS = (0.75, 1.3)
"""Width of the peak that marks a centre, for cars and for trucks."""


Tile = tuple[npt.NDArray[np.uint8], Floats]


def read_tiles(folders: list[Path]) -> list[Tile]:
    """Return the rendered tiles of some folders, in the order of their names."""
    paths = [path for folder in folders for path in sorted(folder.glob("*.npy"))]
    return [(read_picture(path.with_suffix(".png")), np.load(path)) for path in paths]


def read_picture(path: Path) -> npt.NDArray[np.uint8]:
    """Return a picture as (H, W, 3) RGB."""
    picture = cv2.imread(str(path), cv2.IMREAD_COLOR)
    assert picture is not None, f"cannot read {path}"
    return np.ascontiguousarray(picture[..., ::-1])


def crop(
    image: npt.NDArray[np.uint8], labels: Floats, side: int, rng: Rng
) -> tuple[npt.NDArray[np.uint8], Floats]:
    """Return a random square crop, scaled, turned and mirrored, with its labels."""
    height, width = image.shape[:2]
    scale = rng.uniform(*SCALES) if rng.random() < 0.5 else 1.0
    window = min(round(side / scale), height, width)
    scale = side / window
    x0, y0 = int(rng.integers(0, width - window + 1)), int(rng.integers(0, height - window + 1))
    picture, table = image[y0 : y0 + window, x0 : x0 + window], labels.copy()
    if window != side:
        way = cv2.INTER_AREA if window > side else cv2.INTER_LINEAR
        picture = cv2.resize(picture, (side, side), interpolation=way)
    table[:, 0] = (table[:, 0] - x0) * scale
    table[:, 1] = (table[:, 1] - y0) * scale
    table[:, 3:5] *= scale
    if rng.random() < 0.5:
        picture = picture[:, ::-1]
        table[:, 0], table[:, 2] = side - table[:, 0], -table[:, 2]
    for _ in range(int(rng.integers(4))):
        picture = picture.transpose(1, 0, 2)[:, ::-1]
        table[:, 0], table[:, 1] = side - table[:, 1], table[:, 0].copy()
        table[:, 2] += 90
    return np.ascontiguousarray(picture), table


def recolour(image: npt.NDArray[np.uint8], rng: Rng) -> Floats:
    """Return the normalised picture after a random change of tone, colour and sharpness."""
    tones = np.arange(256, dtype=np.float32)[:, None] / 255
    if rng.random() < 0.5:
        tones = tones ** np.float32(rng.uniform(0.7, 1.4))
    tones = tones * rng.uniform(0.85, 1.15, 3).astype(np.float32)
    tones = (tones - 0.45) * np.float32(rng.uniform(0.7, 1.2)) + np.float32(
        0.45 + rng.uniform(-0.08, 0.08)
    )
    tones = (np.clip(tones, 0, 1) * 255 - MEAN) * np.float32(SCALE)
    picture = np.asarray(cv2.LUT(image, np.ascontiguousarray(tones[None])), np.float32)
    kind = rng.random()
    if kind < 0.06:
        picture[:] = picture.mean(axis=2, keepdims=True)
    elif kind < 0.10:
        picture = picture[..., rng.permutation(3)]
    elif kind < 0.20:
        picture = cv2.GaussianBlur(picture, (0, 0), rng.uniform(0.4, 1.0))
    if rng.random() < 0.3:
        picture += rng.standard_normal(picture.shape, np.float32) * np.float32(rng.uniform(0, 0.08))
    return picture


def targets(labels: Floats, side: int) -> tuple[Floats, Floats, Floats]:
    """Return the maps of one picture.

    Returns
    -------
    heat : (2, S, S) peaks of height 1 at the centres of cars and trucks
    shape : (6, S, S) offset in cells, log size, cos and sin of twice the angle
    weight : (2, S, S) where the peaks count, and how much the shape counts
    """
    cells = side // STRIDE
    heat = np.zeros((2, cells, cells), np.float32)
    shape = np.zeros((6, cells, cells), np.float32)
    weight = np.stack([np.ones((cells, cells), np.float32), np.zeros((cells, cells), np.float32)])
    for x, y, heading, length, width, kind, hidden in labels:
        column, row = x / STRIDE - 0.5, y / STRIDE - 0.5
        if not (-0.5 <= column < cells - 0.5 and -0.5 <= row < cells - 0.5):
            continue
        if hidden >= UNSEEN_FROM:
            continue
        reach = 4
        x0, x1 = max(int(column) - reach, 0), min(int(column) + reach + 2, cells)
        y0, y1 = max(int(row) - reach, 0), min(int(row) + reach + 2, cells)
        dx = column - np.arange(x0, x1, dtype=np.float32)[None, :]
        dy = row - np.arange(y0, y1, dtype=np.float32)[:, None]
        bump = np.exp(-(dx**2 + dy**2) / (2 * SIGMA_CELLS[int(kind)] ** 2))
        window = (slice(y0, y1), slice(x0, x1))
        if hidden >= DOUBTFUL_FROM:
            weight[0][window][bump > 0.2] = 0
            continue
        near = (min(max(round(row), 0), cells - 1), min(max(round(column), 0), cells - 1))
        heat[int(kind)][window] = np.maximum(heat[int(kind)][window], bump)
        heat[int(kind)][near] = 1
        closer = (bump > 0.3) & (bump > weight[1][window])
        closer |= bump >= bump.max()
        angle = np.radians(2 * heading)
        sizes = np.log(length / REFERENCE_LENGTH_PX), np.log(width / REFERENCE_WIDTH_PX)
        values = np.empty((6, *bump.shape), np.float32)
        values[0], values[1] = dx, dy
        values[2:] = np.reshape((*sizes, np.cos(angle), np.sin(angle)), (4, 1, 1))
        np.copyto(shape[(slice(None), *window)], values, where=closer)
        weight[1][window][closer] = bump[closer]
    return heat, shape, weight


class Crops(Dataset[tuple[Floats, Floats, Floats, Floats]]):
    """Crops of tiles: (image, heat, shape, weight), each tile once in every pass over them.

    A crop follows from the seed and its place alone, so it is the same in whatever process it is
    made.

    Parameters
    ----------
    tiles : pictures and labels
    count : how many crops there are
    side : of a crop, in pixels
    """

    def __init__(self, tiles: list[Tile], count: int, side: int, seed: int) -> None:
        self.tiles = tiles
        self.count = count
        self.side = side
        self.seed = seed

    def __len__(self) -> int:
        return self.count

    def __getitem__(self, place: int) -> tuple[Floats, Floats, Floats, Floats]:
        turn, number = divmod(place, len(self.tiles))
        order = np.random.default_rng((self.seed, turn)).permutation(len(self.tiles))
        rng = np.random.default_rng((self.seed, turn, number))
        image, labels = crop(*self.tiles[order[number]], self.side, rng)
        picture = np.ascontiguousarray(recolour(image, rng).transpose(2, 0, 1))
        return picture, *targets(labels, self.side)

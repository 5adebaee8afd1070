"""Render a set of tiles into a folder: one PNG and one label array for each seed."""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from renderer.tiles import render_tile


def render_to(folder: Path, seed: int, index: int) -> int:
    """Render tile ``index`` of a set and write it, unless it is there; return its vehicles."""
    picture = folder / f"{index:05d}.png"
    table = folder / f"{index:05d}.npy"
    if not table.exists():
        cv2.setNumThreads(1)
        tile = render_tile((seed, index))
        cv2.imwrite(str(picture), tile.image[..., ::-1])
        partial_table = table.with_suffix(".part")
        with partial_table.open("wb") as stream:
            np.save(stream, tile.labels)
        partial_table.replace(table)
        return len(tile.labels)
    return len(np.load(table))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--tiles", type=int, default=3000)
    parser.add_argument("--first", type=int, default=0, help="index of the first tile")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    indices = range(options.first, options.first + options.tiles)
    work = partial(render_to, options.folder, options.seed)
    with ProcessPoolExecutor(options.workers) as pool:
        vehicles = sum(pool.map(work, indices, chunksize=8))
    print(f"{options.tiles} tiles, {vehicles} vehicles in {options.folder}")


if __name__ == "__main__":
    main()

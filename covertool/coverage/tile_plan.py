"""Which square tiles cover a country, and how large they are."""

from __future__ import annotations

import math
from dataclasses import dataclass

from covertool.model import Bounds

ANCHORS_IN_TILE = 100_000
"""Anchors that a tile holds about, when its size is left open."""


@dataclass(frozen=True)
class TilePlan:
    """Square tiles over bounds, numbered along rows from the lower left."""

    bounds: Bounds
    tile_m: float
    columns: int
    rows: int

    def __len__(self) -> int:
        return self.columns * self.rows

    def square(self, tile: int) -> Bounds:
        """Return the bounds of a tile.

        >>> plan_tiles((0.0, 0.0, 25.0, 10.0), 10.0).square(2)
        (20.0, 0.0, 30.0, 10.0)
        """
        row, column = divmod(tile, self.columns)
        x, y = self.bounds[0], self.bounds[1]
        size = self.tile_m
        return (x + column * size, y + row * size, x + (column + 1) * size, y + (row + 1) * size)


def plan_tiles(bounds: Bounds, tile_m: float) -> TilePlan:
    """Return the plan of square tiles that cover bounds."""
    x0, y0, x1, y1 = bounds
    columns = max(math.floor((x1 - x0) / tile_m) + 1, 1)
    rows = max(math.floor((y1 - y0) / tile_m) + 1, 1)
    return TilePlan(bounds, tile_m, columns, rows)


def tile_size_m(bounds: Bounds, anchors: int, largest_radius_m: float) -> float:
    """Return the side of tiles that hold about ``ANCHORS_IN_TILE`` anchors each.

    The tiles are as large as they can be without one more along the longer side: what a last one
    would hold of a quarter or less is shared among the others. A side is never less than twice
    the largest radius: beneath that, the halo is most of the work.

    Examples
    --------
    >>> round(tile_size_m((0.0, 0.0, 1000.0, 1000.0), 400_000, 15.0), 3)
    500.0
    >>> round(tile_size_m((0.0, 0.0, 1000.0, 1000.0), 500_000, 15.0), 3)
    500.0
    """
    width, height = max(bounds[2] - bounds[0], 1.0), max(bounds[3] - bounds[1], 1.0)
    longer = max(width, height)
    share = min(ANCHORS_IN_TILE / max(anchors, 1), 1.0)
    wished = math.sqrt(width * height * share) if share < 1 else longer
    columns = math.ceil(longer / wished - 0.25)
    return max(longer * (1 + 1e-9) / columns, 2 * largest_radius_m)

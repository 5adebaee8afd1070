"""A picture cut into equal overlapping blocks, each place owned by one of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass


@dataclass(frozen=True)
class Block:
    """A square of the picture and the part of it that it owns, in pixels of the picture.

    Attributes
    ----------
    x0, y0 : its upper left corner
    size : its side
    own_x, own_y : first and one past the last pixel that it owns along each axis
    """

    x0: int
    y0: int
    size: int
    own_x: tuple[int, int]
    own_y: tuple[int, int]


def _spans(extent: int, size: int, margin: int) -> list[tuple[int, tuple[int, int]]]:
    """Return the starts of the blocks along one axis and what each owns."""
    step = size - 2 * margin
    count = max(1, -(-(extent - 2 * margin) // step))
    starts = [i * step for i in range(count)]
    cuts = [0, *(start + margin for start in starts[1:]), extent]
    return [(start, (cuts[i], cuts[i + 1])) for i, start in enumerate(starts)]


def blocks(height: int, width: int, size: int, margin: int) -> Iterator[Block]:
    """Yield blocks that cover a picture, overlapping by twice the margin.

    >>> [(b.x0, b.own_x) for b in blocks(100, 200, 120, 10)]
    [(0, (0, 110)), (100, (110, 200))]
    """
    for y0, own_y in _spans(height, size, margin):
        for x0, own_x in _spans(width, size, margin):
            yield Block(x0, y0, size, own_x, own_y)

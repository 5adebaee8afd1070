"""Discs in uniform grids, one grid for each class of radii, stored cell by cell."""

# mypy: disable-error-code="no-untyped-def,no-untyped-call"

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from covertool.coverage.compiled import borrowing
from covertool.coverage.gathering import gathered
from covertool.model import Floats, Integers


@dataclass(frozen=True)
class DiscGrid:
    """Distinct discs, sorted by class of radii (largest first) and by grid cell.

    Attributes
    ----------
    discs : (N, 4) local x, y, radius and weight
    source : (N,) the row of the input that each disc stands for
    shape : (K, 3) for each class its columns, its rows, and the place of its cells in ``first``
    place : (K, 4) for each class its lower left x and y, its cell size and its largest radius
    first : the discs of cell c of class k are ``first[shape[k, 2] + c]`` up to the next entry
    """

    discs: Floats
    source: Integers
    shape: Integers
    place: Floats
    first: Integers


def disc_grid(x_m: Floats, y_m: Floats, radius_m: Floats, weights: Floats) -> DiscGrid:
    """Return discs in grids; identical ones (same x, y and radius) become one with their weight.

    A class holds the radii between two powers of two. Its cells are about two discs wide, at
    most two radii: ``min(sqrt(2 A / n), 2 r)`` for n discs in a box of area A.

    Examples
    --------
    >>> two = np.ones(2)
    >>> disc_grid(two, two, 5 * two, two).discs.tolist()
    [[1.0, 1.0, 5.0, 2.0]]
    """
    discs, source = _merge(
        np.ascontiguousarray(np.column_stack([x_m, y_m, radius_m]) + 0.0),
        np.ascontiguousarray(weights),
    )
    octave = np.floor(np.log2(discs[:, 2])).astype(np.int64)
    shape, place = [], []
    cell, cells = np.zeros(len(discs), np.int64), 0
    for one in np.unique(octave)[::-1]:
        members = octave == one
        x, y, radius = discs[members, 0], discs[members, 1], discs[members, 2].max()
        low_x, low_y, size, columns, rows = _layout(x, y, radius)
        column, row = (np.floor((at - low) / size) for at, low in ((x, low_x), (y, low_y)))
        cell[members] = cells + row.astype(np.int64) * columns + column.astype(np.int64)
        shape.append((columns, rows, cells))
        place.append((low_x, low_y, size, radius))
        cells += columns * rows
    order, first = gathered(cell, cells)
    return DiscGrid(
        np.ascontiguousarray(discs[order]),
        source[order],
        np.array(shape, dtype=np.int64).reshape(-1, 3),
        np.array(place, dtype=float).reshape(-1, 4),
        first,
    )


def _layout(x: Floats, y: Floats, radius: float) -> tuple[float, float, float, int, int]:
    """Return the lower left corner, cell size, columns and rows of a grid over points."""
    low_x, low_y = float(x.min()), float(y.min())
    width, height = float(x.max()) - low_x, float(y.max()) - low_y
    area = max(width, 2 * radius) * max(height, 2 * radius)
    # Never so small that a sparse table has many more cells than discs.
    smallest = np.sqrt(area / max(8 * x.size, 1 << 14))
    size = float(max(min(np.sqrt(2 * area / x.size), 2 * radius), smallest))
    return low_x, low_y, size, int(width / size) + 1, int(height / size) + 1


def _merge(discs: Floats, weights: Floats) -> tuple[Floats, Integers]:
    """Return the distinct discs with the sum of their weights, and the first row of each."""
    n = len(discs)
    table = np.full(1 << (max(2 * n, 16) - 1).bit_length(), -1, np.int64)
    merged, source = np.empty((n, 4)), np.empty(n, np.int64)
    found = _merge_into(discs, discs.view(np.uint64), weights, table, merged, source)
    return merged[:found], source[:found]


@borrowing
def _merge_into(discs, bits, weights, table, merged, source):
    """Write the distinct discs, by a hash table of their bits; return their number."""
    slots, found = table.size, 0
    for i in range(discs.shape[0]):
        key = bits[i, 0] * np.uint64(0x9E3779B97F4A7C15)
        key = (key ^ (key >> np.uint64(29)) ^ bits[i, 1]) * np.uint64(0xBF58476D1CE4E5B9)
        key = (key ^ (key >> np.uint64(32)) ^ bits[i, 2]) * np.uint64(0x94D049BB133111EB)
        slot = np.int64((key ^ (key >> np.uint64(31))) & np.uint64(slots - 1))
        while table[slot] >= 0:
            at = table[slot]
            if (
                merged[at, 0] == discs[i, 0]
                and merged[at, 1] == discs[i, 1]
                and merged[at, 2] == discs[i, 2]
            ):
                break
            slot = (slot + 1) % slots
        if table[slot] < 0:
            table[slot] = found
            merged[found, 0], merged[found, 1] = discs[i, 0], discs[i, 1]
            merged[found, 2], merged[found, 3] = discs[i, 2], 0.0
            source[found] = i
            found += 1
        merged[table[slot], 3] += weights[i]
    return found

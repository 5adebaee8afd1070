"""Rows are the cars of a step within runs; what is kept from step to step is of all cars."""

from __future__ import annotations

import numpy as np

from covertool.model import Floats
from covertool.positioning.kernel import kernel
from covertool.positioning.noise import Indices


@kernel
def rows_of(kept: Floats, car: Indices) -> Floats:
    """Return the rows (runs * cars, k) of some cars from what is kept of all (runs, all, k)."""
    runs, n, k = kept.shape[0], car.size, kept.shape[2]
    rows = np.empty((runs * n, k))
    for r in range(runs):
        for i in range(n):
            for c in range(k):
                rows[r * n + i, c] = kept[r, car[i], c]
    return rows


@kernel
def keep_rows(kept: Floats, car: Indices, rows: Floats) -> None:
    """Write the rows (runs * cars, k) of some cars to what is kept of all (runs, all, k)."""
    n = car.size
    for r in range(kept.shape[0]):
        for i in range(n):
            for c in range(kept.shape[2]):
                kept[r, car[i], c] = rows[r * n + i, c]

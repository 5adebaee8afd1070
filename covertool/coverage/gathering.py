"""Rows gathered by a small whole number, such as the cell or the node where each of them lies."""

# mypy: disable-error-code="no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np

from covertool.coverage.compiled import borrowing
from covertool.model import Integers


def gathered(key: Integers, keys: int) -> tuple[Integers, Integers]:
    """Return the rows key by key, and where those of each key begin: ``order, first``.

    A counting sort: rows of one key keep their order. The rows of key k are
    ``order[first[k]:first[k + 1]]``.

    Parameters
    ----------
    key : (N,) of 0 to keys - 1

    Examples
    --------
    >>> order, first = gathered(np.array([2, 0, 2]), 3)
    >>> order.tolist(), first.tolist()
    ([1, 0, 2], [0, 1, 1, 3])
    """
    order = np.empty(key.size, np.int64)
    first = np.append(0, np.cumsum(np.bincount(key, minlength=keys))).astype(np.int64)
    _place(key, first[:-1].copy(), order)
    return order, first


@borrowing
def _place(key, place, order):
    """Write each row to the next place of its key."""
    for i in range(key.size):
        order[place[key[i]]] = i
        place[key[i]] += 1

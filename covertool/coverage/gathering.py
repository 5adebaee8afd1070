"""Rows gathered by a small whole number, such as the cell or the node where each of them lies."""

# mypy: disable-error-code="no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np

from covertool.coverage.compiled import compiled


@compiled
def gathered(key, keys):
    """Return the rows key by key, and where those of each key begin: ``order, first``.

    A counting sort: rows of one key keep their order. The rows of key k are
    ``order[first[k]:first[k + 1]]``.
    """
    first = np.zeros(keys + 1, np.int64)
    for i in range(key.size):
        first[key[i] + 1] += 1
    for k in range(keys):
        first[k + 1] += first[k]
    order, place = np.empty(key.size, np.int64), first[:-1].copy()
    for i in range(key.size):
        order[place[key[i]]] = i
        place[key[i]] += 1
    return order, first

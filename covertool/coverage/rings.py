"""Level boundaries to closed rings, by following them from node to node.

Boundaries meet in points of the same bits, so a node is found by equality, not by nearness.
"""

# mypy: disable-error-code="no-untyped-def,no-untyped-call"

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from covertool.coverage.compiled import compiled
from covertool.coverage.gathering import gathered
from covertool.model import Floats, Integers

TIE_M = 1e-7
"""Nodes nearer than this are taken as one where more than two circles meet in a point."""


def node_numbers(starts: Floats, ends: Floats, sides: Integers) -> tuple[Integers, Integers]:
    """Return the node at the start and at the end of each boundary.

    ``sides`` (N, 2) are the levels on the left and on the right. If some level's boundaries do
    not enter each node as often as they leave it, nodes within 1e-7 m of each other are joined:
    several circles meet there in one point, and rounding has told their order differently.
    """
    points = np.concatenate([starts, ends]) + 0.0
    keys = np.ascontiguousarray(points).view(np.complex128).ravel()
    places, number = np.unique(keys, return_inverse=True)
    number = number.astype(np.int64)
    start, end = number[: len(starts)], number[len(starts) :]
    if np.any(_imbalance(start, end, sides, len(places))):
        label = _clusters(places)
        return label[start], label[end]
    return start, end


def _clusters(places: npt.NDArray[np.complex128]) -> Integers:
    """Return one number for all places that are nearer to each other than a tie."""
    # Imported here because ties are rare and scipy would slow every start.
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    tree = cKDTree(np.column_stack([places.real, places.imag]))
    pairs = tree.query_pairs(TIE_M, output_type="ndarray")
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(places),) * 2)
    label: Integers = connected_components(links, directed=False)[1].astype(np.int64)
    return label


def _imbalance(
    start: Integers, end: Integers, sides: Integers, nodes: int
) -> npt.NDArray[np.bool_]:
    """Return whether each node has a level whose boundaries do not balance there."""
    wrong = np.zeros(nodes, dtype=bool)
    for level in (1, 2, 3):
        flow = (sides[:, 0] == level).astype(float) - (sides[:, 1] == level)
        out, into = np.bincount(start, flow, nodes), np.bincount(end, flow, nodes)
        wrong |= out != into
    return wrong


@compiled
def join_runs(start, end, owner, sides, nodes):
    """Return the first boundary of each run and, for each boundary, the next one or -1.

    Boundaries of the same owner and sides follow one another through nodes where nothing else
    meets; owner -1 joins nothing. A closed run begins at its lowest boundary.
    """
    n = start.size
    degree, leaving = np.zeros(nodes, np.int64), np.full(nodes, -1, np.int64)
    for i in range(n):
        degree[start[i]] += 1
        degree[end[i]] += 1
        leaving[start[i]] = i
    following, has_previous = np.full(n, -1, np.int64), np.zeros(n, np.bool_)
    for i in range(n):
        j = leaving[end[i]]
        alone = owner[i] >= 0 and degree[end[i]] == 2 and j >= 0 and j != i
        if alone and owner[j] == owner[i] and np.all(sides[i] == sides[j]):
            following[i], has_previous[j] = j, True
    heads, count, seen = np.empty(n, np.int64), 0, np.zeros(n, np.bool_)
    for closed in range(2):
        for i in range(n):
            if seen[i] or (closed == 0 and has_previous[i]):
                continue
            heads[count] = i
            count += 1
            j = i
            while j >= 0 and not seen[j]:
                seen[j] = True
                last, j = j, following[j]
            following[last] = -1
    return heads[:count], following


def follow(
    tail: Integers, head: Integers, out_angle: Floats, in_angle: Floats, nodes: int
) -> tuple[Integers, Integers]:
    """Return rings as a list of directed boundaries and the number of each ring's first.

    At a node where the level touches itself the ring takes the sharpest turn to the left, and so
    goes round the same piece of the level; a ring that comes back to one of its own nodes is cut
    there. ``out_angle`` is the direction in which a boundary leaves its tail, ``in_angle`` the
    one that points back from its head.
    """
    rings: tuple[Integers, Integers]
    rings = _follow(tail, head, out_angle, in_angle, *gathered(tail, nodes))
    return rings


@compiled
def _follow(tail, head, out_angle, in_angle, leaving, first):
    """Return the rings; the boundaries that leave node v are ``leaving[first[v]:first[v + 1]]``."""
    n = tail.size
    used, seen_at = np.zeros(n, np.bool_), np.full(first.size - 1, -1, np.int64)
    path, order = np.empty(n, np.int64), np.empty(n, np.int64)
    ring_first, rings, written = np.empty(n + 1, np.int64), 0, 0
    for begin in range(n):
        depth, i = 0, begin
        while i >= 0 and not used[i]:
            used[i] = True
            seen_at[tail[i]] = depth
            path[depth] = i
            depth += 1
            back = seen_at[head[i]]
            if back >= 0:
                ring_first[rings] = written
                rings += 1
                for p in range(back, depth):
                    order[written] = path[p]
                    written += 1
                    seen_at[tail[path[p]]] = -1
                depth = back
                if back > 0:
                    seen_at[head[i]] = -1
            v, here, i = head[i], i, -1
            best = 100.0
            for at in range(first[v], first[v + 1]):
                if not used[leaving[at]]:
                    turn = (in_angle[here] - out_angle[leaving[at]]) % (2.0 * math.pi)
                    turn = turn if turn > 1e-12 else 2.0 * math.pi
                    if turn < best:
                        best, i = turn, leaving[at]
        for p in range(depth):
            seen_at[tail[path[p]]] = -1
    ring_first[rings] = written
    return order[:written], ring_first[: rings + 1]

"""The graph of a network whose nodes are edges: connected parts, shortest routes, circuits."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from covertool.model import Floats
from covertool.traffic.edges import Network

U_TURN_S = 30.0
"""What a U-turn costs a route, so that cars only turn where they must."""

_CELLS_A_BLOCK = 4_000_000
"""How many costs are held at once."""

Indices = npt.NDArray[np.int64]


@dataclass(frozen=True)
class StreetGraph:
    """Some edges of a network by number, and the turns between them.

    Attributes
    ----------
    names : ids of the edges, sorted
    start, end : (T,) numbers of the edges that each turn joins
    cost_s : (T,) seconds to drive the second edge, more for a U-turn
    u_turn : (T,) True where a turn leads back along the same street
    length_m, drive_s : (N,) of the edges
    """

    names: tuple[str, ...]
    start: Indices
    end: Indices
    cost_s: Floats
    u_turn: npt.NDArray[np.bool_]
    length_m: Floats
    drive_s: Floats = field(repr=False)

    @classmethod
    def of(cls, network: Network, edges: Iterable[str] | None = None) -> StreetGraph:
        """Return the graph of some edges of a network, or of all."""
        names = tuple(sorted(network.edges if edges is None else set(edges)))
        number = {name: k for k, name in enumerate(names)}
        turns = [
            (number[name], number[following])
            for name in names
            for following in network.successors[name]
            if following in number
        ]
        start, end = np.array(turns, dtype=np.int64).reshape(-1, 2).T
        chosen = [network.edges[name] for name in names]
        origins = np.array([edge.from_junction for edge in chosen], dtype=object)
        goals = np.array([edge.to_junction for edge in chosen], dtype=object)
        u_turn = (origins[start] == goals[end]).astype(bool)
        length_m = np.array([edge.length_m for edge in chosen])
        drive_s = length_m / np.array([edge.speed_limit for edge in chosen])
        cost_s = drive_s[end] + np.where(u_turn, U_TURN_S, 0.0)
        return cls(names, start, end, cost_s, u_turn, length_m, drive_s)

    def routes(self, pairs: Sequence[tuple[int, int]]) -> list[tuple[int, ...]]:
        """Return the fastest route of each pair of edges, both included; empty when none."""
        goals: dict[int, set[int]] = {}
        for origin, goal in pairs:
            goals.setdefault(origin, set()).add(goal)
        found = {
            (origin, goal): self._walk(before, origin, goal)
            for origin, _, before in self._trees(sorted(goals))
            for goal in goals[origin]
        }
        return [found[pair] for pair in pairs]

    def _trees(self, origins: Sequence[int]) -> Iterator[tuple[int, Floats, npt.NDArray[np.int32]]]:
        """Yield each origin with the costs to all edges and the edge before each on the way."""
        from scipy.sparse.csgraph import dijkstra

        matrix, size = self._matrix(), max(_CELLS_A_BLOCK // len(self.names), 1)
        for first in range(0, len(origins), size):
            block = list(origins[first : first + size])
            cost_s, before = dijkstra(matrix, indices=block, return_predecessors=True)
            yield from zip(block, cost_s, before, strict=True)

    @staticmethod
    def _walk(before: npt.NDArray[np.int32], origin: int, goal: int) -> tuple[int, ...]:
        route = [goal]
        while route[-1] != origin:
            previous = int(before[route[-1]])
            if previous < 0:
                return ()
            route.append(previous)
        return tuple(reversed(route))

    def largest(self) -> Indices:
        """Return the edges of the strongly connected part with the most street length."""
        from scipy.sparse.csgraph import connected_components

        _, label = connected_components(self._matrix(), connection="strong")
        lengths_m = np.bincount(label, weights=self.length_m)
        return np.flatnonzero(label == int(np.argmax(lengths_m))).astype(np.int64)

    def without_u_turns(self) -> StreetGraph:
        """Return the same edges with all turns but the U-turns."""
        kept = ~self.u_turn
        return replace(
            self,
            start=self.start[kept],
            end=self.end[kept],
            cost_s=self.cost_s[kept],
            u_turn=self.u_turn[kept],
        )

    def rings(self, edges: Iterable[int]) -> Iterator[tuple[int, ...]]:
        """Yield for each edge the fastest way back to it, if there is one."""
        for origin, cost_s, before in self._trees(list(edges)):
            last = self.start[self.end == origin]
            reached = last[np.isfinite(cost_s[last])]
            if reached.size:
                yield self._walk(before, origin, int(reached[np.argmin(cost_s[reached])]))

    def _matrix(self) -> object:
        from scipy.sparse import csr_matrix

        size = len(self.names)
        return csr_matrix((self.cost_s, (self.start, self.end)), shape=(size, size))


def largest_component(network: Network, edges: Iterable[str] | None = None) -> tuple[str, ...]:
    """Return the ids of the largest strongly connected part of some edges, or of all."""
    graph = StreetGraph.of(network, edges)
    if not graph.names:
        return ()
    return tuple(graph.names[k] for k in graph.largest())

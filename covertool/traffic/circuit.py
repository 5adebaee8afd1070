"""The street circuit: the through roads of a town, or one ring of streets."""

from __future__ import annotations

import logging
from collections.abc import Iterable

from covertool.errors import GeometryError
from covertool.traffic.edges import Network
from covertool.traffic.graph import StreetGraph, largest_component
from covertool.traffic.streets import MAIN_KINDS

_LOG = logging.getLogger(__name__)
THROUGH_KINDS = frozenset(
    {
        *MAIN_KINDS,
        *(
            f"highway.{kind}{link}"
            for kind in ("primary", "secondary", "tertiary")
            for link in ("", "_link")
        ),
    }
)
RING_M = 1000.0
"""The paper does not print the length of its campus circuit."""
_LEAST_SHARE = 0.5
"""A part that holds less than this share of the streets is no town's circuit."""
_CANDIDATES = 400


def through_roads(network: Network) -> tuple[str, ...]:
    """Return the through roads of a town, as far as each can be reached from every other.

    The paper's circuit is "mostly composed by secondary and tertiary roads". Where the net's types
    name no such roads, or these fall apart, all of its streets make the circuit.

    Raises
    ------
    GeometryError
        When the streets of the net are only weakly connected.
    """
    main = [name for name, edge in network.edges.items() if _is_through(edge.kind)]
    kept = largest_component(network, main)
    if main and length_m(network, kept) >= _LEAST_SHARE * length_m(network, main):
        return kept
    _LOG.info("%s: no connected through roads; all streets make the circuit", network.path)
    everything = largest_component(network)
    share = length_m(network, everything) / length_m(network, network.edges)
    if share < _LEAST_SHARE:
        raise GeometryError(
            f"the net is only weakly connected: cars can drive there and back on {share:.0%} of it",
            str(network.path),
            "mend its one-way streets and turns, or drive your own routes with --routes",
        )
    return everything


def _is_through(kind: str) -> bool:
    """Return True for a through road; netconvert joins the types of merged edges by a bar."""
    return not THROUGH_KINDS.isdisjoint(kind.split("|"))


def length_m(network: Network, edges: Iterable[str]) -> float:
    """Return the summed length of edges."""
    return float(sum(network.edges[name].length_m for name in edges))


def closed_circuit(network: Network, *, target_m: float = RING_M) -> tuple[str, ...]:
    """Return the ring of streets whose length is nearest to a target.

    Of a spread of edges, the fastest way back to each without a U-turn and without a street that
    is driven both ways. Nothing but the length decides, so no ring is picked for its result.

    Raises
    ------
    GeometryError
        When the network has no ring.
    """
    graph = StreetGraph.of(network, largest_component(network)).without_u_turns()
    best: tuple[float, tuple[str, ...]] | None = None
    step = max(len(graph.names) // _CANDIDATES, 1)
    for ring in graph.rings(range(0, len(graph.names), step)):
        names = tuple(graph.names[edge] for edge in ring)
        if _is_simple(network, names):
            gap_m = abs(length_m(network, names) - target_m)
            if best is None or gap_m < best[0]:
                best = gap_m, names
    if best is None:
        raise GeometryError(
            "the net has no ring of streets on which cars could drive round",
            str(network.path),
            "choose --scenario town, or drive your own routes with --routes",
        )
    return best[1]


def _is_simple(network: Network, ring: tuple[str, ...]) -> bool:
    junctions = [network.edges[name].from_junction for name in ring]
    return len(set(junctions)) == len(junctions)

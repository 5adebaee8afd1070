"""Which anchors stand along the streets that cars drive."""

from __future__ import annotations

from collections.abc import Iterable

from covertool.model import Anchors
from covertool.traffic.network import Network

ALONG_M = 15.0
"""The paper takes parked cars within 15 m of the circuit."""


def anchors_along(
    anchors: Anchors, network: Network, edges: Iterable[str], *, distance_m: float = ALONG_M
) -> Anchors:
    """Return the anchors within a distance of the middle lines of some edges.

    Raises
    ------
    GeometryError
        When all anchors lie outside the net (both boxes are told), or none is near the edges.
    """
    raise NotImplementedError

"""Which anchors stand along the streets that cars drive."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import shapely

from covertool.errors import GeometryError
from covertool.model import Anchors, Bounds
from covertool.traffic.edges import Network

ALONG_M = 15.0
"""The paper takes parked cars within 15 m of the circuit."""


def anchors_along(
    anchors: Anchors, network: Network, edges: Iterable[str], *, distance_m: float = ALONG_M
) -> Anchors:
    """Return the anchors within a distance of the middle lines of some edges.

    Parameters
    ----------
    anchors : in the CRS of the network
    edges : ids, such as the circuit of a mobility or the routes of its cars

    Raises
    ------
    GeometryError
        When all anchors lie outside the net (both boxes are told), or none is near the edges.
    """
    require_inside(anchors, network)
    lines = np.asarray(
        [shapely.LineString(network.edges[name].shape) for name in dict.fromkeys(edges)],
        dtype=object,
    )
    places = np.asarray(shapely.points(anchors.x_m, anchors.y_m), dtype=object)
    tree = shapely.STRtree(lines)
    near = np.unique(tree.query(places, predicate="dwithin", distance=distance_m)[0])
    if not near.size:
        raise GeometryError(
            f"no anchor stands within {distance_m:g} m of a street that cars drive",
            f"{len(anchors)} anchors, {len(lines)} streets",
            "take other streets, or anchors nearer to them",
        )
    return anchors.take(near)


def require_inside(anchors: Anchors, network: Network) -> None:
    """Refuse anchors of which none lies within the net's box."""
    if not len(anchors):
        raise GeometryError("there are no anchors", "anchors", "name a layer that holds some")
    x0, y0, x1, y1 = network.bounds_m
    inside = (anchors.x_m >= x0) & (anchors.x_m <= x1) & (anchors.y_m >= y0) & (anchors.y_m <= y1)
    if not inside.any():
        box = (anchors.x_m.min(), anchors.y_m.min(), anchors.x_m.max(), anchors.y_m.max())
        raise GeometryError(
            "all anchors lie outside the net",
            f"anchors {_told(box)}; net {_told(network.bounds_m)}",
            "check the CRS of both: --crs of the anchors, --net-crs of the net",
        )


def _told(box: Bounds) -> str:
    x0, y0, x1, y1 = box
    return f"x {x0:.0f} to {x1:.0f}, y {y0:.0f} to {y1:.0f}"

"""Which anchors stand along the streets that cars drive."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import shapely

from covertool.errors import GeometryError
from covertool.model import Anchors, Floats
from covertool.model.tables import within
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
    if not within(anchors.x_m, anchors.y_m, network.bounds_m).any():
        box = box_text(anchors.x_m, anchors.y_m)
        net = box_text(np.array([x0, x1]), np.array([y0, y1]))
        raise GeometryError(
            "all anchors lie outside the net",
            f"anchors {box}; net {net}",
            "check the CRS of both: --crs of the anchors, --net-crs of the net",
        )


def box_text(x_m: Floats, y_m: Floats) -> str:
    """Return the box of places in words.

    >>> box_text(np.array([0.0, 9.6]), np.array([5.0, 7.0]))
    'x 0 to 10, y 5 to 7'
    """
    if not x_m.size:
        return "no box"
    return f"x {x_m.min():.0f} to {x_m.max():.0f}, y {y_m.min():.0f} to {y_m.max():.0f}"

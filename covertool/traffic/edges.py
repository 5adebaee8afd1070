"""A street network of SUMO in metres of a working CRS: edges, turns and their place on Earth."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import shapely
from pyproj import CRS

from covertool.model import Bounds, Floats
from covertool.traffic.projection import Projection

if TYPE_CHECKING:
    import geopandas as gpd


@dataclass(frozen=True)
class Edge:
    """One directed street between two junctions.

    Attributes
    ----------
    id, from_junction, to_junction : names in the net
    kind : its type, such as highway.secondary; empty when the net names none
    name : the street's name; empty when the net names none
    length_m : along the lane
    speed_limit : metres per second
    lanes : numbers of the lanes that passenger cars may use; the first is at the kerb
    shape : (M, 2) middle line of the lanes for cars, in the network's CRS
    """

    id: str
    from_junction: str
    to_junction: str
    kind: str
    name: str
    length_m: float
    speed_limit: float
    lanes: tuple[int, ...]
    shape: Floats


@dataclass(frozen=True)
class Network:
    """A street network on which SUMO drives passenger cars.

    Attributes
    ----------
    path : the .net.xml or .net.xml.gz file
    projection : between coordinates of the net and ``crs``
    bounds_m : of the streets, in ``crs``
    left_hand : True where cars drive on the left
    edges : by id, those that passenger cars may use
    successors : the edges that a car may drive onto from each edge, U-turns included
    signals : number of junctions with traffic lights
    closed : ids of the edges that passenger cars may not use
    """

    path: Path
    projection: Projection
    bounds_m: Bounds
    left_hand: bool
    edges: Mapping[str, Edge] = field(repr=False)
    successors: Mapping[str, tuple[str, ...]] = field(repr=False)
    signals: int
    closed: frozenset[str] = field(default=frozenset(), repr=False)

    @property
    def crs(self) -> CRS:
        """The working CRS of everything that is made of the network."""
        return self.projection.crs

    @property
    def offset_m(self) -> tuple[float, float]:
        """What SUMO added to the coordinates of the net's own projection."""
        return self.projection.offset_m

    def lines(self, edges: Iterable[str] | None = None) -> shapely.MultiLineString:
        """Return the middle lines of some edges, or of all, in the working CRS."""
        chosen = self.edges if edges is None else edges
        return shapely.MultiLineString([self.edges[name].shape for name in chosen])

    def to_frame(self) -> gpd.GeoDataFrame:
        """Return the edges as directed segments, as ``congestion table --segments`` reads them."""
        import geopandas as gpd

        rows = [
            {
                "segment_id": edge.id,
                "name": edge.name,
                "kind": edge.kind,
                "length_m": edge.length_m,
                "lanes": len(edge.lanes),
                "free_flow_kmh": edge.speed_limit * 3.6,
                "geometry": shapely.LineString(edge.shape),
            }
            for edge in self.edges.values()
        ]
        return gpd.GeoDataFrame(rows, geometry="geometry", crs=self.crs)

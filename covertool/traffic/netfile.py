"""SUMO's net files (.net.xml, .net.xml.gz), streamed into a network."""

from __future__ import annotations

import html
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pyproj import CRS

from covertool import crs as crs_door
from covertool.errors import CrsError, FileError, GeometryError
from covertool.gis.streams import open_stream
from covertool.model import Bounds, Floats
from covertool.traffic.edges import Edge, Network
from covertool.traffic.projection import Projection
from covertool.traffic.xml import Element, elements

SMALLEST_NET_M = 100.0
"""A net whose longer side is less was most likely made of degrees taken for metres."""
_ELEMENTS = ("location", "edge", "connection", "junction")
_NO_PROJECTION = ("", "!", "-", ".")
_NOT_STREETS = ("internal", "crossing", "walkingarea", "connector")


def read_network(path: str | Path, *, net_crs: str | CRS | None = None) -> Network:
    """Return the street network of a SUMO net file.

    Parameters
    ----------
    path : .net.xml or .net.xml.gz
    net_crs : the projection of a net that names none

    Raises
    ------
    FileError
        When the file is absent, cut off or no SUMO net.
    CrsError
        When the net has no projection and none is given, when both differ, or when the axes of
        the projection do not run east and north.
    GeometryError
        When the net has no street for cars, or measures less than 100 m.
    """
    reading = _Reading(str(path))
    with open_stream(path) as stream:
        for element in elements(stream, _ELEMENTS, str(path)):
            reading.take(element)
    return reading.network(Path(path), net_crs)


class _Reading:
    """Collects what the elements of a net file tell."""

    def __init__(self, where: str) -> None:
        self._where = where
        self._location: dict[str, str] | None = None
        self._left_hand = False
        self._raw: dict[str, _RawEdge] = {}
        self._closed: set[str] = set()
        self._turns: list[tuple[str, str]] = []
        self._signals = 0

    def take(self, element: Element) -> None:
        """Take one element of the net."""
        if element.tag == "location":
            self._location = dict(element.attrib)
            net = element.getparent()
            self._left_hand = net is not None and net.get("lefthand") in ("true", "1")
        elif element.tag == "junction":
            self._signals += element.get("type", "").startswith("traffic_light")
        elif element.tag == "edge":
            if element.get("function", "normal") not in _NOT_STREETS:
                raw = _raw_edge(element, self._where)
                if raw.lanes:
                    self._raw[raw.id] = raw
                else:
                    self._closed.add(raw.id)
        else:
            self._take_turn(element)

    def _take_turn(self, element: Element) -> None:
        """Keep a connection between two lanes that cars may use; edges stand before it."""
        start, end = element.get("from", ":"), element.get("to", ":")
        known = start in self._raw and end in self._raw and _for_cars(element)
        if (
            known
            and element.get("fromLane") in self._raw[start].lanes
            and element.get("toLane") in self._raw[end].lanes
        ):
            self._turns.append((start, end))

    def network(self, path: Path, net_crs: str | CRS | None) -> Network:
        """Return the network once the whole file was taken."""
        if self._location is None:
            raise FileError(
                "this is no SUMO net: it has no location", self._where, "name a .net.xml file"
            )
        if not self._raw:
            raise GeometryError(
                "the net has no street that passenger cars may use",
                self._where,
                "build it of roads, with --keep-edges.by-vclass passenger",
            )
        bounds = _bounds([raw.shape for raw in self._raw.values()])
        source = _source_crs(self._location.get("projParameter", "!"), net_crs, self._where)
        _refuse_small(bounds, self._where)
        offset = _pair(self._location.get("netOffset", "0,0"), self._where)
        projection = Projection.of(source, offset, bounds, self._where)
        edges = {raw.id: raw.edge(projection) for raw in self._raw.values()}
        following: dict[str, list[str]] = {name: [] for name in edges}
        for start, end in dict.fromkeys(self._turns):
            following[start].append(end)
        return Network(
            path=path,
            projection=projection,
            bounds_m=_bounds([edge.shape for edge in edges.values()]),
            left_hand=self._left_hand,
            edges=edges,
            successors={name: tuple(ends) for name, ends in following.items()},
            signals=self._signals,
            closed=frozenset(self._closed),
        )


@dataclass(frozen=True)
class _RawEdge:
    """An edge in coordinates of the net, with the lanes that cars may use by index."""

    id: str
    attributes: Mapping[str, str]
    lanes: Mapping[str, Mapping[str, str]]
    shape: Floats

    def edge(self, projection: Projection) -> Edge:
        """Return the edge in the working CRS."""
        lanes = list(self.lanes.values())
        return Edge(
            id=self.id,
            from_junction=self.attributes.get("from", ""),
            to_junction=self.attributes.get("to", ""),
            kind=self.attributes.get("type", ""),
            name=html.unescape(self.attributes.get("name", "")),  # netconvert escapes names twice
            length_m=float(lanes[0]["length"]),
            speed_limit=max(float(lane["speed"]) for lane in lanes),
            lanes=tuple(int(index) for index in self.lanes),
            shape=np.column_stack(projection.to_crs(self.shape[:, 0], self.shape[:, 1])),
        )


def _raw_edge(element: Element, where: str) -> _RawEdge:
    """Return an edge with those of its lanes that cars may use."""
    lanes = {
        lane.get("index", ""): dict(lane.attrib)
        for lane in element.iterchildren("lane")
        if _for_cars(lane)
    }
    name = element.get("id", "")
    try:
        shapes = [_shape(lane["shape"]) for lane in lanes.values()]
        for index, lane in lanes.items():
            int(index)
            if not (0 < float(lane["length"]) < math.inf and 0 <= float(lane["speed"]) < math.inf):
                raise ValueError(index)
    except (KeyError, ValueError):
        raise FileError(
            f"a lane of edge {name!r} has no usable shape, length or speed",
            where,
            "build the net again with netconvert",
        ) from None
    shape = shapes[len(shapes) // 2] if shapes else np.empty((0, 2))
    return _RawEdge(name, dict(element.attrib), lanes, shape)


def _for_cars(element: Element) -> bool:
    """Return True for a lane or connection that passenger cars may use."""
    allow, disallow = element.get("allow"), element.get("disallow")
    if allow is not None:
        return not {"passenger", "all"}.isdisjoint(allow.split())
    return disallow is None or {"passenger", "all"}.isdisjoint(disallow.split())


def _shape(text: str) -> Floats:
    points = np.array([[float(v) for v in point.split(",")[:2]] for point in text.split()])
    if points.ndim != 2 or len(points) < 2 or not np.isfinite(points).all():
        raise ValueError(text)
    return points


def _pair(text: str, where: str) -> tuple[float, float]:
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        x = y = math.nan
    if not (math.isfinite(x) and math.isfinite(y)):
        raise FileError(
            f"the netOffset {text!r} is no pair of numbers", where, "build the net again"
        )
    return x, y


def _bounds(shapes: Iterable[Floats]) -> Bounds:
    points = np.concatenate(list(shapes))
    (x0, y0), (x1, y1) = points.min(axis=0), points.max(axis=0)
    return float(x0), float(y0), float(x1), float(y1)


def _source_crs(own: str, given: str | CRS | None, where: str) -> CRS:
    """Return the CRS of the net's own projection, else the one that the user names."""
    wanted = None if given is None else crs_door.parse(given, "--net-crs")
    if own.strip() in _NO_PROJECTION:
        if wanted is None:
            raise CrsError(
                "the net has no projection, so nobody knows where on Earth it lies",
                where,
                "name the system of its coordinates, such as --net-crs EPSG:2157",
            )
        _require_metres(wanted, where)
        return wanted
    found = crs_door.parse(own, f"{where}: projParameter")
    if wanted is not None and crs_door.name(wanted) != crs_door.name(found):
        raise CrsError(
            f"the net is in {crs_door.name(found)}, and --net-crs says {crs_door.name(wanted)}",
            where,
            "leave --net-crs out; it is for nets without a projection",
        )
    _require_metres(found, where)
    return found


def _require_metres(crs: CRS, where: str) -> None:
    if not crs.is_projected or abs(crs_door.unit_m(crs) - 1.0) > 1e-9:
        raise CrsError(
            f"{crs_door.name(crs)} is not in metres, and SUMO drives in metres",
            where,
            "build the net with --proj.utm, or name a projected system with --net-crs",
        )


def _refuse_small(bounds: Bounds, where: str) -> None:
    width, height = bounds[2] - bounds[0], bounds[3] - bounds[1]
    if max(width, height) < SMALLEST_NET_M:
        raise GeometryError(
            f"the net measures {width:.3g} m by {height:.3g} m: "
            "most likely degrees were taken for metres",
            where,
            "build it again with netconvert --proj.utm (plain XML in lon/lat needs it)",
        )

"""A user's own route files: which edges they name, when the first car starts, how long cars are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from covertool.errors import FileError, GeometryError
from covertool.gis.streams import open_stream
from covertool.traffic.edges import Network
from covertool.traffic.fcd import clock_s
from covertool.traffic.trace import CAR_LENGTH_M
from covertool.traffic.xml import Element, elements

_VEHICLES = ("vehicle", "trip", "flow")
_ELEMENTS = (*_VEHICLES, "route", "vType", "person", "personFlow")
_EDGE_ATTRIBUTES = ("edges", "from", "to", "via")
_LENGTH_M = {
    "truck": 7.1,
    "trailer": 16.5,
    "bus": 12.0,
    "coach": 14.0,
    "delivery": 6.5,
    "emergency": 6.5,
    "motorcycle": 2.2,
    "moped": 2.1,
    "bicycle": 1.6,
}
"""Lengths that SUMO gives to classes of vehicles when their type names none."""


@dataclass(frozen=True)
class UserRoutes:
    """Route files of the user.

    Attributes
    ----------
    files : absolute paths, in the user's order
    edges : ids of all edges for cars that they name
    first_s : when the first vehicle starts
    length_of_type_m : length of each vehicle type
    """

    files: tuple[Path, ...]
    edges: tuple[str, ...] = field(repr=False)
    first_s: float
    length_of_type_m: Mapping[str, float] = field(repr=False)


def read_routes(paths: Sequence[str | Path], network: Network) -> UserRoutes:
    """Return what route files hold, after a check of their edges against the net.

    Raises
    ------
    FileError
        When a file is absent, cut off or no XML.
    GeometryError
        When they name edges that the net lacks, or hold no vehicle.
    """
    reading = _Reading()
    for path in paths:
        with open_stream(path) as stream:
            for element in elements(stream, _ELEMENTS, str(path)):
                reading.take(element, str(path))
    where = ", ".join(str(path) for path in paths)
    for_cars = tuple(name for name in reading.edges if name in network.edges)
    unknown = [name for name in reading.edges if name not in {*for_cars, *network.closed}]
    if unknown:
        raise GeometryError(
            f"the routes name {len(unknown)} edges that the net lacks: {', '.join(unknown[:5])}",
            where,
            f"route on the same net: {network.path}",
        )
    if not reading.departs_s:
        raise GeometryError(
            "the routes hold no vehicle", where, "add vehicles, trips or flows to the file"
        )
    files = tuple(Path(path).expanduser().resolve() for path in paths)
    return UserRoutes(files, for_cars, min(reading.departs_s), reading.lengths_m)


class _Reading:
    """Collects what the elements of route files tell."""

    def __init__(self) -> None:
        self.edges: dict[str, None] = {}
        self.departs_s: list[float] = []
        self.lengths_m: dict[str, float] = {}

    def take(self, element: Element, where: str) -> None:
        """Take one element with all that is in it."""
        if element.tag == "vType":
            self.lengths_m[element.get("id", "")] = _length_m(element, where)
            return
        if element.tag in ("person", "personFlow"):
            return
        if element.tag in _VEHICLES:
            self.departs_s.append(_depart_s(element, where))
        for part in element.iter("vehicle", "trip", "flow", "route"):
            for name in _EDGE_ATTRIBUTES:
                self.edges.update(dict.fromkeys(part.get(name, "").split()))


def _length_m(element: Element, where: str) -> float:
    text = element.get("length")
    if text is None:
        return _LENGTH_M.get(element.get("vClass", "passenger"), CAR_LENGTH_M)
    return _number(text, f"the length of type {element.get('id')!r}", where)


def _depart_s(element: Element, where: str) -> float:
    text = element.get("begin" if element.tag == "flow" else "depart", "0")
    if text in ("triggered", "containerTriggered", "now", "split", "begin"):
        return 0.0
    return _number(text, f"the departure of {element.get('id')!r}", where)


def _number(text: str, what: str, where: str) -> float:
    try:
        return clock_s(text) if ":" in text else float(text)
    except ValueError:
        raise FileError(f"{what} is {text!r}, no number", where, "write it in seconds") from None

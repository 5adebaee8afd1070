"""Street centre lines become a SUMO net: cut at their junctions, written as plain XML."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple
from xml.sax.saxutils import quoteattr

import numpy as np
import shapely
from pyproj import CRS
from shapely.ops import substring

from covertool import crs as crs_door
from covertool.errors import ColumnError, CrsError, GeometryError
from covertool.model import Floats, Integers, Objects
from covertool.traffic.disk import write_xml
from covertool.traffic.edges import Network
from covertool.traffic.netconvert import netconvert, projection_text

if TYPE_CHECKING:
    import geopandas as gpd

MAIN_KINDS = ("main", "arterial", "regional", "collector")
"""Through roads; where three of their arms meet there are traffic lights."""
_OFF_STREET = ("aisle", "service")
"""Ways of car parks, on which nobody drives through."""
_SPEED_KMH = {"main": 30.0, "residential": 30.0, "close": 30.0}
_OTHER_SPEED_KMH = 50.0
_PRIORITY = {"main": 9, "arterial": 9, "regional": 8, "collector": 7, "residential": 3, "close": 2}
_OTHER_PRIORITY = 4
_SLACK_M = 1.0
"""How far beyond the kerb of another street an end may stop and still join it."""
_SAME_M = 0.5
"""Lines closer than this touch."""
_JUNCTION_M = 4.0
"""Meetings of streets closer than this are one junction."""
_STUB_M = 25.0
"""A dead end shorter than this is no street, but a line that runs on past its junction."""


class _Street(NamedTuple):
    """What a street's row says beside its line; it has one lane each way."""

    kind: str
    name: str
    lane_m: float


@dataclass(frozen=True)
class _Piece:
    """A stretch of a street between two junctions."""

    id: str
    start: int
    end: int
    street: int
    line: shapely.LineString


def network_from_streets(
    streets: gpd.GeoDataFrame, folder: str | Path, *, left_hand: bool = True
) -> Network:
    """Return the network that netconvert makes of street centre lines, written into ``folder``.

    Every street has one lane each way. Lines meet where they cross, and where one ends at the
    other; three arms of through roads make a junction with traffic lights.

    Parameters
    ----------
    streets : lines with the columns kind and width_m, and name if there is one, in a CRS in metres;
        kinds aisle and service, the ways of car parks, are left out
    folder : an existing folder; the net is ``streets.net.xml`` in it
    left_hand : True where cars drive on the left, as in Ireland

    Raises
    ------
    ColumnError, CrsError, GeometryError
        When a column is missing, the CRS is not in metres, or there is no street.
    MissingExtraError
        When SUMO is not installed.
    """
    crs = _require(streets)
    rows = streets[~streets["kind"].isin(_OFF_STREET)]
    lines = _joined(np.asarray(rows.geometry.array, dtype=object), rows["width_m"].to_numpy(float))
    junctions, pieces = _cut(lines)
    known = _streets(rows)
    signals = _signals(pieces, known)
    origin = np.floor(junctions.min(axis=0))
    base = Path(folder).resolve()
    _write_nodes(base / "streets.nod.xml", junctions, signals, origin, crs)
    _write_types(base / "streets.typ.xml", sorted({street.kind for street in known}))
    _write_edges(base / "streets.edg.xml", pieces, known, origin)
    options = [
        "--node-files=streets.nod.xml",
        "--edge-files=streets.edg.xml",
        "--type-files=streets.typ.xml",
        "--junctions.join",
        "--output.street-names",
        "--no-turnarounds.except-deadend",
        *(["--lefthand"] if left_hand else []),
    ]
    return netconvert(options, base / "streets.net.xml", "the streets layer")


def _require(streets: gpd.GeoDataFrame) -> CRS:
    """Return the CRS of the streets, once their columns and lines have been checked."""
    missing = [name for name in ("kind", "width_m") if name not in streets]
    if missing:
        raise ColumnError(
            f"the streets have no column {' and '.join(missing)}",
            ", ".join(map(str, streets.columns)),
            "give every street a kind (such as residential) and a width_m",
        )
    crs = None if streets.crs is None else CRS.from_user_input(streets.crs)
    if crs is None or not crs_door.is_working(crs):
        told = "no CRS" if crs is None else f"the CRS {crs_door.name(crs)}"
        raise CrsError(
            f"the streets have {told}, not one in metres", "streets", "transform them first"
        )
    simple = (streets.geom_type == "LineString").all()
    if streets["kind"].isin(_OFF_STREET).all() or not simple:
        raise GeometryError(
            "the streets hold no simple lines of streets", "streets", "explode multi-part lines"
        )
    return crs


def _streets(rows: gpd.GeoDataFrame) -> list[_Street]:
    """Return what each row says beside its line."""
    names = rows["name"] if "name" in rows else [""] * len(rows)
    return [
        _Street(str(kind), str(name), float(width_m) / 2)
        for kind, name, width_m in zip(rows["kind"], names, rows["width_m"], strict=True)
    ]


def _joined(lines: Objects, widths_m: Floats) -> Objects:
    """Return lines whose ends, where they stop within another street, run to its middle line."""
    tree = shapely.STRtree(lines)
    joined = lines.copy()
    for row, line in enumerate(lines):
        points = shapely.get_coordinates(line)
        for at in (0, -1):
            found = _meeting(tree, lines, widths_m, row, points[at])
            if found is not None:
                points[at] = found
        joined[row] = shapely.LineString(points)
    return joined


def _meeting(
    tree: shapely.STRtree, lines: Objects, widths_m: Floats, row: int, end: Floats
) -> Floats | None:
    """Return the nearest place on another street's middle line that an end should touch."""
    point = shapely.Point(end)
    near = tree.query(point, predicate="dwithin", distance=float(widths_m.max()) / 2 + _SLACK_M)
    best: tuple[float, Floats] | None = None
    for other in near:
        gap = shapely.distance(lines[other], point)
        if other == row or gap > widths_m[other] / 2 + _SLACK_M:
            continue
        if shapely.dwithin(lines[other].boundary, point, _SAME_M):
            continue  # two ends that meet: both may still have to reach a third street
        if best is None or gap < best[0]:
            place = lines[other].interpolate(lines[other].project(point))
            best = float(gap), shapely.get_coordinates(place)[0]
    return None if best is None else best[1]


def _cut(lines: Objects) -> tuple[Floats, list[_Piece]]:
    """Return the junctions' places, and the lines cut at them."""
    places: list[Floats] = []
    pieces: list[_Piece] = []
    for row, along in enumerate(_cuts(lines)):
        numbers = [
            _number(places, shapely.get_coordinates(lines[row].interpolate(at))[0]) for at in along
        ]
        for k in range(len(along) - 1):
            piece = substring(lines[row], along[k], along[k + 1])
            if numbers[k] != numbers[k + 1] or piece.length > 2 * _JUNCTION_M:
                line = shapely.LineString(shapely.get_coordinates(piece))
                pieces.append(_Piece(f"{row}.{k}", numbers[k], numbers[k + 1], row, line))
    return np.array(places), _without_stubs(pieces)


def _without_stubs(pieces: list[_Piece]) -> list[_Piece]:
    """Return the pieces without short dead ends that hang on a junction."""
    arms: Counter[int] = Counter()
    for piece in pieces:
        arms.update((piece.start, piece.end))
    return [
        piece
        for piece in pieces
        if piece.line.length >= _STUB_M
        or (arms[piece.start] > 1 and arms[piece.end] > 1)
        or max(arms[piece.start], arms[piece.end]) < 3
    ]


def _cuts(lines: Objects) -> list[Floats]:
    """Return where along each line to cut it: its ends and wherever another line meets it."""
    tree = shapely.STRtree(lines)
    found: list[list[float]] = [[0.0, float(line.length)] for line in lines]
    first, second = tree.query(lines, predicate="dwithin", distance=_SAME_M)
    for one, other in zip(first, second, strict=True):
        if one == other:
            continue
        for point in _touches(lines[one], lines[other]):
            found[one].append(float(lines[one].project(point)))
    return [_merged(np.sort(np.array(along))) for along in found]


def _touches(one: shapely.LineString, other: shapely.LineString) -> Iterator[shapely.Point]:
    """Yield where two lines cross, and where an end of either touches the other."""
    crossing = shapely.intersection(one, other)
    yield from (part for part in shapely.get_parts(crossing) if part.geom_type == "Point")
    for line, with_ends in ((one, other), (other, one)):
        for end in (shapely.get_point(with_ends, 0), shapely.get_point(with_ends, -1)):
            if shapely.dwithin(line, end, _SAME_M):
                yield end


def _merged(along: Floats) -> Floats:
    """Return cuts without those that follow another too closely; both ends stay."""
    kept = [along[0]]
    for at in along[1:-1]:
        if at - kept[-1] > _JUNCTION_M and along[-1] - at > _JUNCTION_M:
            kept.append(at)
    return np.array([*kept, along[-1]])


def _number(places: list[Floats], place: Floats) -> int:
    """Return the number of the junction at a place, a new one if there is none yet."""
    if places:
        gaps = np.hypot(*(np.array(places) - place).T)
        nearest = int(np.argmin(gaps))
        if gaps[nearest] <= _JUNCTION_M:
            return nearest
    places.append(place)
    return len(places) - 1


def _signals(pieces: list[_Piece], streets: list[_Street]) -> set[int]:
    """Return the junctions at which three arms of through roads meet."""
    ends = [k for p in pieces if streets[p.street].kind in MAIN_KINDS for k in (p.start, p.end)]
    arms: Integers = np.bincount(np.array(ends, dtype=np.int64), minlength=1)
    return {int(k) for k in np.flatnonzero(arms >= 3)}


def _write_nodes(
    path: Path, junctions: Floats, signals: set[int], origin: Floats, crs: CRS
) -> None:
    """Write the junctions, those with traffic lights named, and where the net lies."""
    x, y = junctions.min(axis=0)
    x1, y1 = junctions.max(axis=0)
    box = f"{x:.2f},{y:.2f},{x1:.2f},{y1:.2f}"
    moved = junctions - origin
    inner = ",".join(f"{value:.2f}" for value in (*moved.min(axis=0), *moved.max(axis=0)))
    rows = [
        f'<location netOffset="{-origin[0]:.2f},{-origin[1]:.2f}" convBoundary="{inner}" '
        f'origBoundary="{box}" projParameter={quoteattr(projection_text(crs))}/>'
    ]
    for k, (east, north) in enumerate(moved):
        kind = "traffic_light" if k in signals else "priority"
        rows.append(f'<node id="J{k}" x="{east:.2f}" y="{north:.2f}" type="{kind}"/>')
    write_xml(path, "nodes", rows)


def _write_types(path: Path, kinds: list[str]) -> None:
    rows = [
        f'<type id={quoteattr(kind)} numLanes="1" priority="{_PRIORITY.get(kind, _OTHER_PRIORITY)}"'
        f' speed="{_SPEED_KMH.get(kind, _OTHER_SPEED_KMH) / 3.6:.3f}" spreadType="right"/>'
        for kind in kinds
    ]
    write_xml(path, "types", rows)


def _write_edges(path: Path, pieces: list[_Piece], streets: list[_Street], origin: Floats) -> None:
    """Write both directions of every piece as edges of one lane."""
    rows = []
    for piece in pieces:
        street = streets[piece.street]
        points = shapely.get_coordinates(piece.line) - origin
        for sign, start, end, shape in (
            ("", piece.start, piece.end, points),
            ("-", piece.end, piece.start, points[::-1]),
        ):
            text = " ".join(f"{x:.2f},{y:.2f}" for x, y in shape)
            rows.append(
                f'<edge id="{sign}{piece.id}" from="J{start}" to="J{end}" '
                f"type={quoteattr(street.kind)} name={quoteattr(street.name)} "
                f'width="{street.lane_m:.2f}" shape="{text}"/>'
            )
    write_xml(path, "edges", rows)

"""Residential streets grown from the through roads: spines, loops and cul-de-sacs.

Each street walks forward with a slowly changing curvature, keeps a house-and-garden's distance
from every other street, joins a street that it runs into (a loop) or stops short (a cul-de-sac),
and sends out side streets of the next class.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np
import shapely

from data.recipe.curves import Points, frame, left_of, length_m, resample
from data.recipe.parameters import stream
from data.recipe.skeleton import Street

STEP_M = 4.0
CLEARANCE_M = 54.0
"""Between the centre lines of neighbouring streets: two rows of houses, back to back."""

_CLASSES = ("residential", "residential", "close")
_SUFFIXES = (("Avenue", "Drive", "Road"), ("Crescent", "Park", "Lawn", "Grove"), ("Close", "Court"))
_LENGTH_M = ((180.0, 420.0), (90.0, 260.0), (60.0, 130.0))
_NAMES = (
    "Alder", "Ashgrove", "Beechfield", "Birchwood", "Bridgefield", "Brooklawn", "Cedarpark",
    "Cherrymount", "Cloverhill", "Cluain", "Coolfield", "Danefield", "Elmwood", "Fairgreen",
    "Fernleigh", "Glasheen", "Greenlough", "Hawthorn", "Hazelbrook", "Hollybank", "Ivylawn",
    "Kilbeg", "Larchfield", "Laurelmount", "Limetree", "Lisheen", "Maplewood", "Meadowvale",
    "Millrace", "Moatfield", "Oakfield", "Orchard", "Parklands", "Pinehurst", "Priory",
    "Rathbeg", "Rowanlea", "Sallygarden", "Silverbirch", "Sycamore", "Templefield", "Thornbury",
    "Tullyard", "Walnut", "Whitethorn", "Willowbrook", "Woodlawn", "Yewtree",
)  # fmt: skip


@dataclass(frozen=True)
class _Seed:
    """Where a street starts: on which street, which way, how deep in the estate's tree."""

    start: Points
    direction: Points
    parent: int
    depth: int
    estate: int


@dataclass
class _Town:
    """The streets grown so far, and their vertices in one array for distance checks."""

    streets: list[Street]
    land: shapely.Geometry
    xy: Points = field(init=False)
    owner: Points = field(init=False)

    def __post_init__(self) -> None:
        self.xy = np.vstack([street.points for street in self.streets])
        self.owner = np.concatenate(
            [np.full(len(street.points), k) for k, street in enumerate(self.streets)]
        )
        shapely.prepare(self.land)

    def add(self, street: Street) -> None:
        self.owner = np.concatenate([self.owner, np.full(len(street.points), len(self.streets))])
        self.xy = np.vstack([self.xy, street.points])
        self.streets.append(street)

    def allows(self, place: Points) -> bool:
        return bool(shapely.contains_xy(self.land, place[0], place[1]))


def grow_estates(roads: list[Street], land: shapely.Geometry) -> list[Street]:
    """Return the residential streets that fill ``land`` between the given roads."""
    rng = stream("estates")
    town = _Town(list(roads), land)
    queue = deque(_entries(roads, rng))
    while queue:
        seed = queue.popleft()
        grown = _walk(seed, town, rng)
        if grown is None:
            continue
        town.add(grown)
        queue.extend(_side_streets(len(town.streets) - 1, seed, grown, rng))
    return town.streets[len(roads) :]


def _entries(roads: list[Street], rng: np.random.Generator) -> list[_Seed]:
    """Return the mouths of estates along the through roads, in a shuffled order."""
    seeds = []
    for parent, road in enumerate(roads):
        if road.kind == "main":
            continue
        for side in (1.0, -1.0):
            at = rng.uniform(50, 110)
            while at < length_m(road.points) - 40:
                place, along = frame(road.points, at)
                seeds.append(_Seed(place, side * left_of(along), parent, 0, 0))
                at += rng.uniform(130, 230)
    order = rng.permutation(len(seeds))
    return [
        _Seed(seeds[k].start, seeds[k].direction, seeds[k].parent, 0, int(number))
        for number, k in enumerate(order)
    ]


def _walk(seed: _Seed, town: _Town, rng: np.random.Generator) -> Street | None:
    """Walk one street forward; None when there is no room for it."""
    longest = rng.uniform(*_LENGTH_M[seed.depth])
    bend, direction = rng.normal(0.0, 1 / 260), seed.direction
    path, closed = [seed.start], True
    while len(path) * STEP_M < longest:
        gone = len(path) * STEP_M
        bend = float(np.clip(bend + rng.normal(0.0, 1 / 1500), -1 / 70, 1 / 70))
        turn = bend * STEP_M if gone > 24 else 0.0
        direction = np.array(
            [
                direction[0] * np.cos(turn) - direction[1] * np.sin(turn),
                direction[0] * np.sin(turn) + direction[1] * np.cos(turn),
            ]
        )
        place = path[-1] + direction * STEP_M
        if gone > 16 and not town.allows(place):
            path = path[:-5]
            break
        gap = np.hypot(*(town.xy - place).T)
        need = np.where(town.owner == seed.parent, min(CLEARANCE_M, 0.7 * gone), CLEARANCE_M)
        if gone > 12 and np.any(gap < need):
            target = town.xy[np.argmin(gap - need)]
            closed = not _can_join(place, direction, target, town, rng)
            path = path[:-4] if closed else [*path, target]
            break
        path.append(place)
    if len(path) * STEP_M < 44:
        return None
    return _street(seed, np.array(path), closed, rng)


def _can_join(
    place: Points, direction: Points, target: Points, town: _Town, rng: np.random.Generator
) -> bool:
    """Say whether a street may run on into the one ahead of it: straight, over free land."""
    ahead = target - place
    straight = float(ahead @ direction) / max(float(np.hypot(*ahead)), 1e-9)
    crossing = shapely.LineString([place, place + 0.9 * ahead])
    return straight > 0.8 and rng.random() < 0.45 and bool(town.land.contains(crossing))


def _street(seed: _Seed, path: Points, closed: bool, rng: np.random.Generator) -> Street:
    name = f"{_NAMES[seed.estate % len(_NAMES)]} {rng.choice(_SUFFIXES[seed.depth])}"
    kind = "close" if closed and seed.depth == 1 else _CLASSES[seed.depth]
    return Street(name, kind, resample(path, STEP_M), "houses", closed)


def _side_streets(
    number: int, seed: _Seed, street: Street, rng: np.random.Generator
) -> list[_Seed]:
    """Return the side streets of a grown street, on both sides."""
    if seed.depth + 1 >= len(_CLASSES):
        return []
    found = []
    for side in (1.0, -1.0):
        at = rng.uniform(38, 62)
        while at < length_m(street.points) - 12:
            place, along = frame(street.points, at)
            lean = rng.normal(0.0, 0.08)
            across = side * left_of(along) + lean * along
            found.append(
                _Seed(place, across / np.hypot(*across), number, seed.depth + 1, seed.estate)
            )
            at += rng.uniform(58, 78)
    return found

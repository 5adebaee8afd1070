"""Who drives where: the campus circuit, the town, or a user's own routes."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from covertool.errors import GeometryError, OptionError
from covertool.traffic.circuit import closed_circuit, through_roads
from covertool.traffic.edges import Network
from covertool.traffic.graph import StreetGraph
from covertool.traffic.routes import UserRoutes, read_routes
from covertool.traffic.trace import CAR_LENGTH_M

TOWN_STARTED, TOWN_ENTERING, TOWN_GAP_S = 200, 95, 4.0
TOWN_HORIZON_S, CAMPUS_HORIZON_S = 420.0, 300.0
CAMPUS_CARS = 12
_SPACE_M = 8.0
"""Between the fronts of two cars that start on one lane: a length, a gap and half a metre."""
_TRIES = 50
_LOG = logging.getLogger(__name__)
_SEED_LIMIT = 2**31 - 1


@dataclass(frozen=True)
class Trip:
    """One car: when it starts, the edges that it drives along, and where on the first.

    ``place`` is the number of the lane and how far along it the front bumper stands, in metres;
    None is the beginning of the lane that suits the route best.
    """

    vehicle: str
    depart_s: float
    edges: tuple[str, ...]
    place: tuple[int, float] | None = None


class _Start(NamedTuple):
    """A random place at which a car starts."""

    edge: str
    lane: int
    at_m: float


@dataclass(frozen=True)
class Demand:
    """The cars of a simulation.

    Attributes
    ----------
    scenario : campus, town or routes
    horizon_s : how long is simulated
    circuit : ids of the edges that make the street circuit
    trips : one a car; empty when the user's files hold them
    user : the user's route files; None for the others
    seed : of the demand; None for a user's routes
    """

    scenario: str
    horizon_s: float
    circuit: tuple[str, ...] = field(repr=False)
    trips: tuple[Trip, ...] = field(default=(), repr=False)
    user: UserRoutes | None = None
    seed: int | None = None

    @property
    def begin_s(self) -> float:
        """When the simulation begins: at 0, or just before a user's first car."""
        return 0.0 if self.user is None else self.user.first_s


def campus_demand(
    network: Network,
    *,
    seed: int = 1,
    cars: int = CAMPUS_CARS,
    circuit: Sequence[str] | None = None,
    horizon_s: float = CAMPUS_HORIZON_S,
) -> Demand:
    """Return a dozen cars that drive round and round one circuit, from random places on it.

    Parameters
    ----------
    circuit : ids of edges that close a ring; without them the ring of the network whose length is
        nearest to a kilometre
    seed : of the places, 0 to 2147483646

    Raises
    ------
    OptionError
        When a number is out of range, or an edge is not in the net.
    GeometryError
        When the network has no ring, or no room for the cars.
    """
    rng = _generator(seed, horizon_s, cars)
    ring = closed_circuit(network) if circuit is None else _known(network, circuit)
    starts = _places(network, ring, cars, rng)
    trips = []
    laps = _laps(network, ring, horizon_s)
    for number, start in enumerate(starts):
        first = ring.index(start.edge)
        route = (ring[first:] + ring[:first]) * laps
        trips.append(Trip(f"car{number + 1}", 0.0, route, (start.lane, start.at_m)))
    return Demand("campus", horizon_s, ring, tuple(trips), seed=seed)


def town_demand(
    network: Network,
    *,
    seed: int = 1,
    started: int = TOWN_STARTED,
    entering: int = TOWN_ENTERING,
    gap_s: float = TOWN_GAP_S,
    circuit: Sequence[str] | None = None,
    horizon_s: float = TOWN_HORIZON_S,
) -> Demand:
    """Return cars at random places of the circuit at the start, and others that enter one by one.

    As in the paper's large scenario: 200 cars start at places spread evenly by chance over the
    circuit, 95 more enter one every 4 s; each has a random edge to go to, by the fastest way
    within the circuit.

    Parameters
    ----------
    circuit : ids of edges; without them the network's through roads (secondary and tertiary)
    seed : of places, origins and destinations, 0 to 2147483646

    Raises
    ------
    OptionError
        When a number is out of range, or an edge is not in the net.
    GeometryError
        When the circuit falls apart, or has no room for the cars.
    """
    if not gap_s > 0:
        raise OptionError(f"a gap of {gap_s} s between cars is no time", "gap_s", "use seconds")
    rng = _generator(seed, horizon_s, started + entering)
    edges = through_roads(network) if circuit is None else _known(network, circuit)
    graph = StreetGraph.of(network, edges)
    number = {name: k for k, name in enumerate(graph.names)}
    starts = _places(network, edges, started, rng)
    started = len(starts)
    origins = [number[start.edge] for start in starts]
    origins += rng.choice(len(graph.names), size=entering).tolist()
    pairs = [(origin, _goal(origin, len(graph.names), rng)) for origin in origins]
    trips = []
    for k, route in enumerate(graph.routes(pairs)):
        if not route:
            raise _falls_apart(graph.names[pairs[k][0]], graph.names[pairs[k][1]], network)
        entered = k - started + 1  # the first one enters after one gap
        depart_s = entered * gap_s if entered > 0 else 0.0
        place = (starts[k].lane, starts[k].at_m) if k < started else None
        names = tuple(graph.names[edge] for edge in route)
        trips.append(Trip(f"car{k + 1}", depart_s, names, place))
    return Demand("town", horizon_s, edges, tuple(trips), seed=seed)


def user_routes(
    paths: str | Path | Sequence[str | Path], network: Network, *, horizon_s: float
) -> Demand:
    """Return the demand of a user's own route files (.rou.xml: vehicles, trips, flows, types).

    The circuit is made of all edges that they name.

    Raises
    ------
    FileError
        When a file is absent, cut off or no XML.
    GeometryError
        When they name edges that the net lacks, or hold no vehicle.
    """
    _require_horizon(horizon_s)
    files = [paths] if isinstance(paths, str | Path) else list(paths)
    user = read_routes(files, network)
    return Demand("routes", horizon_s, user.edges, user=user)


def _generator(seed: int, horizon_s: float, cars: int) -> np.random.Generator:
    _require_horizon(horizon_s)
    require_seed(seed)
    if cars < 1:
        raise OptionError("there are no vehicles", f"{cars} cars", "ask for at least one car")
    return np.random.default_rng(seed)


def require_seed(seed: int) -> None:
    """Refuse a seed of the traffic that SUMO would not take as it is."""
    if not 0 <= seed < _SEED_LIMIT:
        raise OptionError(
            f"the traffic seed {seed} is out of range", "seed", f"use 0 to {_SEED_LIMIT - 1}"
        )


def _require_horizon(horizon_s: float) -> None:
    if not 0 < horizon_s <= 86400:
        raise OptionError(
            f"a horizon of {horizon_s} s is out of range", "horizon_s", "use seconds up to a day"
        )


def _known(network: Network, edges: Sequence[str]) -> tuple[str, ...]:
    unknown = [name for name in edges if name not in network.edges]
    if unknown or not edges:
        raise OptionError(
            f"the net has no street for cars named {', '.join(unknown[:5]) or '(none given)'}",
            str(network.path),
            "name edges of the net; sumo-gui and netedit show their ids",
        )
    return tuple(edges)


def _laps(network: Network, ring: tuple[str, ...], horizon_s: float) -> int:
    """Return how many laps nobody can finish within the horizon."""
    drive_s = sum(network.edges[name].length_m / network.edges[name].speed_limit for name in ring)
    fastest = 1.5  # SUMO's drivers differ in how much they exceed a limit
    return int(horizon_s * fastest / drive_s) + 2


def _places(
    network: Network, edges: Sequence[str], count: int, rng: np.random.Generator
) -> list[_Start]:
    """Return random places on the edges, spread evenly over their lanes, no two too close.

    Where there is no room for all, as many as were found; a warning tells.
    """
    lanes = [(name, lane) for name in edges for lane in network.edges[name].lanes]
    free_m = np.array([network.edges[name].length_m - CAR_LENGTH_M for name, _ in lanes])
    share = np.maximum(free_m, 0.0) / max(float(np.maximum(free_m, 0.0).sum()), 1e-9)
    taken: dict[tuple[str, int], list[float]] = {lane: [] for lane in lanes}
    places: list[_Start] = []
    for _ in range(_TRIES * count):
        if len(places) == count or not share.any():
            break
        row = int(rng.choice(len(lanes), p=share))
        at_m = round(CAR_LENGTH_M + float(rng.random()) * float(free_m[row]), 2)
        if all(abs(at_m - other_m) >= _SPACE_M for other_m in taken[lanes[row]]):
            taken[lanes[row]].append(at_m)
            places.append(_Start(*lanes[row], at_m))
    _tell_room(len(places), count, float(free_m.sum()), str(network.path))
    return places


def _tell_room(found: int, count: int, length_m: float, where: str) -> None:
    if not found:
        raise GeometryError(
            f"the circuit's lanes of {length_m:.0f} m have no room for a car",
            where,
            "take a net with longer streets, or drive your own routes with --routes",
        )
    if found < count:
        _LOG.warning(
            "%s: the circuit's lanes of %.0f m have room for %d of the %d cars that start",
            where, length_m, found, count,
        )  # fmt: skip


def _goal(origin: int, edges: int, rng: np.random.Generator) -> int:
    """Return a random edge other than the one that a car comes from, where there is one."""
    if edges == 1:
        return origin
    goal = int(rng.integers(edges - 1))
    return goal + (goal >= origin)


def _falls_apart(origin: str, goal: str, network: Network) -> GeometryError:
    return GeometryError(
        f"no way leads from {origin} to {goal}: the streets are only weakly connected",
        str(network.path),
        "mend the net's one-way streets, or drive your own routes with --routes",
    )

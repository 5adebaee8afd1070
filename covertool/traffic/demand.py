"""Who drives where: the campus circuit, the town, or a user's own routes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from covertool.traffic.network import Network

TOWN_STARTED, TOWN_ENTERING, TOWN_GAP_S = 200, 95, 4.0
TOWN_HORIZON_S, CAMPUS_HORIZON_S = 420.0, 300.0


@dataclass(frozen=True)
class Trip:
    """One car: when and where it starts, and the edges that it drives along."""

    vehicle: str
    depart_s: float
    edges: tuple[str, ...]
    depart_pos_m: float | None


@dataclass(frozen=True)
class Demand:
    """The cars of a simulation.

    Attributes
    ----------
    scenario : campus, town or routes
    horizon_s : how long is simulated
    trips : one a car; empty when ``files`` hold them
    circuit : ids of the edges that make the street circuit
    files : route files of the user
    seed : of the demand; None for a user's routes
    """

    scenario: str
    horizon_s: float
    circuit: tuple[str, ...]
    trips: tuple[Trip, ...] = field(default=(), repr=False)
    files: tuple[Path, ...] = ()
    seed: int | None = None


def campus_demand(
    network: Network,
    *,
    seed: int = 1,
    cars: int = 12,
    circuit: Sequence[str] | None = None,
    horizon_s: float = CAMPUS_HORIZON_S,
) -> Demand:
    """Return a dozen cars that drive round and round one circuit."""
    raise NotImplementedError


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
    """Return cars at random places at the start, and others that enter one by one."""
    raise NotImplementedError


def user_routes(
    paths: str | Path | Sequence[str | Path], network: Network, *, horizon_s: float
) -> Demand:
    """Return the demand of a user's own route files (.rou.xml: vehicles, trips, flows)."""
    raise NotImplementedError

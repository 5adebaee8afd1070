"""Mobility: the true positions of cars that SUMO drove, or that a file recorded."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pyproj import CRS

from covertool.model import Anchors, Trace
from covertool.traffic.demand import Demand
from covertool.traffic.network import Network

TIMEOUT_S = 600.0


@dataclass(frozen=True)
class Mobility:
    """The true positions of moving cars, and how they came about.

    Attributes
    ----------
    trace : centres of the cars
    crs : the working CRS of the trace
    network : the streets; None for a trace without its net
    circuit : ids of the edges that make the street circuit
    route_edges : the edges that each car drove along, in order
    facts : what the run reports: sumo (version), seed, seconds, end_s, loaded, inserted,
        arrived, teleports, collisions, left_out (ids of cars), anchors_as
    edge_data : SUMO's edgeData of the run, as ``congestion import`` reads it; None without a run
    """

    trace: Trace
    crs: CRS
    network: Network | None
    circuit: tuple[str, ...]
    route_edges: Mapping[str, tuple[str, ...]] = field(repr=False)
    facts: Mapping[str, Any]
    edge_data: bytes | None = field(default=None, repr=False)


def drive(
    network: Network,
    demand: Demand,
    *,
    seed: int = 1,
    step_s: float = 1.0,
    anchors: Anchors | None = None,
    anchors_as: str = "points",
    timeout_s: float = TIMEOUT_S,
    on_time: Callable[[float], object] | None = None,
) -> Mobility:
    """Return the mobility of a demand on a network, driven by SUMO in a child process.

    ``on_time`` is called with the simulated seconds so far.
    """
    raise NotImplementedError


def recorded(
    path: str | Path,
    *,
    network: Network | None = None,
    crs: str | CRS | None = None,
    horizon_s: float | None = None,
) -> Mobility:
    """Return the mobility of an existing trace in SUMO's column names; SUMO is not needed."""
    raise NotImplementedError

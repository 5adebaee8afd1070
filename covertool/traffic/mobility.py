"""Mobility: the true positions of cars that SUMO drove, or that a file recorded."""

from __future__ import annotations

import logging
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from pyproj import CRS

from covertool import crs as crs_door
from covertool.errors import GeometryError, OptionError
from covertool.model import Anchors, Trace
from covertool.model.tables import by_car
from covertool.traffic.demand import Demand
from covertool.traffic.edges import Network
from covertool.traffic.fcd import FcdRows, read_rows
from covertool.traffic.parked import ANCHORS_AS, PARKED
from covertool.traffic.projection import Projection
from covertool.traffic.run import SumoRun, run_sumo
from covertool.traffic.trace import CAR_LENGTH_M, trace_of

TIMEOUT_S = 600.0
_LOG = logging.getLogger(__name__)
_JUMP_FACTOR, _JUMP_M = 1.5, 5.0


@dataclass(frozen=True)
class Mobility:
    """The true positions of moving cars, and how they came about.

    Attributes
    ----------
    trace : centres of the cars
    crs : the working CRS of the trace
    network : the streets; None for a trace without its net
    circuit : ids of the edges that make the street circuit
    route_edges : the edges that each car drove along, in order; empty without lanes in the trace
    facts : what the run reports: sumo (version), seed, seconds, end_s, loaded, inserted,
        arrived, teleports, collisions, left_out (ids of cars), anchors_as; empty for a trace
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

    Vehicles that SUMO teleported or let collide are left out of the trace and named in ``facts``.

    Parameters
    ----------
    seed : of SUMO's drivers; the same seed gives the same trace, bit by bit
    step_s : time between two positions, from 0.1 to 10 s
    anchors : what stands in SUMO's world; they do not change the traffic as ``points``
    anchors_as : points, or parked: cars beside the street, which do change the traffic
    timeout_s : SUMO is ended when it runs longer
    on_time : called with the simulated seconds so far

    Raises
    ------
    MissingExtraError
        When SUMO is not installed or too old.
    OptionError
        When an option is out of range.
    ComputationError, FileError, GeometryError
        When SUMO fails; see `covertool.traffic.run`.
    """
    _check(network, step_s, anchors, anchors_as)
    with tempfile.TemporaryDirectory(prefix="covertool-sumo-") as folder:
        run = run_sumo(
            network, demand, Path(folder), seed=seed, step_s=step_s, anchors=anchors,
            anchors_as=anchors_as, timeout_s=timeout_s, on_time=on_time,
        )  # fmt: skip
    rows = run.rows.take(~_parked(run.rows))
    left_out = (run.teleported | run.collided | _jumped(rows, step_s)) & set(rows.vehicle.tolist())
    kept = rows.take(np.array([name not in left_out for name in rows.vehicle], dtype=bool))
    if not len(kept):
        raise GeometryError(
            "no vehicles are left once those that SUMO teleported or let collide are left out",
            str(network.path),
            "simulate fewer cars, or look at the net's junctions in sumo-gui",
        )
    lengths_m = _lengths_m(kept, demand)
    trace = trace_of(kept, "SUMO", projection=network.projection, length_m=lengths_m)
    facts = _facts(run, demand, seed, step_s, anchors_as, anchors, tuple(sorted(left_out)))
    return Mobility(
        trace, network.crs, network, demand.circuit, _route_edges(kept), facts, run.edge_data
    )


def recorded(
    path: str | Path,
    *,
    network: Network | None = None,
    crs: str | CRS | None = None,
    horizon_s: float | None = None,
) -> Mobility:
    """Return the mobility of an existing trace in SUMO's column names; SUMO is not needed.

    Parameters
    ----------
    path : CSV, XML or Parquet
    network : the net on which it was recorded, whose coordinates it has
    crs : the CRS of its coordinates when there is no net; may be geographic (``--fcd-output.geo``)
    horizon_s : only so many seconds from its first row on

    Raises
    ------
    OptionError
        When both or neither of ``network`` and ``crs`` are given.
    """
    if (network is None) == (crs is None):
        raise OptionError(
            "a trace needs either its net or the system of its coordinates",
            str(path),
            "add --net FILE.net.xml, or --crs EPSG:CODE",
        )
    rows = read_rows(path)
    rows = rows.take(~_parked(rows))
    if horizon_s is not None and len(rows):
        rows = rows.take(rows.time_s < rows.time_s.min() + horizon_s)
    if not len(rows):
        raise GeometryError("the trace holds no vehicle", str(path), "record it while cars drive")
    if network is not None:
        projection = network.projection
    else:
        assert crs is not None
        x, y = rows.x, rows.y
        bounds = float(x.min()), float(y.min()), float(x.max()), float(y.max())
        projection = Projection.of(crs_door.parse(crs), (0.0, 0.0), bounds, str(path))
    trace = trace_of(rows, str(path), projection=projection)
    return Mobility(trace, projection.crs, network, (), _route_edges(rows), {})


def _check(network: Network, step_s: float, anchors: Anchors | None, anchors_as: str) -> None:
    """Refuse options that are out of range, and anchors of another CRS."""
    if anchors_as not in ANCHORS_AS:
        raise OptionError(
            f"anchors cannot stand as {anchors_as!r}",
            "--anchors-as",
            f"use {', '.join(ANCHORS_AS)}",
        )
    if not 0.1 <= step_s <= 10:
        raise OptionError(f"a step of {step_s} s is out of range", "step_s", "use 0.1 to 10 s")
    if anchors is not None and anchors.crs != network.crs:
        raise OptionError(
            f"the anchors are in {crs_door.name(anchors.crs)}, the net in "
            f"{crs_door.name(network.crs)}",
            "anchors",
            "read the anchors with dst_crs=network.crs",
        )


def _parked(rows: FcdRows) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    return np.array([str(name).startswith(PARKED) for name in rows.vehicle], dtype=bool)


def _jumped(rows: FcdRows, step_s: float) -> frozenset[str]:
    """Return vehicles that moved much further to another edge in one step than their speed allows.

    On one edge SUMO changes lanes at once, however far apart they lie: that is no jump.
    """
    order = by_car(rows.vehicle, rows.time_s)
    name, time_s = rows.vehicle[order], rows.time_s[order]
    edge = np.array([_edge_of(lane) for lane in rows.lane[order]], dtype=object)
    moved_m = np.hypot(np.diff(rows.x[order]), np.diff(rows.y[order]))
    speed = np.maximum(rows.speed[order][1:], rows.speed[order][:-1])
    follows = (name[1:] == name[:-1]) & (np.diff(time_s) < 1.5 * step_s) & (edge[1:] != edge[:-1])
    far = moved_m > _JUMP_FACTOR * speed * step_s + _JUMP_M
    return frozenset(name[1:][follows & far].tolist())


def _edge_of(lane: object) -> str:
    return str(lane).rpartition("_")[0]


def _lengths_m(rows: FcdRows, demand: Demand) -> dict[str, float]:
    known = {} if demand.user is None else demand.user.length_of_type_m
    kinds = dict(zip(rows.vehicle.tolist(), rows.kind.tolist(), strict=True))
    return {name: known.get(str(kind), CAR_LENGTH_M) for name, kind in kinds.items()}


def _route_edges(rows: FcdRows) -> dict[str, tuple[str, ...]]:
    """Return the edges that each car was on, in order; junctions' own lanes are left out."""
    order = np.argsort(rows.time_s, kind="stable")
    found: dict[str, list[str]] = {}
    for name, lane in zip(rows.vehicle[order], rows.lane[order], strict=True):
        edge = _edge_of(lane)
        edges = found.setdefault(str(name), [])
        if edge and not edge.startswith(":") and (not edges or edges[-1] != edge):
            edges.append(edge)
    return {name: tuple(edges) for name, edges in found.items()}


def _facts(
    run: SumoRun, demand: Demand, seed: int, step_s: float, anchors_as: str,
    anchors: Anchors | None, left_out: tuple[str, ...],
) -> dict[str, Any]:  # fmt: skip
    """Return what a run reports."""
    parked = len(anchors) if anchors is not None and anchors_as == "parked" else 0
    loaded, inserted = run.loaded - parked, run.inserted - parked
    _tell_of_lost(loaded, inserted, left_out)
    return {
        "sumo": run.version,
        "seed": seed,
        "demand_seed": demand.seed,
        "scenario": demand.scenario,
        "step_s": step_s,
        "seconds": run.seconds,
        "begin_s": demand.begin_s,
        "end_s": run.end_s,
        "loaded": loaded,
        "inserted": inserted,
        "arrived": run.inserted - run.running,
        "teleports": run.teleports,
        "collisions": run.collisions,
        "left_out": left_out,
        "anchors_as": anchors_as,
    }


def _tell_of_lost(loaded: int, inserted: int, left_out: tuple[str, ...]) -> None:
    """Warn of what makes a run less than was asked for."""
    if inserted < loaded:
        _LOG.warning("%d of %d vehicles found no room to enter the net", loaded - inserted, loaded)
    if left_out:
        _LOG.warning(
            "%d vehicles are left out, for SUMO teleported them or let them collide: %s",
            len(left_out), ", ".join(left_out[:10]),
        )  # fmt: skip

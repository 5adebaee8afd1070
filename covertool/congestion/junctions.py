"""Whether congestion lies at junctions: its length near them against that of all streets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from covertool.congestion.clock import local_days, window_instant
from covertool.congestion.options import OccupancyOptions
from covertool.congestion.rounding import half_up
from covertool.congestion.states import SegmentStates
from covertool.congestion.status import CLOSED, UNKNOWN
from covertool.congestion.streets import Streets
from covertool.model import Floats, Observations

NEAR_M = (25.0, 50.0)
_SNAP_M = 0.5
_LINE = 1


@dataclass(frozen=True)
class JunctionShare:
    """Share of occupied and of all street length within a distance of a junction, 0 to 1."""

    distance_m: float
    occupied_share: float | None
    all_share: float

    def text(self) -> str:
        """Return the two shares in one line."""
        occupied = "-" if self.occupied_share is None else half_up(100 * self.occupied_share)
        return (
            f"within {self.distance_m:g} m of a junction: {occupied} % of the occupied length,"
            f" {half_up(100 * self.all_share)} % of all length"
        )


def junctions(network: Streets) -> Floats:
    """Return the (J, 2) places from which three or more streets lead away.

    The lines are noded where they meet or cross, so that a street need not end at its junctions;
    the two directions of a street are one. Places closer than half a metre are one. Bridges over
    the network's own streets count as junctions, for the lines do not tell them apart.
    """
    noded = shapely.get_parts(shapely.union_all(network.line, grid_size=_SNAP_M))
    edges = noded[shapely.get_type_id(noded) == _LINE]
    ends = np.concatenate([shapely.get_point(edges, end) for end in (0, -1)])
    places, count = np.unique(shapely.get_coordinates(ends), axis=0, return_counts=True)
    met: Floats = places[count >= 3]
    return met


def junction_shares(
    observations: Observations,
    network: Streets,
    options: OccupancyOptions,
    distances_m: Sequence[float] = NEAR_M,
) -> list[JunctionShare]:
    """Return how much of the occupied length, over all days and windows, lies near junctions.

    The paper remarks that congestion sits at intersections; this is the comparison.

    Parameters
    ----------
    observations, network, options : as in `covertool.congestion.occupancy.days_of`
    distances_m : from a junction
    """
    states = SegmentStates(observations, network, options)
    occupied_times, known_times = np.zeros(len(network)), np.zeros(len(network))
    for day in local_days(observations.time, options.tz):
        for at in options.windows.values():
            moment = window_instant(day, at, options.tz)
            if moment is None:
                continue
            status = states.at(moment)[0][states.segment_of]
            known_times += (status != UNKNOWN) & (status != CLOSED)
            occupied_times += np.isin(status.astype(str), list(options.occupied))
    spots = shapely.multipoints(junctions(network))
    shares = []
    for distance in distances_m:
        near_m = shapely.length(shapely.intersection(network.line, shapely.buffer(spots, distance)))
        near = network.weight * near_m / shapely.length(network.line)
        occupied = _share(near, network.weight, occupied_times)
        everything = _share(near, network.weight, known_times)
        shares.append(JunctionShare(distance, occupied, everything or 0.0))
    return shares


def _share(near: Floats, weight: Floats, times: Floats) -> float | None:
    total = float((weight * times).sum())
    return float((near * times).sum()) / total if total > 0 else None

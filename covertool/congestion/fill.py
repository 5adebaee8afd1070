"""How much of a flagged street the queued cars themselves fill."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from covertool.model import Floats, Objects

SPACING_M = 7.5
"""Length of lane that one queued car takes: a car of 5.0 m and the gap before the next."""


def queue_share(
    relative_speed: float, *, flow_per_lane_h: float = 600.0, free_speed_mps: float = 50 / 3.6
) -> float:
    """Return the share of a lane's length that halted cars fill when traffic is this slow.

    A car crosses a length L in L / (r v) instead of L / v; if it stands for the difference, the
    law of Little (N = flow x time) gives N = q (L / v) (1 / r - 1) halted cars on L, and they
    fill ``7.5 m x q / v x (1 / r - 1)`` of each metre, at most all of it.

    Parameters
    ----------
    relative_speed : float
        Speed over free-flow speed, r.
    flow_per_lane_h : float
        Cars an hour and lane, q; 600 is a busy urban lane behind a traffic light.
    free_speed_mps : float
        Free-flow speed v in m/s; 50 km/h.

    Examples
    --------
    >>> round(queue_share(0.5), 3), queue_share(1.0), queue_share(0.0)
    (0.09, 0.0, 1.0)
    """
    if relative_speed <= 0:
        return 1.0
    halted_per_m = flow_per_lane_h / 3600 / free_speed_mps * (1 / relative_speed - 1)
    return min(1.0, max(0.0, SPACING_M * halted_per_m))


QUEUE_SHARE: Mapping[str, float] = {
    "free": 0.0,
    "slow": queue_share((0.25 + 0.75) / 2),
    "very_slow": queue_share((0.10 + 0.25) / 2),
    "stationary": 1.0,
    "closed": 0.0,
    "unknown": 0.0,
}
"""Share of the length that queued cars fill, by status: ``queue_share`` in the middle of each band
of the default profile (slow 0.09, very slow 0.42), and all of a stationary street."""


def filled_fraction(
    status: Objects, queue_m: Floats, length_m: Floats, shares: Mapping[str, float] = QUEUE_SHARE
) -> Floats:
    """Return the share of each segment that queued cars fill.

    The measured queue over the length where there is one, at most 1; else the status's share.

    Parameters
    ----------
    status : (N,) words of the status scale
    queue_m : (N,) measured queues in metres, NaN for none
    length_m : (N,) lengths of the segments in metres
    shares : of the length, 0 to 1, by status

    Examples
    --------
    >>> status = np.array(["stationary", "slow"], dtype=object)
    >>> filled_fraction(status, np.array([np.nan, 30.0]), np.array([100.0, 120.0])).tolist()
    [1.0, 0.25]
    """
    by_status = np.array([shares[word] for word in status.tolist()], dtype=float)
    measured = np.clip(queue_m / length_m, 0.0, 1.0)
    return np.where(np.isfinite(queue_m), measured, by_status)

"""How far the answer depends on the threshold: the table under every profile and occupied set."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from covertool.congestion.occupancy import days_of, table_of_days
from covertool.congestion.options import OccupancyOptions
from covertool.congestion.status import SPEED_PROFILES, Profile, status_of_speed
from covertool.congestion.streets import Streets
from covertool.model import Observations, OccupancyTable

OCCUPIED_SETS = (
    ("slow", "very_slow", "stationary"),
    ("very_slow", "stationary"),
    ("stationary",),
)


@dataclass(frozen=True)
class Variant:
    """One table, with the profile (None: statuses as they came) and set that made it."""

    profile: str | None
    occupied: tuple[str, ...]
    table: OccupancyTable


def sensitivity(
    observations: Observations,
    network: Streets,
    options: OccupancyOptions,
    profiles: tuple[Profile, ...] = SPEED_PROFILES,
) -> list[Variant]:
    """Return the occupancy table under each profile and occupied set.

    Only observations with a relative speed change with the profile; where there is none at all,
    the statuses count as they came.

    Parameters
    ----------
    observations, network, options : as in `covertool.congestion.occupancy.days_of`
    profiles : the profiles to compare; each has bands of relative speed
    """
    has_speed = np.isfinite(observations.relative_speed)
    cases: list[tuple[str | None, Observations]] = [(None, observations)]
    if has_speed.any():
        cases = [(p.name, _under(observations, p)) for p in profiles]
    return [
        Variant(name, occupied, _table(seen, network, replace(options, occupied=occupied)))
        for name, seen in cases
        for occupied in OCCUPIED_SETS
    ]


def _table(seen: Observations, network: Streets, options: OccupancyOptions) -> OccupancyTable:
    return table_of_days(days_of(seen, network, options), options)


def _under(observations: Observations, profile: Profile) -> Observations:
    """Return the observations with the status that a profile gives to their speed."""
    by_speed = status_of_speed(observations.relative_speed, profile)
    # A closed road stays closed whatever speed it reports.
    keep = ~np.isfinite(observations.relative_speed) | (observations.status == "closed")
    return replace(observations, status=np.where(keep, observations.status, by_speed))

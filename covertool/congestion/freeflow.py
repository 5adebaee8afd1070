"""Free-flow speeds that the street network knows and the feed does not."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from covertool.congestion.status import DATEX, UNKNOWN, Profile, status_of_speed
from covertool.congestion.streets import ID_COLUMNS
from covertool.model import Observations

if TYPE_CHECKING:
    import geopandas as gpd

_COLUMNS = (("free_flow_mps", 1.0), ("free_flow_kmh", 1 / 3.6))


def with_free_flow(
    observations: Observations, segments: gpd.GeoDataFrame, profile: Profile | None = None
) -> Observations:
    """Return observations whose speed became a relative one by the network's free-flow speed.

    The network's column is ``free_flow_mps`` or ``free_flow_kmh``. A relative speed that is known
    stays; so does a status, but an unknown one is told from the speed.
    """
    import pandas as pd

    name, unit = next(((n, u) for n, u in _COLUMNS if n in segments), (None, 1.0))
    ids = next((column for column in ID_COLUMNS if column in segments), None)
    if name is None or ids is None:
        return observations
    free = pd.to_numeric(segments[name], errors="coerce").to_numpy(dtype=float) * unit
    of_segment = dict(zip(segments[ids].astype(str), free, strict=True))
    limit = np.array([of_segment.get(s, np.nan) for s in observations.segment_id.tolist()])
    with np.errstate(divide="ignore", invalid="ignore"):
        quotient = np.where(limit > 0, observations.speed_mps / limit, np.nan)
    known = np.isfinite(observations.relative_speed)
    relative = np.where(known, observations.relative_speed, quotient)
    bands = profile if profile is not None and profile.bands is not None else DATEX
    unknown = observations.status == UNKNOWN
    status = np.where(unknown, status_of_speed(relative, bands), observations.status)
    return replace(observations, relative_speed=relative, status=status)

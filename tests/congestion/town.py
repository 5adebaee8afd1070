"""Small invented networks and observations whose answers can be counted by hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import geopandas as gpd
import shapely

from covertool.model import Observations

SHARED = Path(__file__).resolve().parents[2] / "../shared/data/congestion"


def network(lengths_m: Mapping[str, float], **columns: Sequence[object]) -> gpd.GeoDataFrame:
    """Return parallel streets of given lengths, 100 m apart, running east."""
    lines = [
        shapely.LineString([(0, 100 * row), (length, 100 * row)])
        for row, length in enumerate(lengths_m.values())
    ]
    ids = {"segment_id": list(lengths_m)}
    return gpd.GeoDataFrame({**ids, **columns}, geometry=lines, crs=2157)


def seen(*rows: tuple[str, str, str]) -> Observations:
    """Return observations of (segment, UTC time, status)."""
    ids, times, statuses = zip(*rows, strict=True)
    return Observations.from_columns(ids, list(times), statuses)

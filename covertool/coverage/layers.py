"""The level layers of a study: one layer a level, one row for each radius asked for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from covertool.coverage.radii import Radius, radii_of
from covertool.coverage.regions import level_regions
from covertool.model import LEVELS, Anchors, TransitArea

if TYPE_CHECKING:
    import geopandas as gpd


def level_layers(
    anchors: Anchors, transit: TransitArea, radii: Sequence[Radius]
) -> dict[str, gpd.GeoDataFrame]:
    """Return layers ``coverage_level_1`` to ``_3`` with one row for each radius.

    Columns: ``level``, ``radius_m``, ``device_class``, ``area_m2`` and the geometry. A level that
    covers nothing at a radius has no row for it.
    """
    import geopandas as gpd

    rows: dict[int, list[dict[str, object]]] = {level: [] for level in LEVELS[1:]}
    for radius in radii:
        named = radii_of(anchors, radius)
        for level, region in level_regions(anchors, transit, radius).items():
            if region.is_empty:
                continue
            rows[level].append(
                {
                    "level": level,
                    "radius_m": named.radius_m,
                    "device_class": named.device_class,
                    "area_m2": region.area,
                    "geometry": region,
                }
            )
    columns = ["level", "radius_m", "device_class", "area_m2", "geometry"]
    return {
        f"coverage_level_{level}": gpd.GeoDataFrame(
            found, columns=columns, geometry="geometry", crs=transit.crs
        ).astype({"radius_m": float, "area_m2": float, "level": int})
        for level, found in rows.items()
    }


def joined(layers: dict[str, gpd.GeoDataFrame]) -> gpd.GeoDataFrame:
    """Return the rows of all level layers as one layer, for formats that hold only one."""
    import pandas as pd

    return pd.concat(list(layers.values()), ignore_index=True)

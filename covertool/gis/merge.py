"""New anchors among those that a study holds already."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from covertool.gis.layers import geometry_layers, read_layer

if TYPE_CHECKING:
    import geopandas as gpd


def anchors_beside_others(frame: gpd.GeoDataFrame, study: Path, origin: str) -> gpd.GeoDataFrame:
    """Return a study's anchors of other origins with the new ones after them, in its CRS.

    Parameters
    ----------
    frame : GeoDataFrame
        New anchors, all of one origin, with a column ``synthetic``.
    study : Path
        It may be absent or lack anchors.
    origin : str
        The origin whose old anchors make room for the new ones.
    """
    import geopandas as gpd
    import pandas as pd

    if not study.is_file() or "anchors" not in geometry_layers(study, study):
        return frame
    layer = read_layer(f"{study}:anchors", "anchors")
    kept = layer.frame.drop(columns=["x_m", "y_m"], errors="ignore")
    # Anchors that name no origin are parked ones, as everywhere in covertool.
    of = kept["origin"].fillna("parked") if "origin" in kept else "parked"
    kept = kept[pd.Series(of, index=kept.index) != origin]
    if kept.empty:
        return frame
    if "synthetic" not in kept:
        kept = kept.assign(synthetic=False)
    moved = frame.drop(columns=["x_m", "y_m"]).to_crs(layer.crs)
    return gpd.GeoDataFrame(pd.concat([kept, moved], ignore_index=True), crs=layer.crs)

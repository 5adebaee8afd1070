"""`covertool anchors`: the group of verbs that make anchors."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from covertool.cli.app import Verbs, app

if TYPE_CHECKING:
    from geopandas import GeoDataFrame

anchors_app = Verbs(
    name="anchors",
    help="""Make anchors: parked cars, queued cars.

    \b
    Examples:
      covertool anchors parked --osm town.osm.pbf --into town.gpkg
      covertool anchors queue --coverage 15
    """,
    no_args_is_help=True,
    rich_markup_mode=None,
)
app.add_typer(anchors_app)


def beside_others(frame: GeoDataFrame, into: Path, origin: str) -> GeoDataFrame:
    """Return a study's anchors of other origins with the new ones after them, in its CRS.

    Parameters
    ----------
    frame : GeoDataFrame
        New anchors, all of one origin, with a column ``synthetic``.
    into : Path
        The study; it may be absent or lack anchors.
    origin : str
        The origin whose old anchors make room for the new ones.
    """
    import geopandas as gpd
    import pandas as pd

    from covertool.gis.layers import geometry_layers, read_layer

    if not into.is_file() or "anchors" not in geometry_layers(into, into):
        return frame
    layer = read_layer(f"{into}:anchors", "anchors")
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

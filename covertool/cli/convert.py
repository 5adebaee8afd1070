"""`covertool convert`: anchors or a transit area as GeoParquet that tiles read piece by piece."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from covertool.cli import options
from covertool.cli.app import app
from covertool.cli.console import say

Source = Annotated[
    str, typer.Argument(metavar="FILE[:LAYER]", help="Anchors (points) or a transit area.")
]
Output = Annotated[Path, typer.Argument(metavar="OUT.parquet", help="The GeoParquet to write.")]


@app.command()
def convert(
    source: Source,
    output: Output,
    overwrite: options.Overwrite = False,
    crs: options.Crs = None,
    dst_crs: options.DstCrs = None,
) -> None:
    """Write anchors or a transit area sorted in space, for large runs of covertool coverage.

    \b
    Examples:
      covertool convert country.gpkg:anchors cars.parquet
      covertool convert country.gpkg:transit roads.parquet
      covertool coverage --anchors cars.parquet --transit roads.parquet --radius 15 --workers 4

    \b
    Polygons are taken for a transit area and cut in small pieces. For other formats and layers
    use covertool export.
    """
    from covertool.gis.layers import read_layer
    from covertool.gis.parquet import write_anchors
    from covertool.gis.read import read_anchors, read_transit
    from covertool.gis.sources import write_transit

    if read_layer(source, "anchors", crs).is_areal:
        transit = read_transit(source, crs=crs, dst_crs=dst_crs)
        write_transit(output, transit, overwrite=overwrite)
        say(f"wrote a transit area of {transit.area_m2:,.0f} m2 to {output}")
    else:
        anchors = read_anchors(source, crs=crs, dst_crs=dst_crs)
        write_anchors(output, anchors, overwrite=overwrite)
        say(f"wrote {len(anchors):,} anchors to {output}")

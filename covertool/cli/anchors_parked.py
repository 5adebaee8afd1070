"""`covertool anchors parked`: parked cars where OpenStreetMap says that cars park."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from covertool.cli import options
from covertool.cli.anchors import anchors_app, beside_others
from covertool.cli.console import print_json, say
from covertool.cli.whence import whence

OsmFile = Annotated[Path, typer.Option("--osm", metavar="FILE", help="OpenStreetMap extract.")]
Occupancy = Annotated[
    float, typer.Option("--occupancy", metavar="SHARE", help="Share of bays that are taken.")
]


@anchors_app.command("parked")
def parked(
    osm: OsmFile,
    occupancy: Occupancy = 0.8,
    seed: options.Seed = 1,
    output: options.Output = None,
    into: options.Into = None,
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
) -> None:
    """Put parked cars (synthetic) at kerbs and in lots that OpenStreetMap tags for parking.

    \b
    Examples:
      covertool anchors parked --osm town.osm.pbf --into town.gpkg
      covertool anchors parked --osm town.osm.pbf --occupancy 0.6 --seed 2 -o parked.gpkg

    \b
    With --into, anchors of other origins (queue, rsu) stay in the study.
    A car takes 6.0 m of kerb when parallel, 3.4 m when diagonal, 2.4 m when perpendicular.
    """
    from covertool.extract.parking import parked_anchors
    from covertool.gis.osm import read_parking_areas, read_roads
    from covertool.gis.write import write_layers

    if output is None and into is None and not as_json:
        raise typer.BadParameter("name a file to write", param_hint="-o / --into")
    cars = parked_anchors(read_roads(osm), read_parking_areas(osm), occupancy=occupancy, seed=seed)
    origin = whence([osm])
    frame = cars.to_frame().assign(synthetic=True)
    metadata = origin.to_metadata()
    if output is not None:
        layers = {"anchors": frame}
        write_layers(output, layers, overwrite=overwrite, metadata=metadata, inputs=[osm])
    if into is not None:
        layers = {"anchors": beside_others(frame, into, "parked")}
        write_layers(into, layers, into=True, metadata=metadata, inputs=[osm])
    if as_json:
        content = {"anchors": len(cars), "occupancy": occupancy, "seed": seed}
        print_json("anchors parked", {**content, "provenance": origin.to_json()})
        return
    typer.echo(f"{len(cars)} parked cars (synthetic, occupancy {occupancy:g}, seed {seed})")
    for path in (output, into):
        if path is not None:
            say(f"wrote layer anchors to {path}")

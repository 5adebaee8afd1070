"""`covertool anchors parked`: parked cars where OpenStreetMap says that cars park."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from covertool.cli import options
from covertool.cli.anchors import anchors_app, write_anchors
from covertool.cli.console import print_json
from covertool.cli.target import Target
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

    target = Target(output, into, overwrite)
    target.require(as_json)
    cars = parked_anchors(read_roads(osm), read_parking_areas(osm), occupancy=occupancy, seed=seed)
    made_from = whence([osm])
    write_anchors(target, cars.to_frame(), "parked", made_from, inputs=[osm])
    if as_json:
        content = {"anchors": len(cars), "occupancy": occupancy, "seed": seed}
        print_json("anchors parked", {**content, "provenance": made_from.to_json()})
    else:
        typer.echo(f"{len(cars)} parked cars (synthetic, occupancy {occupancy:g}, seed {seed})")

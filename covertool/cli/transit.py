"""`covertool transit`: where cars drive, from an OpenStreetMap extract or a mask."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from covertool.cli import options
from covertool.cli.app import app
from covertool.cli.console import print_json
from covertool.cli.target import Target
from covertool.cli.whence import whence

if TYPE_CHECKING:
    from covertool.model import RasterSource, TransitArea

Tunnels = Annotated[bool, typer.Option("--tunnels", help="With roads in tunnels.")]
Private = Annotated[bool, typer.Option("--private", help="With private and forbidden roads.")]
Yards = Annotated[bool, typer.Option("--yards", help="With driveways and parking aisles.")]
Gsd = Annotated[
    float | None,
    typer.Option("--gsd", metavar="METRES", help="Ground size of a pixel without georeference."),
]
Origin = Annotated[
    str | None,
    typer.Option("--origin", metavar="X,Y", help="Map place of the lower left corner."),
]

OSM_SUFFIXES = (".osm", ".osm.gz", ".osm.pbf", ".pbf", ".osm.bz2")


@app.command("transit")
def transit(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="OSM extract, or a mask raster.")],
    tunnels: Tunnels = False,
    private: Private = False,
    yards: Yards = False,
    gsd: Gsd = None,
    crs: options.Crs = None,
    origin: Origin = None,
    output: options.Output = None,
    into: options.Into = None,
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
) -> None:
    """Make the transit area (layer "transit") from an OpenStreetMap extract or a mask.

    \b
    Examples:
      covertool transit town.osm.pbf -o town.gpkg
      covertool transit roads.tif --into town.gpkg
      covertool transit mask.png --gsd 0.125 -o town.gpkg

    \b
    Roads are as wide as their width tag, else lanes times the lane width of their class, else two
    lanes. Tunnels, footways, private roads, driveways and parking aisles are left out.
    """
    target = Target(output, into, overwrite)
    target.require(as_json)
    if is_osm(file):
        area = osm_transit(file, tunnels=tunnels, private=private, yards=yards)
    else:
        area = mask_transit(file, None, gsd=gsd, crs=crs, origin=parsed_origin(origin))
    made_from = whence([file])
    target.write({"transit": area.to_frame()}, made_from.to_metadata(), inputs=[file])
    polygons = len(area.polygons.geoms)
    if as_json:
        content = {"transit_area_m2": area.area_m2, "polygons": polygons}
        print_json("transit", {**content, "provenance": made_from.to_json()})
    else:
        typer.echo(f"transit area: {area.area_m2:.0f} m2 in {polygons} polygons")


def is_osm(file: Path) -> bool:
    """Return True when the name is that of an OpenStreetMap extract."""
    return file.name.lower().endswith(OSM_SUFFIXES)


def osm_transit(
    file: Path, *, tunnels: bool = False, private: bool = False, yards: bool = False
) -> TransitArea:
    """Return the transit area of an OpenStreetMap extract."""
    from covertool.extract.carriageways import RoadChoice
    from covertool.extract.transit import transit_from_roads
    from covertool.gis.osm import read_roads

    return transit_from_roads(read_roads(file), RoadChoice(tunnels, private, yards))


def mask_transit(
    file: Path,
    image: RasterSource | None,
    *,
    gsd: float | None = None,
    crs: str | None = None,
    origin: tuple[float, float] | None = None,
) -> TransitArea:
    """Return the transit area of a mask, which may share the pixels of an image."""
    from covertool.extract.transit import transit_from_mask
    from covertool.gis.geotiff import has_georeference, open_raster

    if image is not None and not has_georeference(file):
        return transit_from_mask(open_raster(file, gsd_m=1.0), like=image)
    if has_georeference(file):
        gsd = origin = None
    return transit_from_mask(open_raster(file, gsd_m=gsd, crs=crs, origin=origin))


def parsed_origin(text: str | None) -> tuple[float, float] | None:
    """Return the two numbers of ``X,Y``."""
    if text is None:
        return None
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not X,Y", param_hint="--origin") from None
    return x, y

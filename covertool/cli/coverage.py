"""`covertool coverage`: how much of the transit area hears none, one, two, three and more."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from covertool.cli import options
from covertool.cli.app import app
from covertool.cli.console import print_json
from covertool.cli.coverage_files import (
    check_outputs,
    write_layers_of,
    write_plot,
    write_results,
)
from covertool.cli.coverage_findings import Findings, Town
from covertool.cli.coverage_output import json_content, print_findings
from covertool.cli.coverage_radii import asked_radii, choose_radii, shares_of
from covertool.cli.inputs import Inputs, choose_inputs, read_inputs
from covertool.cli.target import Target

Radii = Annotated[
    list[str] | None,
    typer.Option(
        "--radius",
        metavar="METRES",
        help="Radius of every anchor, or 'own' for each anchor's own (repeatable).",
    ),
]
Classes = Annotated[
    list[str] | None,
    typer.Option(
        "--device-class",
        metavar="A|B|C|D",
        help="DSRC class: A 15 m, B 100 m, C 400 m, D 1000 m (repeatable).",
    ),
]
Curve = Annotated[
    str | None,
    typer.Option(
        "--curve", metavar="START:STOP:COUNT", help="Also levels at COUNT radii, as 5:200:40."
    ),
]
Penetration = Annotated[
    str | None,
    typer.Option(
        "--penetration",
        metavar="SHARES",
        help="Also levels expected when only a share of cars is equipped, as 0.05,0.1,0.5.",
    ),
]
Raster = Annotated[
    float | None,
    typer.Option("--raster", metavar="METRES", help="With -o FILE.tif: pixel size of a level map."),
]
Zones = Annotated[
    str | None,
    typer.Option(
        "--by",
        metavar="ZONES[:FIELD]",
        help="Also each zone: polygons in a file, or a column of the transit layer.",
    ),
]
Aoi = Annotated[
    str | None,
    typer.Option("--aoi", metavar="FILE[:LAYER]", help="Only the transit area in these polygons."),
]
Plot = Annotated[
    Path | None,
    typer.Option("--plot", metavar="FILE", help="Draw --curve or --penetration (.png .svg .pdf)."),
]
Tile = Annotated[
    float | None,
    typer.Option("--tile", metavar="METRES", min=1, help="Compute in tiles of this size."),
]


@app.command()
def coverage(
    study: options.Study = None,
    radius: Radii = None,
    device_class: Classes = None,
    anchors: options.AnchorFiles = None,
    transit: options.TransitFile = None,
    output: options.Output = None,
    into: options.Into = None,
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
    by: Zones = None,
    aoi: Aoi = None,
    curve: Curve = None,
    penetration: Penetration = None,
    plot: Plot = None,
    raster: Raster = None,
    workers: options.Workers = 1,
    scheduler: options.Scheduler = None,
    tile: Tile = None,
    resume: options.Resume = None,
    crs: options.Crs = None,
    dst_crs: options.DstCrs = None,
) -> None:
    """Share of the transit area that hears no parked car, one, two, or three and more.

    \b
    Examples:
      covertool coverage --radius 15
      covertool coverage town.gpkg --radius 15 --radius 100 --into town.gpkg
      covertool coverage --anchors lonlat.csv --transit roads.geojson --json
      covertool coverage town.gpkg --curve 5:200:40 --plot curve.png
      covertool coverage --anchors cars.parquet --transit roads.parquet --workers 4

    \b
    Without --radius and --device-class each anchor's own radius counts if all have one, else 15 m.
    Without -o and --into nothing is written. -o FILE.gpkg makes a whole study: anchors, transit
    and layers coverage_level_1, _2 and _3, with one row for each radius; another vector format
    holds one layer of all levels; FILE.tif with --raster holds the levels as pixels. A GeoPackage
    also takes the tables: coverage_summary, and _curve, _penetration and _zones if asked for.
    Tiles (--workers, --scheduler, --tile, --resume) find the same with bounded memory when both
    files were written by covertool convert; their level layers have one row for each tile.
    """
    begun = time.perf_counter()
    inputs = choose_inputs(study, anchors, transit)
    curves = bool(curve or penetration)
    check_outputs(output, into, raster, plot, curves=curves, overwrite=overwrite)
    shares = shares_of(penetration)
    asked_radii(radius, device_class)  # a misspelt radius is told before anything is read
    target = Target(output, into, overwrite)
    if workers > 1 or scheduler or tile or resume:
        _refuse_with_tiles(output, raster)
        from covertool.cli.coverage_tiles import Asked, Tiling, run_tiles

        wanted = output is not None or into is not None
        found = run_tiles(
            inputs,
            Asked(radius, device_class, by, aoi, curve, shares, regions=wanted),
            crs,
            dst_crs,
            Tiling(workers, scheduler, tile, resume),
            lambda findings, layers: write_layers_of(findings, layers, inputs, target),
        )
    else:
        town = _read(inputs, radius, device_class, crs, dst_crs, aoi)
        found = _compute(town, curve, shares, by, inputs.transit)
        found = replace(found, raster=write_results(town, found, inputs, target, gsd_m=raster))
    if plot is not None:
        write_plot(found, inputs, plot, overwrite=overwrite)
    if as_json:
        content = json_content(found, inputs)
        print_json("coverage", {**content, "seconds": time.perf_counter() - begun})
    else:
        print_findings(found)


def _refuse_with_tiles(output: Path | None, raster: float | None) -> None:
    if raster is not None:
        raise typer.BadParameter("a raster is not made in tiles", param_hint="--raster")
    if output is not None and output.suffix.lower() != ".gpkg":
        raise typer.BadParameter(
            "tiles write their layers to a GeoPackage: name a .gpkg (covertool export converts it)",
            param_hint="-o",
        )


def _read(
    inputs: Inputs,
    radius: list[str] | None,
    device_class: list[str] | None,
    crs: str | None,
    dst_crs: str | None,
    aoi: str | None,
) -> Town:
    anchors, transit = read_inputs(inputs, crs, dst_crs)
    if aoi is not None:
        from covertool.coverage.zones import clip_transit
        from covertool.gis.zones import AreaOfInterest

        (shapes,) = AreaOfInterest(aoi, transit.crs).read().values()
        transit = clip_transit(transit, shapes)
    return Town(anchors, transit, tuple(choose_radii(radius, device_class, anchors)))


def _compute(
    town: Town, curve: str | None, shares: list[float], by: str | None, transit: str
) -> Findings:
    """Return all that was asked for, computed in memory."""
    from covertool.coverage import coverage_curve, coverage_levels
    from covertool.coverage.curve import parse_radii

    anchors, area, radii = town.anchors, town.transit, town.radii
    found = Findings(coverage_levels(anchors, area, radii), area.crs, area.polygons.bounds)
    if curve is not None:
        found = replace(found, curve=coverage_curve(anchors, area, parse_radii(curve)))
    if shares:
        from covertool.coverage.penetration import penetration

        found = replace(found, penetration=penetration(anchors, area, radii, shares))
    if by is not None:
        from covertool.coverage.zones import zone_levels
        from covertool.gis.zones import ZonesOf

        zones = ZonesOf(by, transit, area.crs).read()
        found = replace(found, zones=zone_levels(anchors, area, zones, radii))
    return found

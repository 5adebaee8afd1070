"""What `covertool coverage` writes: layers, pixels and plots."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import typer

from covertool.cli.console import say
from covertool.cli.coverage_findings import Findings, RasterFindings, Town
from covertool.cli.coverage_output import size_text
from covertool.cli.inputs import Inputs
from covertool.cli.target import Target
from covertool.cli.whence import whence


def check_outputs(
    output: Path | None,
    into: Path | None,
    raster: float | None,
    plot: Path | None,
    *,
    curves: bool,
    overwrite: bool,
) -> None:
    """Refuse options that do not go together and files that may not be written, at once."""
    if output is not None and into is not None:
        raise typer.BadParameter("use -o or --into, not both", param_hint="--into")
    pixels = output is not None and output.suffix.lower() in (".tif", ".tiff")
    if pixels != (raster is not None):
        raise typer.BadParameter(
            "--raster METRES and -o FILE.tif go together", param_hint="--raster"
        )
    if plot is not None and not curves:
        raise typer.BadParameter("add --curve or --penetration to draw", param_hint="--plot")
    if output is not None or plot is not None:
        from covertool.gis.figure import FIGURE_FORMATS
        from covertool.gis.formats import RASTER_FORMATS, VECTOR_OUTPUTS
        from covertool.gis.guard import output_file

        if output is not None:
            formats = RASTER_FORMATS[:1] if pixels else VECTOR_OUTPUTS
            output_file(output, formats, overwrite=overwrite)
        if plot is not None:
            output_file(plot, FIGURE_FORMATS, overwrite=overwrite)


def write_results(
    town: Town, found: Findings, inputs: Inputs, target: Target, *, gsd_m: float | None
) -> RasterFindings | None:
    """Write levels as layers or pixels; a new study also carries what they were computed from."""
    if target.output is not None and gsd_m is not None:
        return _write_raster(town, target.output, gsd_m, target.overwrite)
    if target.output is not None or target.into is not None:
        write_layers_of(found, _town_layers(town, target.output), inputs, target)
    return None


def _town_layers(town: Town, output: Path | None) -> dict[str, Any]:
    from covertool.coverage.layers import joined, level_layers

    layers = level_layers(town.anchors, town.transit, town.radii)
    if output is None:
        return dict(layers)
    if output.suffix.lower() != ".gpkg":
        return {"coverage": joined(layers)}
    return {"anchors": town.anchors.to_frame(), "transit": town.transit.to_frame(), **layers}


def write_layers_of(
    found: Findings, layers: Mapping[str, Any], inputs: Inputs, target: Target
) -> None:
    """Write layers, and to a GeoPackage the tables of what was found, with their provenance."""
    path = target.into or target.output
    if path is None:
        return
    from covertool.coverage.tables import finding_tables
    from covertool.gis.study import inherited_metadata

    files = inputs.files()
    metadata = {**inherited_metadata(files), **whence(files).to_metadata()}
    whole = dict(layers)
    if path.suffix.lower() == ".gpkg":
        whole |= finding_tables(found.report, found.curve, found.penetration, found.zones)
    target.write(whole, metadata, inputs=[] if target.into is not None else files)


def write_plot(found: Findings, inputs: Inputs, path: Path, *, overwrite: bool) -> None:
    """Draw the curve and the shares of equipped cars; those of a synthetic study say so."""
    from covertool.gis.figure import write_figure
    from covertool.gis.study import inherited_metadata
    from covertool.report.curves import level_curves

    kind = "synthetic anchors" if "synthetic" in inherited_metadata(inputs.files()) else "anchors"
    panels = _panels(found, f"{found.report.anchors:,} {kind}")
    write_figure(path, level_curves(panels), overwrite=overwrite)
    say(f"wrote {path}")


def _panels(found: Findings, count: str) -> list[Any]:
    import numpy as np

    from covertool.report.curves import LevelCurve

    panels = []
    if found.curve is not None:
        curve = found.curve
        panels.append(LevelCurve(count, "radius (m)", curve.radius_m, curve.fractions))
    for size in dict.fromkeys(size_text(p.radius_m, p.device_class) for p in found.penetration):
        points = sorted(
            (p for p in found.penetration if size_text(p.radius_m, p.device_class) == size),
            key=lambda point: point.share,
        )
        shares = np.array([100 * p.share for p in points])
        expected = np.array([p.expected for p in points])
        panels.append(LevelCurve(f"{count}, {size}", "equipped cars (%)", shares, expected))
    return panels


def _write_raster(town: Town, path: Path, gsd_m: float, overwrite: bool) -> RasterFindings:
    from covertool.coverage.radii import radii_of
    from covertool.coverage.raster import grid_over, level_rows
    from covertool.coverage.scanlines import depth_profile
    from covertool.errors import OptionError
    from covertool.gis.level_raster import write_level_raster

    if len(town.radii) > 1:
        raise OptionError(
            "a raster holds the levels of one radius", "--raster", "name one --radius"
        )
    anchors, polygons = town.anchors, town.transit.polygons
    grid = grid_over(polygons, gsd_m)
    each_m = radii_of(anchors, town.radii[0]).each_m
    rows = level_rows(anchors.x_m, anchors.y_m, each_m, polygons, grid)
    write_level_raster(
        path,
        ((first, 0, block) for first, block in rows),
        (grid.height, grid.width),
        (gsd_m, 0.0, grid.left_m, 0.0, -gsd_m, grid.top_m),
        town.transit.crs,
        overwrite=overwrite,
    )
    say(f"wrote {grid.width} x {grid.height} pixels to {path}")
    profile = depth_profile(anchors.x_m, anchors.y_m, each_m, polygons, gsd_m)
    return RasterFindings(gsd_m, grid.width, grid.height, tuple(profile.levels()[0].tolist()))

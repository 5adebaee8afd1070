"""What `covertool coverage` hands back: a table, JSON, layers, pixels and plots."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from covertool.cli.console import print_table, say

if TYPE_CHECKING:
    from pyproj import CRS

    from covertool.cli.inputs import Inputs
    from covertool.coverage import CoverageCurve
    from covertool.coverage.penetration import PenetrationPoint
    from covertool.coverage.radii import Radius
    from covertool.coverage.zones import ZoneCoverage
    from covertool.model import Anchors, Bounds, CoverageReport, RadiusCoverage, TransitArea

LEVEL_ROWS = (("Level 0", (0,)), ("Level 1", (1,)), ("Level 2", (2,)), ("Level 3", (3,)))


@dataclass(frozen=True)
class Town:
    """What a run in memory is about."""

    anchors: Anchors
    transit: TransitArea
    radii: tuple[Radius, ...]


@dataclass(frozen=True)
class RasterFindings:
    """Size of the level raster, and the fractions counted along the lines of its rows."""

    gsd_m: float
    width: int
    height: int
    fractions: tuple[float, ...]


@dataclass(frozen=True)
class Findings:
    """What one run found; what was not asked for is empty."""

    report: CoverageReport
    crs: CRS
    bounds: Bounds
    curve: CoverageCurve | None = None
    penetration: tuple[PenetrationPoint, ...] = ()
    zones: tuple[ZoneCoverage, ...] = ()
    raster: RasterFindings | None = None


def check_outputs(
    output: Path | None, into: Path | None, raster: float | None, plot: Path | None, curves: bool
) -> None:
    """Refuse options that do not go together, before anything is computed."""
    if output is not None and into is not None:
        raise typer.BadParameter("use -o or --into, not both", param_hint="--into")
    pixels = output is not None and output.suffix.lower() in (".tif", ".tiff")
    if pixels != (raster is not None):
        raise typer.BadParameter(
            "--raster METRES and -o FILE.tif go together", param_hint="--raster"
        )
    if plot is not None and not curves:
        raise typer.BadParameter("add --curve or --penetration to draw", param_hint="--plot")


def print_findings(found: Findings) -> None:
    """Print the tables of a run."""
    from covertool import crs as crs_door

    x0, y0, x1, y1 = found.bounds
    scale = crs_door.scale_factor(found.crs, (x0 + x1) / 2, (y0 + y1) / 2)
    print_report(found.report, f"{crs_door.name(found.crs)} (scale factor {scale:.6f})")
    if found.curve is not None:
        nodes = zip(found.curve.radius_m, found.curve.fractions, strict=True)
        rows = [(f"{radius_m:g}", *_percents(fractions)) for radius_m, fractions in nodes]
        _print_part("Against the radius, %", "radius (m)", rows)
    if found.penetration:
        rows = [
            (
                f"{p.share:g} at {_size(p.radius_m, p.device_class)}",
                *_percents(p.expected),
                f"{100 * max(p.se):.4f}",
            )
            for p in found.penetration
        ]
        _print_part("Expected when only a share of the cars is equipped, %", "share", rows, ["se"])
    if found.raster is not None:
        rows = [(f"{found.raster.gsd_m:g}", *_percents(found.raster.fractions))]
        _print_part("Along the rows of the raster, %", "pixel (m)", rows)
    if found.zones:
        rows = [
            (
                f"{z.zone} at {_size(z.coverage.radius_m, z.coverage.device_class)}",
                *_percents(z.coverage.fractions),
                f"{z.transit_area_m2:,.0f}",
            )
            for z in found.zones
        ]
        _print_part("By zone, %", "zone", rows, ["transit m2"])


def print_report(report: CoverageReport, crs: str) -> None:
    """Print the table of levels: m2 and % for each radius; another table where origins differ."""
    typer.echo(f"Transit area {report.transit_area_m2:,.0f} m2, {report.anchors:,} anchors, {crs}")
    for origin in dict.fromkeys(result.origin for result in report.results):
        results = [result for result in report.results if result.origin == origin]
        title = f"\n{results[0].anchors:,} anchors of origin {origin}" if origin else ""
        columns = [
            "",
            *[
                text
                for result in results
                for text in (f"{_size(result.radius_m, result.device_class)}: m2", "%")
            ],
        ]
        rows = [
            [label, *[text for result in results for text in _cells(result, levels)]]
            for label, levels in (*LEVEL_ROWS, ("covered (1 to 3)", (1, 2, 3)))
        ]
        print_table(columns, rows, title)
    worst = max(result.closure_m for result in report.results)
    typer.echo(f"Level 3 is three or more. Closure residual {worst:.1e} m.")


def json_content(found: Findings, inputs: Inputs) -> dict[str, Any]:
    """Return the content of ``coverage --json`` but for the seconds."""
    from covertool.gis.provenance import provenance

    content: dict[str, Any] = {
        "transit_area_m2": found.report.transit_area_m2,
        "anchors": found.report.anchors,
        "results": [_json_result(result) for result in found.report.results],
    }
    if found.curve is not None:
        nodes = zip(found.curve.radius_m, found.curve.fractions, found.curve.slopes, strict=True)
        content["curve"] = [
            {"radius_m": radius_m, "fractions": fractions, "slopes": slopes}
            for radius_m, fractions, slopes in nodes
        ]
    if found.penetration:
        content["penetration"] = [asdict(point) for point in found.penetration]
    if found.zones:
        content["zones"] = [
            {
                "zone": z.zone,
                "radius_m": z.coverage.radius_m,
                "device_class": z.coverage.device_class,
                "transit_area_m2": z.transit_area_m2,
                "fractions": z.coverage.fractions,
            }
            for z in found.zones
        ]
    if found.raster is not None:
        content["raster"] = asdict(found.raster)
    files = [str(path) for path in inputs.files()]
    content["provenance"] = provenance(sys.argv[1:], files).to_json()
    return content


def write_results(
    town: Town,
    *,
    output: Path | None,
    into: Path | None,
    overwrite: bool,
    gsd_m: float | None,
) -> RasterFindings | None:
    """Write levels as layers or pixels; a new study also carries what they were computed from."""
    if output is not None and gsd_m is not None:
        return _write_raster(town, output, gsd_m, overwrite)
    if output is not None or into is not None:
        _write_levels(town, output, into, overwrite)
    return None


def _write_levels(town: Town, output: Path | None, into: Path | None, overwrite: bool) -> None:
    from covertool.coverage.layers import joined, level_layers
    from covertool.gis.write import write_layers

    layers = level_layers(town.anchors, town.transit, town.radii)
    if into is not None:
        write_layers(into, layers, into=True)
    elif output is not None and output.suffix.lower() == ".gpkg":
        inputs = {"anchors": town.anchors.to_frame(), "transit": town.transit.to_frame()}
        layers = {**inputs, **layers}
        write_layers(output, layers, overwrite=overwrite)
    elif output is not None:
        layers = {"coverage": joined(layers)}
        write_layers(output, layers, overwrite=overwrite)
    say(f"wrote {', '.join(layers)} to {into or output}")


def write_plot(found: Findings, path: Path, *, overwrite: bool) -> None:
    """Draw the curve and the shares of equipped cars."""
    from covertool.gis.figure import write_figure
    from covertool.report.curves import level_curves

    write_figure(path, level_curves(_panels(found)), overwrite=overwrite)
    say(f"wrote {path}")


def _panels(found: Findings) -> list[Any]:
    import numpy as np

    from covertool.report.curves import LevelCurve

    count = f"{found.report.anchors:,} anchors"
    panels = []
    if found.curve is not None:
        curve = found.curve
        panels.append(LevelCurve(count, "radius (m)", curve.radius_m, curve.fractions))
    for size in dict.fromkeys(_size(p.radius_m, p.device_class) for p in found.penetration):
        points = sorted(
            (p for p in found.penetration if _size(p.radius_m, p.device_class) == size),
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


def _json_result(result: RadiusCoverage) -> dict[str, Any]:
    pairs = zip(result.areas_m2, result.fractions, strict=True)
    return {
        "device_class": result.device_class,
        "radius_m": result.radius_m,
        "origin": result.origin,
        "anchors": result.anchors,
        "closure_m": result.closure_m,
        "levels": {
            str(level): {"area_m2": area, "fraction": share}
            for level, (area, share) in enumerate(pairs)
        },
    }


def _print_part(
    title: str, first: str, rows: Iterable[Sequence[str]], more: Sequence[str] = ()
) -> None:
    typer.echo()
    print_table([first, *(label for label, _ in LEVEL_ROWS), *more], rows, title)


def _percents(fractions: Sequence[float]) -> list[str]:
    return [f"{100 * share:.2f}" for share in fractions]


def _size(radius_m: float | None, device_class: str | None) -> str:
    size = "mixed radii" if radius_m is None else f"{radius_m:g} m"
    return f"class {device_class}, {size}" if device_class else size


def _cells(result: RadiusCoverage, levels: tuple[int, ...]) -> tuple[str, str]:
    area = sum(result.areas_m2[level] for level in levels)
    share = sum(result.fractions[level] for level in levels)
    return f"{area:,.0f}", f"{100 * share:.2f}"

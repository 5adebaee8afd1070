"""What `covertool coverage` prints: tables or JSON."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import typer

from covertool.cli.console import print_table
from covertool.cli.coverage_findings import Findings
from covertool.cli.whence import whence

if TYPE_CHECKING:
    from covertool.cli.inputs import Inputs
    from covertool.model import CoverageReport, RadiusCoverage

LEVEL_ROWS = (("Level 0", (0,)), ("Level 1", (1,)), ("Level 2", (2,)), ("Level 3", (3,)))


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
                f"{p.share:g} at {size_text(p.radius_m, p.device_class)}",
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
                f"{z.zone} at {size_text(z.coverage.radius_m, z.coverage.device_class)}",
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
                for text in (f"{size_text(result.radius_m, result.device_class)}: m2", "%")
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
    content["provenance"] = whence(files).to_json()
    return content


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


def size_text(radius_m: float | None, device_class: str | None) -> str:
    """Return how a radius is called in tables."""
    size = "mixed radii" if radius_m is None else f"{radius_m:g} m"
    return f"class {device_class}, {size}" if device_class else size


def _cells(result: RadiusCoverage, levels: tuple[int, ...]) -> tuple[str, str]:
    area = sum(result.areas_m2[level] for level in levels)
    share = sum(result.fractions[level] for level in levels)
    return f"{area:,.0f}", f"{100 * share:.2f}"

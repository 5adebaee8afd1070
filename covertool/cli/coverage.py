"""`covertool coverage`: how much of the transit area hears none, one, two, three and more."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from covertool.cli import options
from covertool.cli.app import app
from covertool.cli.console import print_json, print_table, say
from covertool.cli.inputs import choose_inputs, read_inputs

if TYPE_CHECKING:
    from covertool.coverage.radii import Radius
    from covertool.model import Anchors, CoverageReport, RadiusCoverage, TransitArea

DEFAULT_RADIUS_M = 15.0
OWN = "own"

Study = Annotated[
    Path | None,
    typer.Argument(metavar="STUDY.gpkg", help="A study; without one the sample study."),
]
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


@app.command()
def coverage(
    study: Study = None,
    radius: Radii = None,
    device_class: Classes = None,
    anchors: options.AnchorFiles = None,
    transit: options.TransitFile = None,
    output: options.Output = None,
    into: options.Into = None,
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
    crs: options.Crs = None,
    dst_crs: options.DstCrs = None,
) -> None:
    """Share of the transit area that hears no parked car, one, two, or three and more.

    \b
    Examples:
      covertool coverage --radius 15
      covertool coverage town.gpkg --radius 15 --radius 100 --into town.gpkg
      covertool coverage --anchors cars.csv --crs EPSG:2157 --transit roads.geojson --json

    \b
    Without --radius and --device-class each anchor's own radius counts if all have one, else 15 m.
    With -o or --into the levels are written as layers coverage_level_1, _2 and _3.
    """
    begun = time.perf_counter()
    if output is not None and into is not None:
        raise typer.BadParameter("use -o or --into, not both", param_hint="--into")
    inputs = choose_inputs(study, anchors, transit)
    from covertool.coverage import coverage_levels

    cars, area = read_inputs(inputs, crs, dst_crs)
    radii = _radii(radius, device_class, cars)
    report = coverage_levels(cars, area, radii)
    if output is not None or into is not None:
        _write(cars, area, radii, output, into, overwrite)
    if as_json:
        print_json("coverage", {**_content(report), "seconds": time.perf_counter() - begun})
    else:
        _print(report, area)


def _radii(radius: list[str] | None, classes: list[str] | None, anchors: Anchors) -> list[Radius]:
    """Return the radii that the options ask for, or the default, which is told."""
    from covertool.coverage.radii import radii_of
    from covertool.errors import ColumnError

    asked: list[Radius] = [None if text == OWN else _metres(text) for text in radius or []]
    asked += [name.strip().upper() for name in classes or []]
    if asked:
        return asked
    try:
        radii_of(anchors, None)
    except ColumnError:
        say(f"no --radius was given: using {DEFAULT_RADIUS_M:g} m (device class A)")
        return [DEFAULT_RADIUS_M]
    say("no --radius was given: using each anchor's own radius or device class")
    return [None]


def _metres(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise typer.BadParameter(
            f"{text!r} is neither a number of metres nor '{OWN}'", param_hint="--radius"
        ) from None


def _write(
    anchors: Anchors,
    transit: TransitArea,
    radii: list[Radius],
    output: Path | None,
    into: Path | None,
    overwrite: bool,
) -> None:
    """Write the level layers; a new study also carries what they were computed from."""
    from covertool.coverage.layers import level_layers
    from covertool.gis.write import write_layers

    layers = level_layers(anchors, transit, radii)
    if into is not None:
        write_layers(into, layers, into=True)
        say(f"wrote {', '.join(layers)} into {into}")
        return
    assert output is not None
    if output.suffix.lower() == ".gpkg":
        layers = {"anchors": anchors.to_frame(), "transit": transit.to_frame(), **layers}
    else:
        from covertool.coverage.layers import joined

        layers = {"coverage": joined(layers)}
    write_layers(output, layers, overwrite=overwrite)
    say(f"wrote {', '.join(layers)} to {output}")


def _content(report: CoverageReport) -> dict[str, Any]:
    return {
        "transit_area_m2": report.transit_area_m2,
        "anchors": report.anchors,
        "results": [
            {
                "device_class": result.device_class,
                "radius_m": result.radius_m,
                "origin": result.origin,
                "anchors": result.anchors,
                "closure_m": result.closure_m,
                "levels": {
                    str(level): {"area_m2": area, "fraction": share}
                    for level, (area, share) in enumerate(
                        zip(result.areas_m2, result.fractions, strict=True)
                    )
                },
            }
            for result in report.results
        ],
    }


def _print(report: CoverageReport, transit: TransitArea) -> None:
    from covertool import crs as crs_door

    x0, y0, x1, y1 = transit.polygons.bounds
    scale = crs_door.scale_factor(transit.crs, (x0 + x1) / 2, (y0 + y1) / 2)
    columns = ["", *[text for result in report.results for text in (_name(result), "%")]]
    rows = [
        [label, *[text for result in report.results for text in _cells(result, levels)]]
        for label, levels in (
            ("Level 0", (0,)),
            ("Level 1", (1,)),
            ("Level 2", (2,)),
            ("Level 3", (3,)),
            ("covered", (1, 2, 3)),
        )
    ]
    print_table(
        columns,
        rows,
        f"Transit area {report.transit_area_m2:,.0f} m2, {report.anchors:,} anchors, "
        f"{crs_door.name(transit.crs)} (scale factor {scale:.6f})",
    )
    worst = max(result.closure_m for result in report.results)
    typer.echo(f"Level 3 is three or more. Boundaries close to within {worst:.1e} m.")


def _name(result: RadiusCoverage) -> str:
    size = "mixed radii" if result.radius_m is None else f"{result.radius_m:g} m"
    parts = [
        f"class {result.device_class}," if result.device_class else "",
        size,
        result.origin or "",
    ]
    return " ".join(part for part in parts if part) + ": m2"


def _cells(result: RadiusCoverage, levels: tuple[int, ...]) -> tuple[str, str]:
    area = sum(result.areas_m2[level] for level in levels)
    share = sum(result.fractions[level] for level in levels)
    return f"{area:,.0f}", f"{100 * share:.2f}"

"""`covertool extract`: images in; vehicles, parked anchors and the transit area out."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from covertool.cli import options
from covertool.cli.app import app
from covertool.cli.console import print_json, print_table, progress, say
from covertool.cli.extract_files import (
    chosen_detector,
    image_files,
    job_ledger,
    one_picture,
    opened,
    require_free,
    require_one,
    town,
)
from covertool.cli.transit import Gsd, Origin, parsed_origin

if TYPE_CHECKING:
    from covertool.extract.score import Score
    from covertool.extract.vehicles import Extraction
    from covertool.model import RasterSource, TransitArea

Images = Annotated[
    list[Path],
    typer.Argument(
        metavar="IMAGE...", help="Top views from above; a VRT, or a .txt with one path a line."
    ),
]
MaskFile = Annotated[
    Path | None, typer.Option("--mask", metavar="MASK", help="Carriageway: 1 or 255 in a raster.")
]
OsmFile = Annotated[
    Path | None, typer.Option("--osm", metavar="FILE", help="Carriageway from OpenStreetMap.")
]
Lots = Annotated[
    str | None,
    typer.Option("--lots", metavar="FILE[:LAYER]", help="Parking areas (--osm brings its own)."),
]
Inside = Annotated[
    float,
    typer.Option("--parked-inside", metavar="METRES", help="Driving is deeper than this inside."),
]
Kerb = Annotated[
    float, typer.Option("--kerb", metavar="METRES", help="On the street is nearer than this.")
]
Threshold = Annotated[
    float | None, typer.Option("--threshold", metavar="SCORE", help="Least score, 0 to 1.")
]
DetectorName = Annotated[
    str | None, typer.Option("--detector", metavar="NAME", help="network (default) or classical.")
]
Model = Annotated[
    Path | None, typer.Option("--model", metavar="FILE.onnx", help="Your own YOLO-OBB model.")
]
ModelGsd = Annotated[
    float | None, typer.Option("--model-gsd", metavar="METRES", help="GSD of your own model.")
]
Tta = Annotated[bool, typer.Option("--tta", help="Look four ways round: slower, a little better.")]
Labels = Annotated[
    Path | None, typer.Option("--score", metavar="LABELS", help="Compare with labelled cars.")
]
Preview = Annotated[
    Path | None, typer.Option("--preview", metavar="OUT.png", help="Draw what was found.")
]
Force = Annotated[bool, typer.Option("--force", help="Go on with pixels above 0.35 m.")]
Workers = Annotated[int, typer.Option("--workers", metavar="N", help="Processes.")]
Scheduler = Annotated[
    str | None, typer.Option("--scheduler", metavar="ADDRESS", help="A dask scheduler.")
]
Resume = Annotated[
    Path | None,
    typer.Option("--resume", metavar="FOLDER", help="Keep finished windows here; go on with them."),
]


@app.command("extract")
def extract(
    images: Images,
    mask: MaskFile = None,
    osm: OsmFile = None,
    lots: Lots = None,
    gsd: Gsd = None,
    crs: options.Crs = None,
    origin: Origin = None,
    parked_inside: Inside = 0.0,
    kerb: Kerb = 1.5,
    threshold: Threshold = None,
    detector: DetectorName = None,
    model: Model = None,
    model_gsd: ModelGsd = None,
    tta: Tta = False,
    score: Labels = None,
    preview: Preview = None,
    force: Force = False,
    workers: Workers = 1,
    scheduler: Scheduler = None,
    resume: Resume = None,
    output: options.Output = None,
    into: options.Into = None,
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
) -> None:
    """Find cars in top-view images: layers "vehicles", "anchors" (the parked ones), "transit".

    \b
    Examples:
      covertool extract photo.tif --mask roads.tif -o town.gpkg
      covertool extract photo.png --gsd 0.125 --mask roads.png -o town.gpkg --preview seen.png
      covertool extract tiles/*.tif --osm town.osm.pbf -o town.gpkg --workers 4 --resume windows
      covertool extract tiles.vrt --mask roads.tif -o town.gpkg

    \b
    A car whose centre lies inside the transit area is driving, others are parked. Where the
    transit area holds the parking lanes too, add --parked-inside 1.3. Vans count as cars; trucks
    and buses are left out.
    """
    started = time.perf_counter()
    _require_sense(mask, osm, output, into, score, preview, as_json)
    files = image_files(images)
    require_one(files, score)
    require_free(output, overwrite, files)
    rasters = opened(files, gsd, crs, parsed_origin(origin))
    whole = None if preview is None else one_picture(rasters, preview, overwrite)
    area, parking = town(mask, osm, lots, rasters, gsd, crs, parsed_origin(origin))
    chosen = chosen_detector(detector, model, model_gsd, tta)
    from covertool.extract.sites import ParkedRule
    from covertool.extract.vehicles import extract_vehicles

    with progress("windows", 1) as advance:
        found = extract_vehicles(
            rasters,
            chosen,
            transit=area,
            lots=parking,
            rule=ParkedRule(parked_inside, kerb),
            threshold=threshold,
            force=force,
            workers=workers,
            scheduler=scheduler,
            ledger=job_ledger(resume, files, chosen, [threshold, gsd, crs, origin]),
            on_windows=lambda steps, total: advance(steps / total),
        )
    if area is None:
        say(
            "warning: neither --mask nor --osm was given: whether a car is parked is not known, "
            "and the layer anchors holds all of them"
        )
    scored = _scored(score, found, rasters)
    if preview is not None and whole is not None:
        _draw(preview, found, whole, area, overwrite)
    inputs = [path for path in (*files, mask, osm, score) if path is not None]
    whence = _write(found, area, output, into, overwrite, inputs)
    _report(found, area, scored, whence, time.perf_counter() - started, as_json)
    for path in (output, into):
        if path is not None:
            say(f"wrote {path}")


def _require_sense(
    mask: Path | None,
    osm: Path | None,
    output: Path | None,
    into: Path | None,
    score: Path | None,
    preview: Path | None,
    as_json: bool,
) -> None:
    if mask is not None and osm is not None:
        raise typer.BadParameter("give a mask or an OSM extract, not both", param_hint="--mask")
    if not (output or into or score or preview or as_json):
        raise typer.BadParameter("name a study to write", param_hint="-o")


def _scored(labels: Path | None, found: Extraction, rasters: list[RasterSource]) -> Score | None:
    from covertool.extract import score
    from covertool.gis.streams import open_stream

    if labels is None:
        return None
    image = rasters[0]
    with open_stream(labels) as stream:
        known = score.Labels.from_geojson(stream.read(), str(labels))
    ground = image.gsd_m(image.width / 2, image.height / 2)
    return score.score(found.vehicles, known, ground, (image.width, image.height))


def _draw(
    path: Path,
    found: Extraction,
    picture: RasterSource,
    area: TransitArea | None,
    overwrite: bool,
) -> None:
    from covertool.extract.preview import preview
    from covertool.gis.picture import write_picture

    write_picture(path, preview(picture, found.vehicles, area), overwrite=overwrite)
    say(f"wrote {path}")


def _write(
    found: Extraction,
    area: TransitArea | None,
    output: Path | None,
    into: Path | None,
    overwrite: bool,
    inputs: list[Path],
) -> dict[str, Any]:
    """Write the study's layers and return the provenance as JSON."""
    from covertool.gis.provenance import provenance
    from covertool.gis.write import write_layers

    whence = provenance(sys.argv[1:], inputs)
    layers = {"vehicles": found.vehicles.to_frame(), "anchors": found.anchors().to_frame()}
    if area is not None:
        layers["transit"] = area.to_frame()
    metadata = whence.to_metadata()
    if output is not None:
        write_layers(output, layers, overwrite=overwrite, metadata=metadata, inputs=inputs)
    if into is not None:
        write_layers(into, layers, into=True, metadata=metadata, inputs=inputs)
    return whence.to_json()


def _report(
    found: Extraction,
    area: TransitArea | None,
    scored: Score | None,
    whence: dict[str, Any],
    seconds: float,
    as_json: bool,
) -> None:
    parked = len(found.anchors()) if area is not None else None
    if as_json:
        content: dict[str, Any] = {
            "vehicles": len(found.vehicles),
            "trucks": found.trucks,
            "parked": parked,
            "transit_area_m2": None if area is None else area.area_m2,
            "gsd_m": found.gsd_m,
            "pixels": found.pixels,
        }
        if scored is not None:
            content["score"] = scored.to_json()
        print_json("extract", {**content, "seconds": seconds, "provenance": whence})
        return
    rows = [["vehicles", str(len(found.vehicles))]]
    if found.trucks:
        rows.append(["trucks and buses, left out", str(found.trucks)])
    if area is not None:
        rows += [["parked", str(parked)], ["transit area m2", f"{area.area_m2:.0f}"]]
    rows += [["GSD m", f"{found.gsd_m:.3f}"], ["megapixels", f"{found.pixels / 1e6:.1f}"]]
    if scored is not None:
        figures = scored.to_json().items()
        rows += [[k.replace("_", " "), "-" if v is None else f"{v:.3g}"] for k, v in figures]
    print_table(["found", ""], rows)

"""`covertool extract`: images in; vehicles, parked anchors and the transit area out."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from covertool.cli import options
from covertool.cli.app import app
from covertool.cli.console import print_json, print_table, progress, say
from covertool.cli.extract_files import (
    Placement,
    Scene,
    chosen_detector,
    job_ledger,
    open_scene,
    require_free_picture,
)
from covertool.cli.target import Target
from covertool.cli.transit import Gsd, Origin, parsed_origin
from covertool.cli.whence import whence

if TYPE_CHECKING:
    from covertool.extract.detectors.protocol import Detector
    from covertool.extract.score import Score
    from covertool.extract.vehicles import Extraction
    from covertool.gis.provenance import Provenance
    from covertool.model import RasterSource, TransitArea
    from covertool.spread import Ledger

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
    Path | None,
    typer.Option("--osm", metavar="FILE", help="OpenStreetMap extract: roads, parking."),
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
Tta = Annotated[
    bool | None,
    typer.Option(
        "--tta/--no-tta",
        help="Look four ways round, or one: four times faster, a little worse.  [default: --tta]",
        show_default=False,
    ),
]
Labels = Annotated[
    Path | None, typer.Option("--score", metavar="LABELS", help="Compare with labelled cars.")
]
Preview = Annotated[
    Path | None, typer.Option("--preview", metavar="OUT.png", help="Draw what was found.")
]
Force = Annotated[bool, typer.Option("--force", help="Go on with pixels above 0.35 m.")]


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
    tta: Tta = None,
    score: Labels = None,
    preview: Preview = None,
    force: Force = False,
    workers: options.Workers = 1,
    scheduler: options.Scheduler = None,
    resume: options.Resume = None,
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
    target = Target(output, into, overwrite)
    target.require(score, preview, as_json)
    target.require_free(images)
    if preview is not None:
        require_free_picture(preview, overwrite)
    place = Placement(gsd, crs, parsed_origin(origin))
    scene = open_scene(images, mask, osm, lots, place, labels=score)
    picture = None if preview is None else scene.picture()
    chosen = chosen_detector(detector, model, model_gsd, tta)
    found = _extract(
        scene, chosen, rule=(parked_inside, kerb), threshold=threshold, force=force,
        workers=workers, scheduler=scheduler,
        ledger=job_ledger(resume, scene.files, chosen, [threshold, gsd, crs, origin]),
    )  # fmt: skip
    scored = None if score is None else _scored(score, found, scene.rasters[0])
    if preview is not None and picture is not None:
        _draw(preview, picture, found, scene.transit, overwrite)
    made_from = whence(scene.inputs)
    _write(found, scene, target, made_from)
    seconds = time.perf_counter() - started
    if as_json:
        content = _content(found, scene, scored)
        print_json("extract", {**content, "seconds": seconds, "provenance": made_from.to_json()})
    else:
        print_table(["found", ""], _rows(found, scene, scored))


def _extract(
    scene: Scene,
    detector: Detector,
    *,
    rule: tuple[float, float],
    threshold: float | None,
    force: bool,
    workers: int,
    scheduler: str | None,
    ledger: Ledger | None,
) -> Extraction:
    """Find the cars, behind a bar; say so where parked and driving cannot be told apart."""
    from covertool.extract.sites import ParkedRule
    from covertool.extract.vehicles import extract_vehicles

    with progress("windows", 1) as advance:
        found = extract_vehicles(
            scene.rasters,
            detector,
            transit=scene.transit,
            lots=scene.lots,
            rule=ParkedRule(*rule),
            threshold=threshold,
            force=force,
            workers=workers,
            scheduler=scheduler,
            ledger=ledger,
            on_windows=lambda steps, total: advance(steps / total),
        )
    if scene.transit is None:
        say(
            "warning: neither --mask nor --osm was given: whether a car is parked is not known, "
            "and the layer anchors holds all of them"
        )
    return found


def _scored(labels: Path, found: Extraction, image: RasterSource) -> Score:
    """Return how the cars of an image compare with its labels."""
    from covertool.extract import score
    from covertool.gis.streams import open_stream

    with open_stream(labels) as stream:
        known = score.Labels.from_geojson(stream.read(), str(labels))
    ground = image.gsd_m(image.width / 2, image.height / 2)
    return score.score(found.vehicles, known, ground, (image.width, image.height))


def _draw(
    path: Path,
    picture: RasterSource,
    found: Extraction,
    transit: TransitArea | None,
    overwrite: bool,
) -> None:
    """Write the picture of what was found."""
    from covertool.extract.preview import preview
    from covertool.gis.picture import write_picture

    write_picture(path, preview(picture, found.vehicles, transit), overwrite=overwrite)
    say(f"wrote {path}")


def _write(found: Extraction, scene: Scene, target: Target, made_from: Provenance) -> None:
    """Write the study's layers."""
    layers = {"vehicles": found.vehicles.to_frame(), "anchors": found.anchors().to_frame()}
    if scene.transit is not None:
        layers["transit"] = scene.transit.to_frame()
    target.write(layers, made_from.to_metadata(), inputs=scene.inputs)


def _content(found: Extraction, scene: Scene, scored: Score | None) -> dict[str, Any]:
    """Return the content of ``extract --json`` but for seconds and provenance."""
    content: dict[str, Any] = {
        "vehicles": len(found.vehicles),
        "trucks": found.trucks,
        "parked": None if scene.transit is None else len(found.anchors()),
        "transit_area_m2": None if scene.transit is None else scene.transit.area_m2,
        "gsd_m": found.gsd_m,
        "pixels": found.pixels,
    }
    if scored is not None:
        content["score"] = scored.to_json()
    return content


def _rows(found: Extraction, scene: Scene, scored: Score | None) -> list[list[str]]:
    """Return the printed table."""
    rows = [["vehicles", str(len(found.vehicles))]]
    if found.trucks:
        rows.append(["trucks and buses, left out", str(found.trucks)])
    if scene.transit is not None:
        rows.append(["parked", str(len(found.anchors()))])
        rows.append(["transit area m2", f"{scene.transit.area_m2:.0f}"])
    rows += [["GSD m", f"{found.gsd_m:.3f}"], ["megapixels", f"{found.pixels / 1e6:.1f}"]]
    if scored is not None:
        figures = scored.to_json().items()
        rows += [[k.replace("_", " "), "-" if v is None else f"{v:.3g}"] for k, v in figures]
    return rows

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
from covertool.cli.transit import Gsd, Origin, mask_transit, osm_transit, parsed_origin

if TYPE_CHECKING:
    import shapely

    from covertool.extract.detectors.protocol import Detector
    from covertool.extract.score import Score
    from covertool.extract.vehicles import Extraction
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
    transit area holds the parking lanes too, add --parked-inside 1.3.
    """
    started = time.perf_counter()
    _require_sense(mask, osm, output, into, score, preview, as_json)
    files = _files(images)
    _require_one(files, score)
    _require_free(output, overwrite, files)
    rasters = _opened(files, gsd, crs, parsed_origin(origin))
    whole = None if preview is None else _one_picture(rasters, preview, overwrite)
    area, parking = _town(mask, osm, lots, rasters, gsd, crs, parsed_origin(origin))
    chosen = _detector(detector, model, model_gsd, tta)
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
            ledger=_ledger(resume, files, chosen, [threshold, gsd, crs, origin]),
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


def _files(images: list[Path]) -> list[Path]:
    """Return the rasters that are named, by hand or in a VRT or a list, each once."""
    from covertool.gis.raster_lists import raster_files

    return list(dict.fromkeys(file for path in images for file in raster_files(path)))


def _require_one(files: list[Path], score: Path | None) -> None:
    if score is not None and len(files) > 1:
        raise typer.BadParameter("labels belong to one image", param_hint="--score")


def _require_free(output: Path | None, overwrite: bool, images: list[Path]) -> None:
    """Refuse an output that cannot be written before hours of work rather than after."""
    from covertool.gis.formats import VECTOR_FORMATS
    from covertool.gis.guard import output_file

    if output is not None:
        output_file(output, VECTOR_FORMATS, overwrite=overwrite, inputs=images)


def _opened(
    images: list[Path], gsd: float | None, crs: str | None, origin: tuple[float, float] | None
) -> list[RasterSource]:
    from covertool.gis.geotiff import open_raster

    return [open_raster(path, gsd_m=gsd, crs=crs, origin=origin) for path in images]


def _town(
    mask: Path | None,
    osm: Path | None,
    lots: str | None,
    rasters: list[RasterSource],
    gsd: float | None,
    crs: str | None,
    origin: tuple[float, float] | None,
) -> tuple[TransitArea | None, shapely.MultiPolygon | None]:
    """Return the transit area and the parking areas in the CRS of the first image."""
    from covertool.extract.transit import dissolved, seen_part
    from covertool.gis.osm import read_parking_areas
    from covertool.gis.read import read_polygons

    area = None
    first = rasters[0] if len(rasters) == 1 else None
    if mask is not None:
        area = mask_transit(mask, first, gsd=gsd, crs=crs, origin=origin)
    elif osm is not None:
        area = osm_transit(osm)
    if area is not None:
        area = seen_part(area, rasters)
    frames = [] if osm is None else [read_parking_areas(osm)]
    if lots is not None:
        frames.append(read_polygons(lots, crs=crs))
    frames = [frame for frame in frames if not frame.empty]
    return area, (dissolved(frames, rasters[0].crs) if frames else None)


def _detector(name: str | None, model: Path | None, gsd: float | None, tta: bool) -> Detector:
    from covertool.extract.detectors import default_detector, named_detector

    if model is None:
        return named_detector(name, tta=tta) if name else default_detector(tta=tta)
    from covertool.extract.detectors.yolo_obb import YoloObbDetector
    from covertool.gis.streams import open_stream

    if gsd is None:
        raise typer.BadParameter(
            "name the ground size of the pixels that the model was trained for, such as 0.10",
            param_hint="--model-gsd",
        )
    with open_stream(model) as stream:
        return YoloObbDetector(model=stream.read(), name=model.name, gsd_m=gsd)


def _ledger(
    folder: Path | None,
    images: list[Path],
    detector: Detector,
    options: list[float | str | None],
) -> Ledger | None:
    """Return the ledger of this job: known by the bytes of its images and of its model.

    The options are those that decide where the windows lie and what counts; the version stands for
    the program.
    """
    import hashlib
    import pickle

    from covertool import __version__
    from covertool.extract.windows import CORE_PX
    from covertool.gis.provenance import sha256
    from covertool.spread import Ledger

    if folder is None:
        return None
    hashes = " ".join(sha256(path) for path in images)
    seen_by = hashlib.sha256(pickle.dumps(detector)).hexdigest()
    return Ledger(folder, f"extract {__version__} {hashes} {seen_by} {CORE_PX} {options}")


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


def _one_picture(rasters: list[RasterSource], path: Path, overwrite: bool) -> RasterSource:
    """Return the images as the one that a preview shows, or refuse before the work."""
    from covertool.extract.mosaic import mosaics
    from covertool.gis.guard import output_file
    from covertool.gis.picture import PICTURE_FORMATS

    output_file(path, PICTURE_FORMATS, overwrite=overwrite)
    joined = mosaics(rasters)
    if len(joined) > 1:
        raise typer.BadParameter(
            f"a preview shows one picture, and the images lie on {len(joined)} pixel grids",
            param_hint="--preview",
        )
    return joined[0]


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
    if area is not None:
        rows += [["parked", str(parked)], ["transit area m2", f"{area.area_m2:.0f}"]]
    rows += [["GSD m", f"{found.gsd_m:.3f}"], ["megapixels", f"{found.pixels / 1e6:.1f}"]]
    if scored is not None:
        figures = scored.to_json().items()
        rows += [[k.replace("_", " "), "-" if v is None else f"{v:.3g}"] for k, v in figures]
    print_table(["found", ""], rows)

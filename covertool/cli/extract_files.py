"""What `covertool extract` opens: images, their carriageway, a detector, and a job to take up."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from covertool.cli.transit import mask_transit, osm_transit

if TYPE_CHECKING:
    import shapely

    from covertool.extract.detectors.protocol import Detector
    from covertool.model import RasterSource, TransitArea
    from covertool.spread import Ledger


def image_files(images: list[Path]) -> list[Path]:
    """Return the rasters that are named, by hand or in a VRT or a list, each once."""
    from covertool.gis.raster_lists import raster_files

    return list(dict.fromkeys(file for path in images for file in raster_files(path)))


def require_one(files: list[Path], score: Path | None) -> None:
    """Refuse labels beside several images."""
    if score is not None and len(files) > 1:
        raise typer.BadParameter("labels belong to one image", param_hint="--score")


def require_free(output: Path | None, overwrite: bool, images: list[Path]) -> None:
    """Refuse an output that cannot be written before hours of work rather than after."""
    from covertool.gis.formats import VECTOR_OUTPUTS
    from covertool.gis.guard import output_file

    if output is not None:
        output_file(output, VECTOR_OUTPUTS, overwrite=overwrite, inputs=images)


def opened(
    images: list[Path], gsd: float | None, crs: str | None, origin: tuple[float, float] | None
) -> list[RasterSource]:
    """Return the images, opened."""
    from covertool.gis.geotiff import open_raster

    return [open_raster(path, gsd_m=gsd, crs=crs, origin=origin) for path in images]


def one_picture(rasters: list[RasterSource], path: Path, overwrite: bool) -> RasterSource:
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


def town(
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


def chosen_detector(name: str | None, model: Path | None, gsd: float | None, tta: bool) -> Detector:
    """Return a detector that ships, or the user's own model."""
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


def job_ledger(
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

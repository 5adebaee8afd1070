"""What `covertool extract` opens: images, their carriageway, a detector, and a job to take up."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import typer

from covertool.cli.transit import mask_transit, osm_transit

if TYPE_CHECKING:
    import shapely
    from pyproj import CRS

    from covertool.extract.detectors.protocol import Detector
    from covertool.model import RasterSource, TransitArea
    from covertool.spread import Ledger


class Placement(NamedTuple):
    """Where an image without georeference lies: ground size of a pixel, CRS, lower left corner."""

    gsd_m: float | None
    crs: str | None
    origin: tuple[float, float] | None


@dataclass(frozen=True)
class Scene:
    """What cars are looked for in: images, and where cars drive and park there.

    Attributes
    ----------
    files : the rasters, each once
    rasters : the same, opened
    transit, lots : transit area and parking areas in the CRS of the first image; None if unknown
    inputs : all files that were read
    """

    files: list[Path]
    rasters: list[RasterSource]
    transit: TransitArea | None
    lots: shapely.MultiPolygon | None
    inputs: list[Path]

    def picture(self) -> RasterSource:
        """Return the images as the one that a preview shows."""
        from covertool.extract.mosaic import mosaics

        joined = mosaics(self.rasters)
        if len(joined) > 1:
            raise typer.BadParameter(
                f"a preview shows one picture, and the images lie on {len(joined)} pixel grids",
                param_hint="--preview",
            )
        return joined[0]


def require_free_picture(path: Path, overwrite: bool) -> None:
    """Refuse a picture that cannot be written before hours of work rather than after."""
    from covertool.gis.guard import output_file
    from covertool.gis.picture import PICTURE_FORMATS

    output_file(path, PICTURE_FORMATS, overwrite=overwrite)


def open_scene(
    images: list[Path],
    mask: Path | None,
    osm: Path | None,
    lots: str | None,
    place: Placement,
    *,
    labels: Path | None = None,
) -> Scene:
    """Return the images that are named, by hand or in a VRT or a list, and their surroundings."""
    from covertool.gis.geotiff import open_raster
    from covertool.gis.raster_lists import raster_files

    if mask is not None and osm is not None:
        raise typer.BadParameter("give a mask or an OSM extract, not both", param_hint="--mask")
    files = list(dict.fromkeys(file for path in images for file in raster_files(path)))
    if labels is not None and len(files) > 1:
        raise typer.BadParameter("labels belong to one image", param_hint="--score")
    rasters: list[RasterSource] = [
        open_raster(path, gsd_m=place.gsd_m, crs=place.crs, origin=place.origin) for path in files
    ]
    inputs = [path for path in (*files, mask, osm, labels) if path is not None]
    transit = _transit(mask, osm, rasters, place)
    return Scene(files, rasters, transit, _parking(osm, lots, place.crs, rasters[0].crs), inputs)


def _transit(
    mask: Path | None, osm: Path | None, rasters: list[RasterSource], place: Placement
) -> TransitArea | None:
    """Return the part of the transit area that the images show."""
    from covertool.extract.transit import seen_part

    if mask is not None:
        image = rasters[0] if len(rasters) == 1 else None
        gsd_m, crs, origin = place
        return seen_part(mask_transit(mask, image, gsd=gsd_m, crs=crs, origin=origin), rasters)
    if osm is not None:
        return seen_part(osm_transit(osm), rasters)
    return None


def _parking(
    osm: Path | None, lots: str | None, crs: str | None, dst_crs: CRS
) -> shapely.MultiPolygon | None:
    """Return the parking areas of an extract and of a layer as one."""
    from covertool.extract.transit import dissolved
    from covertool.gis.osm import read_parking_areas
    from covertool.gis.read import read_polygons

    frames = [] if osm is None else [read_parking_areas(osm)]
    if lots is not None:
        frames.append(read_polygons(lots, crs=crs))
    found = [frame for frame in frames if not frame.empty]
    return dissolved(found, dst_crs) if found else None


def chosen_detector(
    name: str | None, model: Path | None, gsd: float | None, tta: bool | None
) -> Detector:
    """Return a detector that ships, or the user's own model."""
    from covertool.extract.detectors import default_detector, named_detector

    if model is None:
        return named_detector(name, tta=tta) if name else default_detector(tta=tta)
    from covertool.errors import OptionError
    from covertool.extract.detectors.yolo_obb import YoloObbDetector
    from covertool.gis.streams import open_stream

    if gsd is None:
        raise typer.BadParameter(
            "name the ground size of the pixels that the model was trained for, such as 0.10",
            param_hint="--model-gsd",
        )
    if tta:
        raise OptionError("your own model is run one way round", "--tta", "leave it out")
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

"""From images to vehicles: detect window by window, place on the map, judge parked or driving."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from pyproj import CRS

from covertool import crs as crs_door
from covertool.errors import OptionError
from covertool.extract.detectors.nms import oriented_nms
from covertool.extract.detectors.protocol import CAR, Detections, Detector
from covertool.extract.mosaic import Mosaic, mosaics
from covertool.extract.sites import ParkedRule, judge
from covertool.extract.stretch import Stretch
from covertool.extract.windows import CORE_PX, Window, WorkingGrid, detect_in_window
from covertool.model import Anchors, Floats, Objects, RasterSource, TransitArea, Vehicles
from covertool.model.sources import COARSEST_GSD_M
from covertool.spread import Ledger, spread

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class Extraction:
    """What was found in images.

    Attributes
    ----------
    vehicles : the cars and vans, sorted by image, row and column
    trucks : the number of trucks and buses, which are no cars and left out
    gsd_m : ground size of the first image's pixels
    pixels : pixels of all images together
    """

    vehicles: Vehicles
    trucks: int
    gsd_m: float
    pixels: int

    def anchors(self) -> Anchors:
        """Return the parked vehicles as anchors; all of them where nothing was judged."""
        parked = np.array([flag is not False for flag in self.vehicles.parked], dtype=bool)
        chosen = self.vehicles.take(parked)
        points = Anchors.from_points(chosen.x_m, chosen.y_m, chosen.crs)
        return replace(points, id=chosen.id)


@dataclass(frozen=True)
class _Job:
    """The work on one window, given by the numbers of its image and of the window in it."""

    images: tuple[Mosaic, ...]
    grids: tuple[WorkingGrid, ...]
    stretches: tuple[Stretch, ...]
    detector: Detector
    threshold: float
    core_px: int

    def windows(self, image: int) -> list[Window]:
        return self.grids[image].windows(self.detector.halo_px, self.core_px)

    def __call__(self, piece: tuple[int, int]) -> Detections:
        image, number = piece
        return detect_in_window(
            self.images[image],
            self.detector,
            self.grids[image],
            self.stretches[image],
            self.windows(image)[number],
            self.threshold,
        )


def extract_vehicles(
    rasters: RasterSource | Sequence[RasterSource],
    detector: Detector,
    *,
    transit: TransitArea | None = None,
    lots: shapely.MultiPolygon | None = None,
    rule: ParkedRule | None = None,
    threshold: float | None = None,
    force: bool = False,
    core_px: int = CORE_PX,
    workers: int = 1,
    scheduler: str | None = None,
    ledger: Ledger | None = None,
    on_windows: Callable[[int, int], object] | None = None,
) -> Extraction:
    """Return the cars of one or many images; trucks and buses are counted and left out.

    Parameters
    ----------
    rasters : RasterSource or sequence of them
        Images on one pixel grid are treated as one, so that no car is cut by a seam.
    detector : Detector
        Sees the images at its own GSD.
    transit : TransitArea, optional
        Where cars drive; without it `site` and `parked` stay None.
    lots : MultiPolygon, optional
        Parking areas in the CRS of the transit area.
    rule : ParkedRule, optional
        Where driving begins; the default when None.
    threshold : float, optional
        Least score; the detector's own when None.
    force : bool
        Go on with pixels larger than ``COARSEST_GSD_M``.
    core_px : int
        Side of a window's core in pixels of the detector's GSD.
    workers, scheduler, ledger
        As in `covertool.spread.spread`; the result is the same for any of them.
    on_windows : callable, optional
        Called with (windows done since the last call, windows in all).

    Raises
    ------
    OptionError
        When the pixels are too coarse, the threshold is out of range, or several images have no
        place on Earth.

    Examples
    --------
    >>> import tempfile
    >>> from covertool.extract.detectors import named_detector
    >>> from covertool.gis.geotiff import open_raster
    >>> from covertool.gis.picture import write_picture
    >>> road = np.full((160, 160, 3), 90, dtype=np.uint8)
    >>> road[69:91, 76:85] = 230
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_picture(f"{folder}/road.png", road)
    ...     image = open_raster(f"{folder}/road.png", gsd_m=0.20)
    ...     found = extract_vehicles(image, named_detector("classical"))
    >>> len(found.vehicles), found.pixels
    (1, 25600)
    """
    sources = list(rasters) if isinstance(rasters, Sequence) else [rasters]
    images = mosaics(sources)
    job = _job(images, detector, threshold, force, core_px)
    pieces = [(i, j) for i in range(len(images)) for j in range(len(job.windows(i)))]
    done = None if on_windows is None else lambda steps: on_windows(steps, len(pieces))
    results = spread(job, pieces, workers=workers, scheduler=scheduler, ledger=ledger, on_done=done)
    crs = images[0].crs if transit is None else transit.crs
    found = [
        Detections.concatenate(
            [some for (k, _), some in zip(pieces, results, strict=True) if k == i]
        )
        for i in range(len(images))
    ]
    cars = [some.take(some.kind == CAR) for some in found]
    others = [some.take(some.kind != CAR) for some in found]
    vehicles = _on_one_map(cars, images, job.grids, crs)
    trucks = len(_on_one_map(others, images, job.grids, crs))
    if transit is not None:
        outline = _outline(images[0], crs) if len(images) == 1 else None
        vehicles = _judged(vehicles, transit, lots, rule or ParkedRule(), outline)
    ground = images[0].gsd_m(images[0].width / 2, images[0].height / 2)
    pixels = sum(source.width * source.height for source in sources)
    return Extraction(vehicles, trucks, math.sqrt(ground[0] * ground[1]), pixels)


def _job(
    images: list[Mosaic],
    detector: Detector,
    threshold: float | None,
    force: bool,
    core_px: int,
) -> _Job:
    """Return the work on all windows, once the options have been checked."""
    least = detector.threshold if threshold is None else threshold
    if not 0 <= least <= 1:
        raise OptionError(f"a threshold of {least} is no score", "--threshold", "use 0 to 1")
    for image in images:
        _refuse_coarse(image, force)
    return _Job(
        images=tuple(images),
        grids=tuple(WorkingGrid.of(image, detector.gsd_m) for image in images),
        stretches=tuple(Stretch.of(image) for image in images),
        detector=detector,
        threshold=least,
        core_px=core_px,
    )


def _refuse_coarse(image: Mosaic, force: bool) -> None:
    coarse = max(image.gsd_m(image.width / 2, image.height / 2))
    if coarse <= COARSEST_GSD_M:
        return
    if not force:
        raise OptionError(
            f"pixels of {coarse:.3g} m are too coarse to tell cars from their shadows "
            f"(at most {COARSEST_GSD_M} m)",
            image.name,
            "use finer imagery, or --force to go on all the same",
        )
    _LOG.warning("%s: pixels of %.3g m are coarse; cars are missed", image.name, coarse)


def _placed(found: Detections, image: Mosaic, grid: WorkingGrid, crs: CRS) -> Vehicles:
    """Return detections on the working grid as vehicles on the map."""
    x_px, y_px = grid.to_image(found.x_px, found.y_px)
    x_m, y_m = _on_map(image, x_px, y_px, crs)
    turn = np.radians(found.heading_deg)
    tip = grid.to_image(found.x_px + np.sin(turn), found.y_px - np.cos(turn))
    tip_x_m, tip_y_m = _on_map(image, *tip, crs)
    name, own_x_px, own_y_px = image.locate(x_px, y_px)
    nothing = np.full(len(found), None, dtype=object)
    return Vehicles(
        id=nothing,
        x_m=x_m,
        y_m=y_m,
        heading_deg=np.mod(np.degrees(np.arctan2(tip_x_m - x_m, tip_y_m - y_m)), 180.0),
        length_m=found.length_px * grid.gsd_m,
        width_m=found.width_px * grid.gsd_m,
        score=found.score,
        site=nothing,
        parked=nothing,
        image=name,
        image_x_px=own_x_px,
        image_y_px=own_y_px,
        crs=crs,
    )


def _on_map(image: Mosaic, x_px: Floats, y_px: Floats, crs: CRS) -> tuple[Floats, Floats]:
    return crs_door.transform(*image.to_metres(x_px, y_px), image.crs, crs)


def _on_one_map(
    found: list[Detections], images: list[Mosaic], grids: tuple[WorkingGrid, ...], crs: CRS
) -> Vehicles:
    """Return the detections of all images, each vehicle once."""
    parts = [_placed(*one, crs) for one in zip(found, images, grids, strict=True)]
    return _without_doubles(Vehicles(**Vehicles.joined(parts), crs=crs))


def _without_doubles(cars: Vehicles) -> Vehicles:
    """Return each car once, in the order of image, row and column, numbered from 1."""
    keep = oriented_nms(
        cars.x_m, -cars.y_m, cars.heading_deg, cars.length_m, cars.width_m, cars.score
    )
    kept = cars.take(keep)
    kept = kept.take(np.lexsort((kept.image_x_px, kept.image_y_px, kept.image.astype(str))))
    ids: Objects = np.array([str(i + 1) for i in range(len(kept))], dtype=object)
    return replace(kept, id=ids)


def _judged(
    cars: Vehicles,
    transit: TransitArea,
    lots: shapely.MultiPolygon | None,
    rule: ParkedRule,
    outline: shapely.Polygon | None,
) -> Vehicles:
    """Return the vehicles with their sites, parked or driving."""
    site, parked = judge(
        cars.x_m,
        cars.y_m,
        cars.footprints(),
        transit.polygons,
        rule=rule,
        lots=lots,
        outline=outline,
    )
    return replace(cars, site=site, parked=parked)


def _outline(image: Mosaic, crs: CRS) -> shapely.Polygon:
    x_px = np.array([0.0, image.width, image.width, 0.0])
    y_px = np.array([0.0, 0.0, image.height, image.height])
    return shapely.Polygon(np.column_stack(_on_map(image, x_px, y_px, crs)))

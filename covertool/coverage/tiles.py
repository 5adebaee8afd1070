"""A country in pieces: tiles with a halo of the largest radius, whose level areas add up.

A tile reads the transit area inside its square and the anchors that reach into it, and nothing
else; so memory is bounded by the tile, and a worker needs only its number. An anchor is counted in
the one tile that holds it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import numpy.typing as npt
import shapely
from pyproj import CRS

from covertool.coverage.areas import level_areas
from covertool.coverage.clip import clipped
from covertool.coverage.radii import Radius, radii_of
from covertool.errors import CrsError
from covertool.model import (
    Anchors,
    AnchorSource,
    Bounds,
    CoverageReport,
    RadiusCoverage,
    TransitArea,
)
from covertool.spread import Ledger, spread

ANCHORS_IN_TILE = 100_000
"""Anchors that a tile holds about, when its size is left open."""

Key = tuple[Radius, str | None]


class TransitSource(Protocol):
    """A transit area that can be read by bounding box; picklable."""

    @property
    def crs(self) -> CRS:
        """CRS of the coordinates."""
        ...

    @property
    def bounds(self) -> Bounds:
        """Least and greatest coordinates: x0, y0, x1, y1."""
        ...

    def read(self, bounds: Bounds | None = None) -> TransitArea:
        """Return the parts that meet bounds (x0, y0, x1, y1), or all; they may reach beyond."""
        ...


@dataclass(frozen=True)
class TilePlan:
    """Square tiles over bounds, numbered along rows from the lower left."""

    bounds: Bounds
    tile_m: float
    columns: int
    rows: int

    def __len__(self) -> int:
        return self.columns * self.rows

    def square(self, tile: int) -> Bounds:
        """Return the bounds of a tile.

        >>> plan_tiles((0.0, 0.0, 25.0, 10.0), 10.0).square(2)
        (20.0, 0.0, 30.0, 10.0)
        """
        row, column = divmod(tile, self.columns)
        x, y = self.bounds[0], self.bounds[1]
        size = self.tile_m
        return (x + column * size, y + row * size, x + (column + 1) * size, y + (row + 1) * size)


def plan_tiles(bounds: Bounds, tile_m: float) -> TilePlan:
    """Return the plan of square tiles that cover bounds."""
    x0, y0, x1, y1 = bounds
    columns = max(math.floor((x1 - x0) / tile_m) + 1, 1)
    rows = max(math.floor((y1 - y0) / tile_m) + 1, 1)
    return TilePlan(bounds, tile_m, columns, rows)


def tile_size_m(bounds: Bounds, anchors: int, largest_radius_m: float) -> float:
    """Return the side of tiles that hold about ``ANCHORS_IN_TILE`` anchors each.

    It is never less than twice the largest radius: beneath that, the halo is most of the work.

    Examples
    --------
    >>> tile_size_m((0.0, 0.0, 1000.0, 1000.0), 400_000, 15.0)
    500.0
    """
    width, height = max(bounds[2] - bounds[0], 1.0), max(bounds[3] - bounds[1], 1.0)
    share = min(ANCHORS_IN_TILE / max(anchors, 1), 1.0)
    side = math.sqrt(width * height * share) if share < 1 else max(width, height) * 1.001
    return max(side, 2 * largest_radius_m)


@dataclass(frozen=True)
class TileLevels:
    """What one tile adds to a report.

    Attributes
    ----------
    transit_area_m2 : transit area inside the tile
    anchors : anchors inside the tile by origin
    levels : level areas for each radius and origin (None: all of them)
    """

    transit_area_m2: float
    anchors: dict[str, int]
    levels: dict[Key, RadiusCoverage]


@dataclass(frozen=True)
class TileJob:
    """Computes a tile from its number: sources, plan and radii, and no data."""

    anchors: AnchorSource
    transit: TransitSource
    plan: TilePlan
    radii: tuple[Radius, ...]
    halo_m: float

    def __call__(self, tile: int) -> TileLevels:
        """Return the level areas inside a tile."""
        square = self.plan.square(tile)
        area = clipped(self.transit.read(square).polygons, shapely.box(*square))
        near = self.anchors.read(_grown(square, self.halo_m))
        found: dict[Key, RadiusCoverage] = {}
        origins = sorted({str(origin) for origin in near.origin})
        for radius in self.radii if not area.is_empty else ():
            together = _levels(near, area, radius, None)
            found[radius, None] = together
            for origin in origins:
                found[radius, origin] = (
                    replace(together, origin=origin)
                    if len(origins) == 1
                    else _levels(near.take(near.origin == origin), area, radius, origin)
                )
        own = near.origin[_inside(near, square)]
        counts = {origin: int(np.sum(own == origin)) for origin in origins}
        return TileLevels(area.area, counts, found)


def _levels(
    anchors: Anchors, area: shapely.MultiPolygon, radius: Radius, origin: str | None
) -> RadiusCoverage:
    named = radii_of(anchors, radius)
    found = level_areas(anchors.x_m, anchors.y_m, named.each_m, area)
    return RadiusCoverage(
        radius_m=named.radius_m,
        device_class=named.device_class,
        origin=origin,
        anchors=len(anchors),
        areas_m2=found.areas_m2,
        closure_m=found.closure_m,
    )


def plan_job(
    anchors: AnchorSource,
    transit: TransitSource,
    radii: Sequence[Radius],
    *,
    anchors_count: int,
    largest_own_m: float = 0.0,
    tile_m: float | None = None,
) -> TileJob:
    """Return the job whose tiles cover both the transit area and the anchors.

    Parameters
    ----------
    anchors, transit : sources in the same projected CRS
    radii : metres, device classes, or None for each anchor's own
    anchors_count : how many anchors there are; decides the size of the tiles
    largest_own_m : largest radius of the anchors' own, needed when ``radii`` holds None
    tile_m : side of a tile in metres; chosen when None

    Raises
    ------
    CrsError, OptionError
        When the sources differ in CRS, or a radius is not possible.
    """
    none = Anchors.from_points([], [], transit.crs)
    if anchors.crs != transit.crs:
        raise CrsError(
            "the anchors and the transit area are in different coordinate reference systems",
            f"{anchors.crs.name} and {transit.crs.name}",
            "convert both with covertool convert --dst-crs EPSG:CODE",
        )
    named = [radii_of(none, radius).radius_m for radius in radii if radius is not None]
    halo_m = max([*(size for size in named if size is not None), largest_own_m * (None in radii)])
    boxes = np.array([transit.bounds, anchors.bounds])
    x0, y0 = (float(value) for value in np.nanmin(boxes[:, :2], axis=0))
    x1, y1 = (float(value) for value in np.nanmax(boxes[:, 2:], axis=0))
    bounds = (x0, y0, x1, y1)
    size = tile_m if tile_m is not None else tile_size_m(bounds, anchors_count, halo_m)
    return TileJob(anchors, transit, plan_tiles(bounds, size), tuple(radii), halo_m)


def tiled_levels(
    job: TileJob,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    ledger: Ledger | None = None,
    on_done: Callable[[int], object] | None = None,
) -> CoverageReport:
    """Return the report that `coverage_levels` gives, computed tile by tile.

    Sums run over the tiles in their order, so the result does not depend on who computed them.
    """
    tiles = spread(
        job,
        range(len(job.plan)),
        workers=workers,
        scheduler=scheduler,
        ledger=ledger,
        on_done=on_done,
    )
    counts: dict[str, int] = {}
    for tile in tiles:
        for origin, count in tile.anchors.items():
            counts[origin] = counts.get(origin, 0) + count
    present = sorted(origin for origin, count in counts.items() if count)
    groups = [None, *(present if len(present) > 1 else [])]
    total = sum(counts.values())
    results = tuple(
        _joined(tiles, radius, origin, total if origin is None else counts[origin])
        for radius in job.radii
        for origin in groups
    )
    return CoverageReport(math.fsum(tile.transit_area_m2 for tile in tiles), total, results)


def _joined(
    tiles: Sequence[TileLevels], radius: Radius, origin: str | None, anchors: int
) -> RadiusCoverage:
    """Return the sum of the tiles; one without such anchors adds only to Level 0."""
    found = [tile.levels.get((radius, origin)) for tile in tiles]
    parts = [
        part.areas_m2 if part is not None else (tile.transit_area_m2, 0.0, 0.0, 0.0)
        for tile, part in zip(tiles, found, strict=True)
    ]
    none, one, two, three = (math.fsum(part[level] for part in parts) for level in range(4))
    names = {
        (part.radius_m, part.device_class)
        for part in found
        if part is not None and (part.anchors or radius is not None)
    }
    radius_m, device_class = names.pop() if len(names) == 1 else (None, None)
    return RadiusCoverage(
        radius_m=radius_m,
        device_class=device_class,
        origin=origin,
        anchors=anchors,
        areas_m2=(none, one, two, three),
        closure_m=max((part.closure_m for part in found if part is not None), default=0.0),
    )


def _inside(anchors: Anchors, square: Bounds) -> npt.NDArray[np.bool_]:
    x0, y0, x1, y1 = square
    x, y = anchors.x_m, anchors.y_m
    return (x >= x0) & (x < x1) & (y >= y0) & (y < y1)


def _grown(bounds: Bounds, halo_m: float) -> Bounds:
    x0, y0, x1, y1 = bounds
    return (x0 - halo_m, y0 - halo_m, x1 + halo_m, y1 + halo_m)

"""A country in pieces: tiles with a halo of the largest radius, whose findings add up.

A tile reads the transit area inside its square and the anchors that reach into it, and nothing
else; so memory is bounded by the tile, and a worker needs only its number. An anchor is counted in
the one tile that holds it. `covertool.coverage.tiled` adds the tiles up.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
import numpy.typing as npt
import shapely
from pyproj import CRS

from covertool.coverage.areas import level_areas
from covertool.coverage.clip import clipped
from covertool.coverage.levels import radius_coverage
from covertool.coverage.radii import Radius, radii_of
from covertool.coverage.regions import level_regions
from covertool.coverage.scanlines import DepthProfile, depth_profile
from covertool.coverage.tile_plan import TilePlan, plan_tiles, tile_size_m
from covertool.coverage.zones import reaching
from covertool.errors import CrsError
from covertool.model import (
    Anchors,
    AnchorSource,
    Bounds,
    Floats,
    Objects,
    RadiusCoverage,
    TransitArea,
)

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


class ZoneSource(Protocol):
    """Polygons by name, such as districts or one area of interest; picklable."""

    def read(self) -> Mapping[str, Objects]:
        """Return the polygons of each zone by its name."""
        ...


@dataclass(frozen=True)
class Wish:
    """What a tile finds besides the levels of every radius.

    Attributes
    ----------
    area_of_interest : the transit area is cut to its zones
    zones : levels are found in each of them too
    curve_m : radii of the nodes of a curve in metres
    depths : whether to measure the area at every depth, for `penetration`
    row_m : height of the rows of lines on which depths are measured, in metres
    regions : whether to draw the levels
    """

    area_of_interest: ZoneSource | None = None
    zones: ZoneSource | None = None
    curve_m: tuple[float, ...] = ()
    depths: bool = False
    row_m: float = 0.5
    regions: bool = False


@dataclass(frozen=True)
class ZonePart:
    """What one tile holds of a zone at one radius; no levels where it has no transit area."""

    transit_area_m2: float
    anchors: int
    levels: RadiusCoverage | None


@dataclass(frozen=True)
class TileFindings:
    """What one tile adds to the findings.

    Attributes
    ----------
    transit_area_m2 : transit area inside the tile
    anchors : anchors inside the tile by origin
    levels : level areas for each radius and origin (None: all of them)
    zones : the parts of zones inside the tile
    curve : (K, 8) for each node the areas of four levels, the lengths of three levels' arcs, and
        the closure
    depths : area by depth for each radius
    regions : polygons of Levels 1 to 3 for each radius
    """

    transit_area_m2: float
    anchors: dict[str, int]
    levels: dict[Key, RadiusCoverage] = field(default_factory=dict)
    zones: dict[tuple[str, Radius], ZonePart] = field(default_factory=dict)
    curve: Floats | None = None
    depths: dict[Radius, DepthProfile] = field(default_factory=dict)
    regions: dict[tuple[Radius, int], shapely.MultiPolygon] = field(default_factory=dict)


@dataclass(frozen=True)
class TileJob:
    """Computes a tile from its number: sources, plan and radii, and no data."""

    anchors: AnchorSource
    transit: TransitSource
    plan: TilePlan
    radii: tuple[Radius, ...]
    halo_m: float
    wish: Wish = Wish()

    def __call__(self, tile: int) -> TileFindings:
        """Return what a tile adds to the findings."""
        square = self.plan.square(tile)
        area = clipped(self._transit(square), shapely.box(*square))
        near = self.anchors.read(_grown(square, self.halo_m))
        own = near.take(_inside(near, square))
        origins = sorted({str(origin) for origin in set(near.origin.tolist())})
        found = TileFindings(
            area.area,
            {origin: int(np.sum(own.origin == origin)) for origin in origins},
            zones=self._zones(area, near, own),
        )
        if area.is_empty:
            return found
        return replace(
            found,
            levels=self._levels(area, near, origins),
            curve=_curve(near, area, self.wish.curve_m) if self.wish.curve_m else None,
            depths=self._depths(area, near) if self.wish.depths else {},
            regions=self._regions(area, near) if self.wish.regions else {},
        )

    def _transit(self, square: Bounds) -> shapely.MultiPolygon:
        polygons = self.transit.read(square).polygons
        if self.wish.area_of_interest is None:
            return polygons
        wanted = np.concatenate(list(self.wish.area_of_interest.read().values()))
        return clipped(polygons, shapely.union_all(wanted))

    def _levels(
        self, area: shapely.MultiPolygon, near: Anchors, origins: Sequence[str]
    ) -> dict[Key, RadiusCoverage]:
        """Return the levels of every radius, by all anchors and by those of each origin."""
        found: dict[Key, RadiusCoverage] = {}
        for radius in self.radii:
            together = radius_coverage(near, radii_of(near, radius), area)
            found[radius, None] = together
            for origin in origins:
                if len(origins) == 1:
                    found[radius, origin] = replace(together, origin=origin)
                    continue
                chosen = near.take(near.origin == origin)
                named = radii_of(chosen, radius)
                found[radius, origin] = radius_coverage(chosen, named, area, origin)
        return found

    def _zones(
        self, area: shapely.MultiPolygon, near: Anchors, own: Anchors
    ) -> dict[tuple[str, Radius], ZonePart]:
        """Return what the tile holds of each zone at each radius."""
        zones = self.wish.zones.read() if self.wish.zones is not None else {}
        found: dict[tuple[str, Radius], ZonePart] = {}
        for zone, shapes in zones.items():
            part = clipped(area, shapely.union_all(shapes))
            for radius in self.radii:
                reached = reaching(own, radii_of(own, radius).each_m, shapes)
                named = radii_of(near, radius)
                levels = None if part.is_empty else radius_coverage(near, named, part)
                if reached.any() or levels is not None:
                    found[zone, radius] = ZonePart(part.area, int(reached.sum()), levels)
        return found

    def _depths(self, area: shapely.MultiPolygon, near: Anchors) -> dict[Radius, DepthProfile]:
        row_m = self.wish.row_m
        return {
            radius: depth_profile(
                near.x_m, near.y_m, radii_of(near, radius).each_m, area, row_m=row_m
            )
            for radius in self.radii
        }

    def _regions(
        self, area: shapely.MultiPolygon, near: Anchors
    ) -> dict[tuple[Radius, int], shapely.MultiPolygon]:
        inside = TransitArea(area, near.crs)
        return {
            (radius, level): region
            for radius in self.radii
            for level, region in level_regions(near, inside, radius).items()
            if not region.is_empty
        }


def _curve(anchors: Anchors, area: shapely.MultiPolygon, radii_m: Sequence[float]) -> Floats:
    found = [level_areas(anchors.x_m, anchors.y_m, radius, area) for radius in radii_m]
    return np.array([(*node.areas_m2, *node.boundary_m, node.closure_m) for node in found])


def plan_job(
    anchors: AnchorSource,
    transit: TransitSource,
    radii: Sequence[Radius],
    *,
    anchors_count: int,
    largest_own_m: float = 0.0,
    tile_m: float | None = None,
    wish: Wish = Wish(),
) -> TileJob:
    """Return the job whose tiles cover both the transit area and the anchors.

    Parameters
    ----------
    anchors, transit : sources in the same projected CRS
    radii : metres, device classes, or None for each anchor's own
    anchors_count : how many anchors there are; decides the size of the tiles
    largest_own_m : largest radius of the anchors' own, needed when ``radii`` holds None
    tile_m : side of a tile in metres; chosen when None
    wish : what to find besides the levels of every radius

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
    sizes = [*(size for size in named if size is not None), *wish.curve_m]
    halo_m = max([*sizes, largest_own_m * (None in radii)])
    boxes = np.array([transit.bounds, anchors.bounds])
    x0, y0 = (float(value) for value in np.nanmin(boxes[:, :2], axis=0))
    x1, y1 = (float(value) for value in np.nanmax(boxes[:, 2:], axis=0))
    bounds = (x0, y0, x1, y1)
    size = tile_m if tile_m is not None else tile_size_m(bounds, anchors_count, halo_m)
    return TileJob(anchors, transit, plan_tiles(bounds, size), tuple(radii), halo_m, wish)


def _inside(anchors: Anchors, square: Bounds) -> npt.NDArray[np.bool_]:
    x0, y0, x1, y1 = square
    x, y = anchors.x_m, anchors.y_m
    return (x >= x0) & (x < x1) & (y >= y0) & (y < y1)


def _grown(bounds: Bounds, halo_m: float) -> Bounds:
    x0, y0, x1, y1 = bounds
    return (x0 - halo_m, y0 - halo_m, x1 + halo_m, y1 + halo_m)

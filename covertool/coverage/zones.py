"""Coverage of districts, streets or road classes, and of an area of interest.

Only the transit area is cut. Anchors outside a zone that reach into it still count.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import shapely

from covertool.coverage.clip import clipped
from covertool.coverage.levels import radius_coverage
from covertool.coverage.radii import Radius, check_anchors, radii_of
from covertool.errors import GeometryError
from covertool.model import Anchors, Floats, Objects, RadiusCoverage, TransitArea


@dataclass(frozen=True)
class ZoneCoverage:
    """The coverage of the transit area inside one zone.

    Attributes
    ----------
    zone : name of the zone
    transit_area_m2 : transit area inside it in square metres
    coverage : its levels; ``anchors`` counts those that reach the zone's bounding box
    """

    zone: str
    transit_area_m2: float
    coverage: RadiusCoverage


def zone_levels(
    anchors: Anchors,
    transit: TransitArea,
    zones: Mapping[str, Objects],
    radii: Sequence[Radius],
) -> tuple[ZoneCoverage, ...]:
    """Return the coverage of each zone for each radius.

    Zones that overlap each count their common part; what no zone covers is in none.

    Parameters
    ----------
    anchors, transit : in the same projected CRS
    zones : polygons of each zone by its name, in the same CRS
    radii : metres, device classes, or None for each anchor's own

    Examples
    --------
    >>> from pyproj import CRS
    >>> road = TransitArea(shapely.MultiPolygon([shapely.box(0, 0, 100, 10)]), CRS(2157))
    >>> car = Anchors.from_points([100.0], [5.0], CRS(2157))
    >>> west = np.array([shapely.box(0, 0, 50, 50)], dtype=object)
    >>> zone_levels(car, road, {"west": west}, [60.0])[0].coverage.fractions[1] > 0
    True
    """
    check_anchors(anchors, transit)
    found = []
    for zone, shapes in zones.items():
        part = clipped(transit.polygons, shapely.union_all(shapes))
        for radius in radii:
            found.append(ZoneCoverage(zone, part.area, _levels(anchors, part, radius, shapes)))
    return tuple(found)


def clip_transit(transit: TransitArea, area_of_interest: Objects) -> TransitArea:
    """Return the transit area inside an area of interest.

    Raises
    ------
    GeometryError
        When nothing of it lies there.
    """
    inside = clipped(transit.polygons, shapely.union_all(area_of_interest))
    require_area(inside.area)
    return TransitArea(inside, transit.crs)


def require_area(area_m2: float) -> None:
    """Raise GeometryError when nothing of the transit area lies in the area of interest."""
    if not area_m2 > 0:
        raise GeometryError(
            "nothing of the transit area lies in the area of interest",
            "--aoi",
            "check that both are about the same place, and their CRS",
        )


def _levels(
    anchors: Anchors, part: shapely.MultiPolygon, radius: Radius, shapes: Objects
) -> RadiusCoverage:
    """Return the coverage of the part of the transit area in a zone, by the anchors near it."""
    named = radii_of(anchors, radius)
    near = reaching(anchors, named.each_m, shapes)
    return radius_coverage(anchors.take(near), replace(named, each_m=named.each_m[near]), part)


def reaching(anchors: Anchors, radius_m: Floats, shapes: Objects) -> npt.NDArray[np.bool_]:
    """Return which anchors reach the bounding box of a zone."""
    x0, y0, x1, y1 = shapely.total_bounds(shapes)
    x, y = anchors.x_m, anchors.y_m
    near: npt.NDArray[np.bool_] = (
        (x + radius_m > x0) & (x - radius_m < x1) & (y + radius_m > y0) & (y - radius_m < y1)
    )
    return near

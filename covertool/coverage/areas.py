"""Discs and a transit area to the areas of Levels 0, 1, 2 and 3."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from covertool.coverage.arcs import reference_level_areas
from covertool.coverage.discs import Radius, check_anchors, check_points, check_radii, radii_of
from covertool.model import Anchors, CoverageReport, Floats, RadiusCoverage, TransitArea


@dataclass(frozen=True)
class LevelAreas:
    """What the exact engine returns for one set of discs.

    Attributes
    ----------
    areas_m2 : areas of Levels 0, 1, 2, 3 in square metres; they sum to the transit area
    boundary_m : lengths inside the transit area of the circles' arcs that bound the places heard
        by at least 1, 2 and 3 anchors; this is how fast those areas grow with the radius
    closure_m : greatest length over the levels of the sum of the boundary's chords, which is zero
        for closed curves
    """

    areas_m2: tuple[float, float, float, float]
    boundary_m: tuple[float, float, float]
    closure_m: float


def level_areas(
    x_m: npt.ArrayLike,
    y_m: npt.ArrayLike,
    radius_m: npt.ArrayLike,
    polygons: shapely.MultiPolygon | shapely.Polygon,
    *,
    weights: npt.ArrayLike | None = None,
) -> LevelAreas:
    """Return the exact areas of Levels 0 to 3 that discs make within polygons.

    Parameters
    ----------
    x_m, y_m : (N,) centres in metres
    radius_m : (N,) or a number, in metres
    polygons : valid and disjoint, in the same CRS
    weights : (N,) anchors at each centre; 1 by default

    Raises
    ------
    GeometryError
        When a coordinate is not finite or a radius is not positive.

    Examples
    --------
    >>> areas = level_areas([0.0], [0.0], 1.0, shapely.box(-2, -2, 2, 2)).areas_m2
    >>> print(round(areas[1], 12))
    3.14159265359
    """
    x, y, radius, weight = disc_arrays(x_m, y_m, radius_m, weights)
    areas, lengths = reference_level_areas(  # type: ignore[no-untyped-call]
        x, y, radius, polygons, weight
    )
    none, one, two, three = (max(float(area), 0.0) for area in areas)
    first, second, third = (float(length) for length in lengths)
    return LevelAreas((none, one, two, three), (first, second, third), 0.0)


def disc_arrays(
    x_m: npt.ArrayLike, y_m: npt.ArrayLike, radius_m: npt.ArrayLike, weights: npt.ArrayLike | None
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return checked x, y, radius and weight as float arrays of one length."""
    x, y = np.asarray(x_m, dtype=float).ravel(), np.asarray(y_m, dtype=float).ravel()
    radius = np.array(np.broadcast_to(np.asarray(radius_m, dtype=float), x.shape))
    weight = np.ones(x.size) if weights is None else np.asarray(weights, dtype=float).ravel()
    check_points(x, y)
    check_radii(radius)
    return x, y, radius, weight


def coverage_levels(
    anchors: Anchors, transit: TransitArea, radii: Sequence[Radius]
) -> CoverageReport:
    """Return how much of the transit area hears none, one, two, and three or more anchors.

    Anchors of several origins (parked, queue, rsu) are reported all together (origin None) and
    each origin apart.

    Parameters
    ----------
    anchors, transit : in the same projected CRS
    radii : metres, device classes ``"A"`` to ``"D"``, or None for each anchor's own

    Raises
    ------
    OptionError, ColumnError, GeometryError, CrsError
        When a radius, a column, a coordinate or the CRS cannot be used.

    Examples
    --------
    >>> from pyproj import CRS
    >>> square = TransitArea(shapely.MultiPolygon([shapely.box(0, 0, 10, 10)]), CRS(2157))
    >>> report = coverage_levels(Anchors.from_points([0.0], [0.0], CRS(2157)), square, [5.0])
    >>> print(round(report.results[0].fractions[1], 6))
    0.19635
    """
    check_anchors(anchors, transit)
    present = sorted({str(origin) for origin in anchors.origin})
    groups = [None, *(present if len(present) > 1 else [])]
    results = tuple(
        _radius_coverage(anchors, transit, radius, origin) for radius in radii for origin in groups
    )
    return CoverageReport(transit.area_m2, len(anchors), results)


def _radius_coverage(
    anchors: Anchors, transit: TransitArea, radius: Radius, origin: str | None
) -> RadiusCoverage:
    chosen = anchors if origin is None else anchors.take(anchors.origin == origin)
    radii = radii_of(chosen, radius)
    found = level_areas(chosen.x_m, chosen.y_m, radii.each_m, transit.polygons)
    return RadiusCoverage(
        radius_m=radii.radius_m,
        device_class=radii.device_class,
        origin=origin,
        anchors=len(chosen),
        areas_m2=found.areas_m2,
        closure_m=found.closure_m,
    )

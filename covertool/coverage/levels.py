"""Anchors, a transit area and radii to the coverage report."""

from __future__ import annotations

from collections.abc import Sequence

import shapely

from covertool.coverage.areas import level_areas
from covertool.coverage.radii import Radii, Radius, check_anchors, radii_of
from covertool.model import Anchors, CoverageReport, RadiusCoverage, TransitArea


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
    present = sorted({str(origin) for origin in set(anchors.origin.tolist())})
    groups = [None, *(present if len(present) > 1 else [])]
    results = []
    for radius in radii:
        for origin in groups:
            chosen = anchors if origin is None else anchors.take(anchors.origin == origin)
            named = radii_of(chosen, radius)
            results.append(radius_coverage(chosen, named, transit.polygons, origin))
    return CoverageReport(transit.area_m2, len(anchors), tuple(results))


def radius_coverage(
    anchors: Anchors, radii: Radii, polygons: shapely.MultiPolygon, origin: str | None = None
) -> RadiusCoverage:
    """Return the coverage of polygons by anchors of given radii.

    Parameters
    ----------
    anchors : (N,) in the CRS of the polygons
    radii : of these anchors, and what to call them
    polygons : the transit area or a part of it
    origin : of all the anchors; None when they are not reported apart

    Examples
    --------
    >>> from pyproj import CRS
    >>> car = Anchors.from_points([0.0], [0.0], CRS(2157))
    >>> square = shapely.MultiPolygon([shapely.box(0, 0, 10, 10)])
    >>> print(round(radius_coverage(car, radii_of(car, 5.0), square).areas_m2[1], 6))
    19.634954
    """
    found = level_areas(anchors.x_m, anchors.y_m, radii.each_m, polygons)
    return RadiusCoverage(
        radius_m=radii.radius_m,
        device_class=radii.device_class,
        origin=origin,
        anchors=len(anchors),
        areas_m2=found.areas_m2,
        closure_m=found.closure_m,
    )

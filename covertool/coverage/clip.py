"""Cutting the transit area to a region."""

from __future__ import annotations

import numpy as np
import shapely

_POLYGON = 3


def clipped(polygons: shapely.MultiPolygon, region: shapely.Geometry) -> shapely.MultiPolygon:
    """Return the part of polygons inside a region; polygons wholly inside stay as they are.

    Examples
    --------
    >>> square = shapely.MultiPolygon([shapely.box(0, 0, 10, 10)])
    >>> clipped(square, shapely.box(8, 0, 20, 20)).area
    20.0
    """
    parts = shapely.get_parts(polygons)
    shapely.prepare(region)
    whole = shapely.covers(region, parts)
    meets = shapely.intersects(region, parts) & ~whole
    cut = shapely.intersection(parts[meets], region)
    pieces = shapely.get_parts(shapely.get_parts(np.concatenate([parts[whole], cut])))
    return shapely.MultiPolygon(list(pieces[shapely.get_type_id(pieces) == _POLYGON]))

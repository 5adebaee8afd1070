"""The transit area: carriageways, turning heads and car-park aisles as one valid area."""

from __future__ import annotations

import shapely

from data.recipe.skeleton import Street

KERB_RADIUS_M = 4.5
TURNING_HEAD_M = 7.5
GRID_M = 0.01
ROUNDABOUTS: tuple[tuple[float, float], ...] = (
    (676.0, 598.0), (148.0, -815.0), (820.0, 10.0), (-790.0, -490.0), (860.0, -740.0),
)  # fmt: skip


def carriageway(streets: list[Street]) -> shapely.MultiPolygon:
    """Return the union of the streets' carriageways with rounded kerbs at junctions."""
    parts = [street.line.buffer(street.width_m / 2, cap_style="flat") for street in streets]
    heads = [
        shapely.Point(street.points[-1]).buffer(TURNING_HEAD_M)
        for street in streets
        if street.closed
    ]
    centres = [shapely.Point(place) for place in ROUNDABOUTS]
    rings = [centre.buffer(17.0) for centre in centres]
    merged = shapely.union_all([*parts, *heads, *rings])
    rounded = merged.buffer(KERB_RADIUS_M).buffer(-KERB_RADIUS_M)
    islands = shapely.union_all([centre.buffer(9.0) for centre in centres])
    return multi(rounded.difference(islands).simplify(0.04))


def multi(area: shapely.Geometry) -> shapely.MultiPolygon:
    """Return an area as valid polygons on the centimetre grid."""
    snapped = shapely.set_precision(shapely.make_valid(area), GRID_M)
    parts = [part for part in shapely.get_parts(snapped) if part.geom_type == "Polygon"]
    return shapely.MultiPolygon(parts)

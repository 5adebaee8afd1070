"""Geometry that comes in: what is repaired, what is dropped, and the count of both."""

from __future__ import annotations

import logging
import math
from collections import Counter

import numpy as np
import numpy.typing as npt
import shapely
from pyproj import CRS

from covertool.crs import name
from covertool.errors import CrsError, GeometryError
from covertool.model import Objects

_LOG = logging.getLogger(__name__)

POLYGONS = (3, 6)
POINTS = (0, 4)
_COLLECTION = 7


class Repairs:
    """Counts of what was dropped or repaired in one source, told in one warning line.

    Parameters
    ----------
    where : str
        The file and layer that the counts are about.
    """

    def __init__(self, where: str) -> None:
        self.where = where
        self.counts: Counter[str] = Counter()

    def note(self, what: str, count: int) -> None:
        """Add to a count; ``what`` reads after a number, as in "3 empty geometries dropped"."""
        if count:
            self.counts[what] += int(count)

    def tell(self) -> None:
        """Log one warning that holds every count, if there is any."""
        if self.counts:
            told = "; ".join(f"{count} {what}" for what, count in self.counts.items())
            _LOG.warning("%s: %s", self.where, told)


def finite(geometries: Objects) -> npt.NDArray[np.bool_]:
    """Return which geometries have only finite coordinates (none at all counts as finite)."""
    coordinates, owner = shapely.get_coordinates(geometries, return_index=True)
    bad = ~np.isfinite(coordinates).all(axis=1)
    good = np.ones(len(geometries), dtype=bool)
    good[owner[bad]] = False
    return good


def usable(geometries: Objects, repairs: Repairs) -> npt.NDArray[np.bool_]:
    """Return which geometries are neither null nor empty and have finite coordinates."""
    null = shapely.is_missing(geometries)
    empty = ~null & shapely.is_empty(geometries)
    good = finite(geometries)
    repairs.note("null geometries dropped", int(null.sum()))
    repairs.note("empty geometries dropped", int(empty.sum()))
    repairs.note("geometries with NaN or infinite coordinates dropped", int((~good).sum()))
    keep: npt.NDArray[np.bool_] = ~null & ~empty & good
    return keep


def within_degrees(geometries: Objects, crs: CRS, repairs: Repairs) -> npt.NDArray[np.bool_]:
    """Return which geometries lie within the range of a geographic CRS; all for other CRSs.

    Raises
    ------
    CrsError
        When most lie outside: the numbers are metres and the label is wrong.
    """
    if not crs.is_geographic or len(geometries) == 0:
        return np.ones(len(geometries), dtype=bool)
    half_turn = math.pi / crs.axis_info[0].unit_conversion_factor
    x0, y0, x1, y1 = shapely.bounds(geometries).T
    inside: npt.NDArray[np.bool_] = (np.maximum(-x0, x1) <= 2 * half_turn) & (
        np.maximum(-y0, y1) <= half_turn / 2 + 1e-9
    )
    if 2 * int(inside.sum()) <= len(geometries):
        bounds = tuple(round(float(value), 3) for value in shapely.total_bounds(geometries))
        raise CrsError(
            f"the coordinates are not degrees, as {name(crs)} says (they span {bounds})",
            repairs.where,
            "give the data its true CRS, such as EPSG:2157 for metres in Ireland",
        )
    repairs.note(f"geometries outside the range of {name(crs)} dropped", int((~inside).sum()))
    return inside


def polygons(geometries: Objects, repairs: Repairs) -> Objects:
    """Return valid 2D (multi)polygons row by row; None where a row holds no polygon."""
    flat: Objects = np.asarray(shapely.force_2d(geometries), dtype=object)
    invalid = ~shapely.is_valid(flat)
    if invalid.any():
        flat[invalid] = shapely.make_valid(flat[invalid], method="structure")
        repairs.note("invalid polygons repaired", int(invalid.sum()))
    found = np.array([_polygon_part(geometry) for geometry in flat], dtype=object)
    repairs.note("geometries that are not polygons dropped", int(shapely.is_missing(found).sum()))
    return found


def _polygon_part(geometry: shapely.Geometry) -> shapely.Geometry | None:
    if shapely.get_type_id(geometry) in POLYGONS:
        return geometry
    if shapely.get_type_id(geometry) != _COLLECTION:
        return None
    parts = [part for part in map(_polygon_part, shapely.get_parts(geometry)) if part is not None]
    return shapely.union_all(parts) if parts else None


def unite(geometries: Objects, where: str) -> shapely.MultiPolygon:
    """Return the union of polygons as valid, disjoint parts.

    Raises
    ------
    GeometryError
        When there is no area.
    """
    union = shapely.union_all(geometries)
    parts = [part for part in shapely.get_parts(union) if shapely.get_type_id(part) == 3]
    whole = shapely.MultiPolygon(parts)
    if not whole.is_valid:
        return unite(np.array([shapely.buffer(whole, 0)], dtype=object), where)
    if not whole.area > 0:
        raise GeometryError(
            "there is no polygon with an area",
            where,
            "name a layer of polygons; covertool transit makes one from OSM or a road mask",
        )
    return whole

"""The transit area from a mask or from OpenStreetMap roads."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
import shapely
from pyproj import CRS

from covertool.crs import transform, transform_geometries
from covertool.errors import ComputationError, GeometryError
from covertool.extract.carriageways import RoadChoice, carriageway_width_m, is_transit
from covertool.extract.masks import mask_outlines
from covertool.model import Floats, Objects, RasterSource, TransitArea

if TYPE_CHECKING:
    import geopandas as gpd

_LOG = logging.getLogger(__name__)

AREA_TOLERANCE = 0.005
"""The cleaned area is within this share of the mask's pixel area."""

_SPECK_M2 = 6.0
"""Smaller than a parked car: no carriageway, and no island in one."""

_SLIVER_M2 = 0.01
_SLIT_M = 0.5
_SPECK_BUDGET = 0.8 * AREA_TOLERANCE
_SMOOTHING_PX = (1.0, 0.5, 0.25)


def transit_from_mask(raster: RasterSource, *, like: RasterSource | None = None) -> TransitArea:
    """Return the transit area that a mask shows, with clean outlines.

    Stair steps are drawn as lines through the middles of the pixels' sides and simplified; specks
    and pinholes go. Where that would change the area by more than 0.5 %, less is done.

    Parameters
    ----------
    raster : RasterSource
        The mask.
    like : RasterSource, optional
        The image, when the mask has no georeference of its own and shares the image's pixels.

    Raises
    ------
    GeometryError
        When no pixel is transit, the raster is no mask, or it has another shape than ``like``.

    Examples
    --------
    >>> import tempfile
    >>> from covertool.gis.geotiff import open_raster
    >>> from covertool.gis.picture import write_picture
    >>> mask = np.zeros((40, 100, 3), dtype=np.uint8)
    >>> mask[10:30] = 255
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_picture(f"{folder}/mask.png", mask)
    ...     area = transit_from_mask(open_raster(f"{folder}/mask.png", gsd_m=0.5))
    >>> round(area.area_m2)
    500
    """
    if like is not None and (raster.width, raster.height) != (like.width, like.height):
        raise GeometryError(
            f"the mask has no georeference and {raster.width} x {raster.height} pixels, the image "
            f"{like.width} x {like.height}",
            f"{raster.name}, {like.name}",
            "give a mask with a georeference, or one with the image's pixels",
        )
    place = (raster if like is None else like).to_metres
    crs = (raster if like is None else like).crs
    outlines = mask_outlines(raster)
    exact = _on_map(outlines, place)
    target = float(shapely.area(exact).sum())
    kept = _without_specks(outlines, exact, target)
    for tolerance_px in _SMOOTHING_PX:
        smooth = _united(_on_map(_smoothed(kept, tolerance_px), place))
        if abs(smooth.area - target) <= AREA_TOLERANCE * target:
            return TransitArea(smooth, crs)
    plain = _united(_on_map(kept, place))
    if abs(plain.area - target) > AREA_TOLERANCE * target:
        raise ComputationError(
            f"the outlines hold {plain.area:.1f} m2, the mask {target:.1f} m2",
            raster.name,
            "report this mask as a fault of covertool",
        )
    return TransitArea(plain, crs)


def transit_from_roads(roads: gpd.GeoDataFrame, choice: RoadChoice | None = None) -> TransitArea:
    """Return the carriageways of OpenStreetMap roads: lines buffered by half their width.

    Ends that meet another road are rounded so that no gap stays; dead ends are cut flat.

    Parameters
    ----------
    roads : GeoDataFrame
        Lines in a projected CRS in metres, with a column ``tags`` of dicts.
    choice : RoadChoice, optional
        Which roads count, and their default widths.

    Raises
    ------
    GeometryError
        When no road is a carriageway.

    Examples
    --------
    >>> import geopandas as gpd
    >>> street = {"highway": "residential", "width": "6"}
    >>> line = shapely.LineString([(0, 0), (100, 0)])
    >>> roads = gpd.GeoDataFrame({"tags": [street]}, geometry=[line], crs=2157)
    >>> transit_from_roads(roads).area_m2
    600.0
    """
    chosen = choice or RoadChoice()
    tags = list(roads["tags"])
    rows = np.array([is_transit(tag, chosen) for tag in tags], dtype=bool)
    if not rows.any():
        raise GeometryError(
            "no road of the extract is a carriageway",
            "highway tags",
            "use a larger extract, or include tunnels or private roads",
        )
    lines: Objects = np.asarray(roads.geometry.array, dtype=object)[rows]
    widths = np.array(
        [carriageway_width_m(t, chosen) for t, on in zip(tags, rows, strict=True) if on]
    )
    bodies = shapely.buffer(lines, widths / 2, cap_style="flat", join_style="round", quad_segs=8)
    joints = _joints(lines, widths / 2)
    _LOG.info("%d of %d roads are carriageways", len(lines), len(tags))
    whole = _united(np.concatenate([bodies, joints]))
    return TransitArea(shapely.MultiPolygon([_without_slits(p) for p in whole.geoms]), roads.crs)


def _without_slits(polygon: shapely.Polygon) -> shapely.Polygon:
    """Return a polygon without holes too thin for a kerb between two carriageways."""
    holes = np.array([shapely.Polygon(ring) for ring in polygon.interiors], dtype=object)
    thin = shapely.is_empty(shapely.buffer(holes, -_SLIT_M / 2, quad_segs=1))
    kept = [ring for ring, gone in zip(polygon.interiors, thin, strict=True) if not gone]
    return shapely.Polygon(polygon.exterior, kept)


def seen_part(area: TransitArea, images: Sequence[RasterSource]) -> TransitArea:
    """Return the part of a transit area that the images show, in the CRS of the first image.

    Raises
    ------
    GeometryError
        When the images show none of it.
    """
    crs = images[0].crs
    [moved] = transform_geometries(np.array([area.polygons], dtype=object), area.crs, crs)
    frames = [_frame(image, crs) for image in images]
    seen = _united(np.array([shapely.intersection(moved, shapely.union_all(frames))]))
    if seen.is_empty:
        raise GeometryError(
            "the transit area lies beside the images",
            ", ".join(image.name for image in images[:5]),
            "give a mask or an extract of the same place, or check the CRS of both",
        )
    return TransitArea(seen, crs)


def dissolved(frames: Sequence[gpd.GeoDataFrame], crs: CRS) -> shapely.MultiPolygon:
    """Return the polygons of several layers united, in one CRS."""
    moved = [
        transform_geometries(np.asarray(f.geometry.array, dtype=object), f.crs, crs) for f in frames
    ]
    return _united(np.concatenate(moved))


def _frame(image: RasterSource, crs: CRS) -> shapely.Polygon:
    """Return the outline of an image, with points along its sides, which ``crs`` may bend."""
    share = np.linspace(0, 1, 17)[:-1]
    x = np.concatenate([share, np.ones(16), 1 - share, np.zeros(16)]) * image.width
    y = np.concatenate([np.zeros(16), share, np.ones(16), 1 - share]) * image.height
    return shapely.Polygon(np.column_stack(transform(*image.to_metres(x, y), image.crs, crs)))


def _joints(lines: Objects, half_m: Floats) -> Objects:
    """Return discs that fill the wedge between roads which meet end to end.

    A disc has the second largest half width of the ends that meet, so that it closes the gap and
    does not swell the narrower road.
    """
    parts, owner = shapely.get_parts(lines, return_index=True)
    ends = np.concatenate([shapely.get_point(parts, 0), shapely.get_point(parts, -1)])
    half = np.tile(half_m[owner], 2)
    xy = shapely.get_coordinates(ends)
    _, node = np.unique(np.round(xy, 2), axis=0, return_inverse=True)
    node = node.ravel()
    order = np.lexsort((-half, node))
    node, half, xy = node[order], half[order], xy[order]
    second = np.zeros(node.size, dtype=bool)
    second[1:] = node[1:] == node[:-1]
    second[2:] &= node[2:] != node[:-2]
    discs: Objects = shapely.buffer(shapely.points(xy[second]), half[second], quad_segs=8)
    return discs


def _on_map(outlines: Objects, place: Callable[[Floats, Floats], tuple[Floats, Floats]]) -> Objects:
    moved: Objects = shapely.transform(
        outlines, lambda px: np.column_stack(place(px[:, 0], px[:, 1]))
    )
    return moved


def _without_specks(outlines: Objects, exact: Objects, total_m2: float) -> Objects:
    """Return the outlines without specks and pinholes, the smallest first, within the budget."""
    rings = sorted(
        (float(shapely.Polygon(ring).area), i, j)
        for i, polygon in enumerate(exact)
        for j, ring in enumerate([polygon.exterior, *polygon.interiors])
    )
    dropped: set[tuple[int, int]] = set()
    change = 0.0
    for area, i, j in rings:
        after = change + (area if j > 0 else -area)
        if area >= _SPECK_M2:
            break
        if abs(after) <= _SPECK_BUDGET * total_m2:
            change = after
            dropped.add((i, j))
    kept = [
        shapely.Polygon(
            p.exterior, [r for j, r in enumerate(p.interiors, 1) if (i, j) not in dropped]
        )
        for i, p in enumerate(outlines)
        if (i, 0) not in dropped
    ]
    if dropped:
        _LOG.info("%d specks and pinholes removed from the mask", len(dropped))
    return np.array(kept, dtype=object)


def _smoothed(outlines: Objects, tolerance_px: float) -> Objects:
    """Return outlines with slopes for stair steps and without superfluous vertices."""
    return np.array(
        [
            shapely.difference(
                _smoothed_ring(outline.exterior, tolerance_px),
                shapely.union_all([_smoothed_ring(r, tolerance_px) for r in outline.interiors]),
            )
            for outline in outlines
        ],
        dtype=object,
    )


def _smoothed_ring(ring: shapely.LinearRing, tolerance_px: float) -> shapely.Geometry:
    """Return the inside of a ring, simplified and then moved out or in so that it keeps its area.

    A line through stair steps is off by a part of a step; the shift is the area's error over the
    length of the ring.
    """
    exact = shapely.Polygon(ring).area
    simple = shapely.simplify(shapely.Polygon(_through_middles(ring)), tolerance_px)
    shift = (exact - simple.area) / simple.length
    return shapely.buffer(simple, shift, join_style="mitre", mitre_limit=2.0)


def _through_middles(ring: shapely.LinearRing) -> Floats:
    """Return a rectilinear ring's steps as slopes; long straight sides and corners stay.

    Each side gives its middle when it is a short step, and points half a pixel from its ends when
    it is long, so that a kerb along the image's axis keeps its place.
    """
    corners = _turns(shapely.get_coordinates(ring)[:-1])
    corners = np.concatenate([corners, corners[:1]])
    start, stop = corners[:-1], corners[1:]
    length = np.abs(stop - start).sum(axis=1)
    share = np.minimum(0.5 / length, 0.5)[:, None]
    first, last = start + share * (stop - start), stop - share * (stop - start)
    return np.stack([first, last], axis=1).reshape(-1, 2)


def _turns(corners: Floats) -> Floats:
    """Return the corners at which a closed ring changes its direction, from the topmost on."""
    back, ahead = corners - np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0) - corners
    turning: Floats = corners[np.abs(back[:, 0] * ahead[:, 1] - back[:, 1] * ahead[:, 0]) > 1e-9]
    first = int(np.lexsort(turning.T)[0])
    return np.roll(turning, -first, axis=0)


def _united(polygons: Objects) -> shapely.MultiPolygon:
    whole = shapely.union_all(shapely.make_valid(polygons))
    parts = [
        part
        for part in shapely.get_parts(whole)
        if part.geom_type == "Polygon" and part.area > _SLIVER_M2
    ]
    return shapely.MultiPolygon(parts)

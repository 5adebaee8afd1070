"""The street network as pieces with a length that counts: duplicates, overlaps, clipping."""

from __future__ import annotations

import logging
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
import numpy.typing as npt
import shapely
from pyproj import CRS

from covertool.errors import ColumnError, GeometryError, OptionError
from covertool.model import Floats, Objects

if TYPE_CHECKING:
    import geopandas as gpd

_LOG = logging.getLogger(__name__)

Flags = npt.NDArray[np.bool_]
Weight = Literal["directed", "undirected", "lane"]
WEIGHTS: tuple[Weight, ...] = ("directed", "undirected", "lane")
ID_COLUMNS = ("segment_id", "edge_id", "osm_id", "id")


@dataclass(frozen=True)
class Streets:
    """Directed pieces of street, one row each; the line runs in the direction of travel.

    Attributes
    ----------
    segment_id : (N,) object array of str; a segment may consist of several pieces
    line : (N,) object array of LineStrings in ``crs``
    length_m : (N,) metres inside the AOI, declared where the data declare it, else measured
    lanes : (N,) lanes in this direction
    weight : (N,) the length with which the piece counts
    two_way : (N,) True where another piece runs the same line backwards
    crs : the CRS of the lines
    """

    segment_id: Objects
    line: Objects
    length_m: Floats
    lanes: Floats
    weight: Floats
    two_way: Flags
    crs: CRS

    def __len__(self) -> int:
        return int(self.segment_id.size)


def streets(
    frame: gpd.GeoDataFrame,
    *,
    weight: Weight = "directed",
    aoi: shapely.Geometry | None = None,
) -> Streets:
    """Return a network of directed segments as pieces that count once.

    A segment given twice counts once. Segments of different ids on one directed line share its
    length equally, and so do two that overlap in part. With ``undirected`` the two directions of
    a street share its length; with ``lane`` the length is multiplied by ``lanes``.

    Parameters
    ----------
    frame : GeoDataFrame of lines in metres
        Columns ``segment_id`` (or ``edge_id``, ``osm_id``, ``id``), and optionally ``lanes`` and
        ``length_m``, the declared length, which counts and is compared with the measured one.
    weight : str
        ``directed``, ``undirected`` or ``lane``.
    aoi : shapely geometry or None
        Keep only what lies inside.

    Raises
    ------
    ColumnError, GeometryError, OptionError
        When there is no id, no line at all, or no such weight.

    Examples
    --------
    >>> import geopandas as gpd
    >>> line = shapely.LineString([(0, 0), (100, 0)])
    >>> both = gpd.GeoDataFrame(
    ...     {"segment_id": ["there", "back"]}, geometry=[line, line.reverse()], crs=2157
    ... )
    >>> streets(both, weight="undirected").weight.tolist()
    [50.0, 50.0]
    """
    pieces = _pieces(frame)
    lines = np.asarray(pieces.geometry.values, dtype=object)
    ids = pieces["segment_id"].to_numpy(dtype=object)
    measured = shapely.length(lines)
    stretch = _declared(pieces, measured) / measured
    lanes = _lanes(pieces)
    share, two_way = _shares(ids, lines)
    overlap_m = _partial_overlaps(ids, lines)
    counted = np.clip(measured * share - overlap_m, 0.0, None) / measured
    if aoi is not None:
        lines = _clip(lines, aoi)
        lines, rows = shapely.get_parts(lines, return_index=True)
        ids, lanes, two_way = ids[rows], lanes[rows], two_way[rows]
        counted, stretch = counted[rows], stretch[rows]
    length_m = shapely.length(lines) * stretch
    weights = length_m * counted * _factor(weight, lanes, two_way)
    keep = weights > 0
    if not keep.any():
        raise GeometryError(
            "no street length lies inside the AOI", "segments", "choose an AOI over the streets"
        )
    return Streets(
        segment_id=ids[keep],
        line=lines[keep],
        length_m=length_m[keep],
        lanes=lanes[keep],
        weight=weights[keep],
        two_way=two_way[keep],
        crs=frame.crs,
    )


def _factor(weight: Weight, lanes: Floats, two_way: Flags) -> Floats:
    """Return what each piece's length is multiplied by."""
    if weight not in WEIGHTS:
        raise OptionError(f"there is no weight {weight!r}", "--weight", f"use {', '.join(WEIGHTS)}")
    if weight == "lane":
        return lanes
    if weight == "undirected":
        return np.where(two_way, 0.5, 1.0)
    return np.ones(lanes.size)


def id_column(frame: gpd.GeoDataFrame) -> str:
    """Return the name of the column that holds the ids of segments.

    Raises
    ------
    ColumnError
        When there is none.
    """
    column = next((name for name in ID_COLUMNS if name in frame.columns), None)
    if column is None:
        raise ColumnError(
            f"the segments have no id column (they have {', '.join(map(str, frame.columns))})",
            "segments",
            "add a column segment_id that the observations refer to",
        )
    return column


def _pieces(frame: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """Return single LineStrings with a segment_id, without gaps and exact duplicates."""
    column = id_column(frame)
    usable = ~(frame.geometry.isna() | frame.geometry.is_empty) & frame[column].notna()
    if not usable.all():
        _LOG.warning("%d segments without geometry or id are left out", int((~usable).sum()))
    frame = frame[usable].rename(columns={column: "segment_id"})
    frame["segment_id"] = frame["segment_id"].astype(str)
    if "length_m" in frame:
        frame["part_of_m"] = frame.geometry.length
    frame = frame.explode(index_parts=False, ignore_index=True)
    frame = frame[(frame.geometry.geom_type == "LineString") & (frame.geometry.length > 0)]
    if frame.empty:
        raise GeometryError("there is no line among the segments", "segments", "give LineStrings")
    twice = frame.assign(wkb=frame.geometry.to_wkb()).duplicated(["segment_id", "wkb"])
    if twice.any():
        _LOG.warning("%d segments are given twice and count once", int(twice.sum()))
    return frame[~twice.to_numpy()].reset_index(drop=True)


def _declared(pieces: gpd.GeoDataFrame, measured: Floats) -> Floats:
    """Return the declared lengths where there are any, and warn of those far from the measured."""
    if "length_m" not in pieces:
        return measured
    import pandas as pd

    given = pd.to_numeric(pieces["length_m"], errors="coerce").to_numpy(dtype=float)
    # A segment of several parts declares one length for all of them.
    given = given * measured / pieces["part_of_m"].to_numpy(dtype=float)
    declared = np.where(given > 0, given, measured)
    ratio = declared / measured
    apart = np.abs(ratio - 1) > 0.1
    if apart.any():
        worst = int(np.argmax(np.abs(np.log(ratio))))
        _LOG.warning(
            "%d segments declare a length that differs by over 10 %% from their line, such as %s:"
            " %.1f m declared, %.1f m measured; the declared one counts",
            int(apart.sum()),
            pieces["segment_id"].iloc[worst],
            declared[worst],
            measured[worst],
        )
    return declared


def _lanes(pieces: gpd.GeoDataFrame) -> Floats:
    import pandas as pd

    if "lanes" not in pieces:
        return np.ones(len(pieces))
    lanes = pd.to_numeric(pieces["lanes"], errors="coerce").to_numpy(dtype=float)
    return np.where(lanes >= 1, np.floor(lanes), 1.0)


def _shares(ids: Objects, lines: Objects) -> tuple[Floats, Flags]:
    """Return each piece's share of its directed line, and whether it has an opposite."""
    # Whole centimetres: the two directions of one street are often rounded apart.
    forward = [shapely.get_coordinates(line).round(2) + 0.0 for line in lines]
    keys = [points.tobytes() for points in forward]
    backward = [np.ascontiguousarray(points[::-1]).tobytes() for points in forward]
    count = Counter(keys)
    share = np.array([1.0 / count[key] for key in keys])
    shared = share < 1
    if shared.any():
        _LOG.warning(
            "%d segments lie exactly on another (such as %s) and share its length",
            int(shared.sum()),
            ids[int(np.argmax(shared))],
        )
    two_way = np.array([b in count and b != k for k, b in zip(keys, backward, strict=True)])
    return share, two_way


def _partial_overlaps(ids: Objects, lines: Objects) -> Floats:
    """Return the metres that each piece gives up to pieces on part of it, the same way."""
    lost = np.zeros(lines.size)
    tree = shapely.STRtree(lines)
    pairs = [tree.query(lines, predicate=p) for p in ("overlaps", "contains_properly")]
    first, second = np.hstack(pairs)
    once = (first < second) | (np.arange(first.size) >= pairs[0].shape[1])
    first, second = first[once], second[once]
    common = shapely.line_merge(shapely.intersection(lines[first], lines[second]))
    together = shapely.length(common)
    for a, b, part, metres in zip(first, second, common, together, strict=True):
        if metres > 1.0 and not lines[a].equals(lines[b]) and _same_way(lines[a], lines[b], part):
            lost[[a, b]] += metres / 2
    if lost.any():
        _LOG.warning(
            "segments overlap along %.0f m (such as %s); that length counts once",
            lost.sum(),
            ids[int(np.argmax(lost))],
        )
    return lost


def _same_way(a: shapely.LineString, b: shapely.LineString, part: shapely.Geometry) -> bool:
    longest = max(shapely.get_parts(part), key=shapely.length)
    points = shapely.get_coordinates(longest)
    ends = shapely.points(points[[0, -1]])
    along_a, along_b = (np.diff(shapely.line_locate_point(line, ends))[0] for line in (a, b))
    return bool(along_a * along_b > 0)


def _clip(lines: Objects, aoi: shapely.Geometry) -> Objects:
    """Return the parts of the lines inside, in the direction of the lines."""
    shapely.prepare(aoi)
    clipped = np.array(lines, dtype=object)
    cut = ~shapely.covers(aoi, lines)
    clipped[cut] = shapely.line_merge(shapely.intersection(lines[cut], aoi), directed=True)
    return clipped

"""The places of Levels 1, 2 and 3 as polygons.

The boundaries that give the exact areas are drawn as chords, each arc once for both of its
sides, so that neighbouring levels share their vertices.
"""

# mypy: disable-error-code="no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np
import shapely

from covertool.coverage.areas import disc_arrays, grids
from covertool.coverage.cells import level_boundaries
from covertool.coverage.chords import chords
from covertool.coverage.compiled import announced, compiled
from covertool.coverage.edges import directed_edges
from covertool.coverage.radii import Radius, check_anchors, radii_of
from covertool.coverage.rings import follow, join_runs, node_numbers
from covertool.errors import OptionError
from covertool.model import Anchors, Floats, Integers, Objects, TransitArea

Regions = dict[int, shapely.MultiPolygon]


def level_regions(
    anchors: Anchors, transit: TransitArea, radius: Radius, *, chord_tolerance_m: float = 0.01
) -> Regions:
    """Return the places of Levels 1, 2 and 3 as valid, disjoint polygons within the transit area.

    Arcs are drawn as chords that stay within the tolerance, with vertices that preserve the area.

    Parameters
    ----------
    anchors, transit : in the same projected CRS
    radius : metres, a device class ``"A"`` to ``"D"``, or None for each anchor's own
    chord_tolerance_m : greatest distance between an arc and its chords, in metres

    Raises
    ------
    OptionError, ColumnError, GeometryError, CrsError
        When the tolerance, the radius, a column, a coordinate or the CRS cannot be used.

    Examples
    --------
    >>> from pyproj import CRS
    >>> square = TransitArea(shapely.MultiPolygon([shapely.box(0, 0, 10, 10)]), CRS(2157))
    >>> regions = level_regions(Anchors.from_points([5.0], [5.0], CRS(2157)), square, 2.0)
    >>> print(round(regions[1].area, 6), regions[2].is_empty)
    12.566371 True
    """
    if not chord_tolerance_m > 0:
        raise OptionError(
            f"a chord tolerance of {chord_tolerance_m} m is not possible",
            "chord tolerance",
            "use a positive number of metres, such as 0.01",
        )
    check_anchors(anchors, transit)
    each_m = radii_of(anchors, radius).each_m
    edges = directed_edges(transit.polygons)
    if len(edges) == 0 or len(anchors) == 0:
        return {level: shapely.MultiPolygon() for level in (1, 2, 3)}
    x, y, radii, weights = disc_arrays(anchors.x_m, anchors.y_m, each_m, None)
    with announced():
        grid, discs = grids(x, y, radii, weights, edges)
        rows = np.concatenate([rows.copy() for rows in level_boundaries(discs, grid)])
        lines = _Lines(rows, discs.discs, chord_tolerance_m)
        origin = np.array([grid.x0_m, grid.y0_m])
        return {level: lines.polygons(level, origin) for level in (1, 2, 3)}


class _Lines:
    """Level boundaries as polylines between nodes, with the levels on their two sides."""

    def __init__(self, rows: Floats, discs: Floats, tolerance_m: float) -> None:
        rows = rows[(rows[:, 0] != rows[:, 2]) | (rows[:, 1] != rows[:, 3])]
        sides = np.minimum(np.round(rows[:, [6, 5]]), 3).astype(np.int64)
        owner = rows[:, 7].astype(np.int64)
        start, end = node_numbers(rows[:, 0:2], rows[:, 2:4], sides)
        real = start != end
        rows, sides, owner, start, end = (a[real] for a in (rows, sides, owner, start, end))
        self.nodes = int(max(start.max(initial=-1), end.max(initial=-1))) + 1
        heads, following = join_runs(start, end, owner, sides, self.nodes)
        # Round-off may leave a node with several bits of its own: all take the first one's.
        at = np.zeros((self.nodes, 2))
        at[end[::-1]] = rows[::-1, 2:4]
        at[start[::-1]] = rows[::-1, 0:2]
        angles = _arc_angles(rows)
        last, angle = _totals(heads, following, angles)
        self.start, self.end, self.sides = start[heads], end[last], sides[heads]
        self.points, self.first = chords(
            at[self.start], at[self.end], discs, owner[heads], angle, tolerance_m
        )

    def polygons(self, level: int, origin: Floats) -> shapely.MultiPolygon:
        """Return the polygons of one level."""
        left, right = (np.flatnonzero(self.sides[:, side] == level) for side in (0, 1))
        if left.size + right.size == 0:
            return shapely.MultiPolygon()
        line = np.concatenate([left, right])
        backwards = np.arange(line.size) >= left.size
        tail = np.where(backwards, self.end[line], self.start[line])
        head = np.where(backwards, self.start[line], self.end[line])
        begins, ends = self._directions()
        out_angle = np.where(backwards, ends[line], begins[line])
        in_angle = np.where(backwards, begins[line], ends[line])
        order, ring_first = follow(tail, head, out_angle, in_angle, self.nodes)
        points, ring = _ring_points(order, ring_first, line, backwards, self.points, self.first)
        return _assembled(points + origin, ring)

    def _directions(self) -> tuple[Floats, Floats]:
        """Return the angles in which each line leaves its start and its end."""
        first, last = self.first[:-1], self.first[1:] - 1
        begin = self.points[first + 1] - self.points[first]
        end = self.points[last - 1] - self.points[last]
        return np.arctan2(begin[:, 1], begin[:, 0]), np.arctan2(end[:, 1], end[:, 0])


def _arc_angles(rows: Floats) -> Floats:
    """Return the angle of each arc in radians, 0 for an edge; an arc is less than a quarter."""
    chord = np.hypot(rows[:, 2] - rows[:, 0], rows[:, 3] - rows[:, 1])
    radius = np.where(rows[:, 4] > 0, rows[:, 4], np.inf)
    angles: Floats = 2 * np.arcsin(np.minimum(0.5 * chord / radius, 1.0))
    return angles


@compiled
def _totals(heads, following, angles):
    """Return the last boundary of each run and the sum of its angles."""
    last, total = np.empty(heads.size, np.int64), np.zeros(heads.size)
    for h in range(heads.size):
        i = heads[h]
        while i >= 0:
            last[h] = i
            total[h] += angles[i]
            i = following[i]
    return last, total


@compiled
def _ring_points(order, ring_first, line, backwards, points, first):
    """Return the vertices of all rings, each closed, and the ring of each vertex."""
    total = ring_first.size - 1
    for i in order:
        total += first[line[i] + 1] - first[line[i]] - 1
    out, ring, n = np.empty((total, 2)), np.empty(total, np.int64), 0
    for r in range(ring_first.size - 1):
        begin = n
        for o in range(ring_first[r], ring_first[r + 1]):
            a, b = first[line[order[o]]], first[line[order[o]] + 1] - 1
            for v in range(b - a):
                out[n] = points[b - v] if backwards[order[o]] else points[a + v]
                ring[n] = r
                n += 1
        out[n], ring[n] = out[begin], r
        n += 1
    return out, ring


def _assembled(points: Floats, ring: Integers) -> shapely.MultiPolygon:
    """Return polygons from rings: counter-clockwise ones are shells, the others their holes."""
    sizes = np.bincount(ring)
    enough = sizes >= 4
    kept = enough[ring]
    points, ring = points[kept], (np.cumsum(enough) - 1)[ring[kept]]
    rings: Objects = np.asarray(shapely.linearrings(points, indices=ring), dtype=object)
    filled: Objects = np.asarray(shapely.polygons(rings), dtype=object)
    is_shell, area = shapely.is_ccw(rings), np.asarray(shapely.area(filled))
    shells, holes = np.flatnonzero(is_shell & (area > 0)), np.flatnonzero(~is_shell & (area > 0))
    owner = _shell_of(filled, area, shells, holes)
    placed = owner >= 0
    by_shell = np.argsort(owner[placed], kind="stable")
    inner = rings[holes[placed][by_shell]]
    counts = np.bincount(owner[placed], minlength=shells.size)
    groups = np.split(inner, np.cumsum(counts)[:-1])
    return _valid(
        [
            shapely.Polygon(rings[shell], list(group)) if len(group) else filled[shell]
            for shell, group in zip(shells, groups, strict=True)
        ]
    )


def _shell_of(filled: Objects, area: Floats, shells: Integers, holes: Integers) -> Integers:
    """Return for each hole the place of the smallest shell around it, or -1."""
    owner = np.full(holes.size, -1, dtype=np.int64)
    if holes.size == 0 or shells.size == 0:
        return owner
    inner = shapely.point_on_surface(filled[holes])
    hole, shell = shapely.STRtree(filled[shells]).query(inner, predicate="within")
    larger = area[shells][shell] > area[holes][hole]
    hole, shell = hole[larger], shell[larger]
    order = np.argsort(-area[shells][shell], kind="stable")
    owner[hole[order]] = shell[order]
    return owner


def _valid(parts: list[shapely.Polygon]) -> shapely.MultiPolygon:
    """Return polygons as one valid MultiPolygon; chords that cross in a sliver are repaired."""
    whole = shapely.MultiPolygon(parts)
    if whole.is_valid:
        return whole
    repaired = shapely.make_valid(whole, method="structure", keep_collapsed=False)
    pieces = shapely.get_parts(repaired)
    return shapely.MultiPolygon([p for p in pieces if p.geom_type == "Polygon"])

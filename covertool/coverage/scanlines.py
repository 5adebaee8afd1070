# mypy: disable-error-code="no-untyped-def, no-untyped-call"
"""Depths along horizontal lines: how much of the transit area hears exactly n anchors, for every n.

Each line crosses discs and transit area in intervals whose ends are known exactly; a sweep over the
sorted ends gives the length at every depth, without a cap. Lines lie in rows, a few to a row, and
each row's lengths are weighted by the exact transit area of that row, so that only the way in which
depth changes between neighbouring lines is sampled and not the transit area itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from covertool.coverage.compiled import announced, compiled
from covertool.coverage.edges import directed_edges
from covertool.model import Floats

LINES_PER_ROW = 3
"""Odd, so that one line runs through the centres of a row of pixels."""

_ROWS_AT_ONCE = 64


@dataclass(frozen=True)
class DepthProfile:
    """The transit area by the number of anchors that hear it.

    Attributes
    ----------
    fractions : (D,) share of the transit area heard by exactly 0, 1, ... D-1 anchors
    replicates : (S, D) the same from each of the S interleaved sets of lines alone
    """

    fractions: Floats
    replicates: Floats

    def expect(self, weights: Floats) -> tuple[Floats, Floats]:
        """Return ``fractions @ weights`` and its standard error from the choice of the lines.

        The S sets of lines are systematic samples of the same area; the spread of their answers
        over ``sqrt(S)`` is a cautious error of their mean.

        Parameters
        ----------
        weights : (D, K) array

        Examples
        --------
        >>> profile = DepthProfile(np.array([0.5, 0.5]), np.array([[0.4, 0.6], [0.6, 0.4]]))
        >>> [value.tolist() for value in profile.expect(np.array([[0.0], [1.0]]))]
        [[0.5], [0.09999999999999998]]
        """
        each = self.replicates @ weights
        error = each.std(axis=0, ddof=1) / np.sqrt(len(each))
        return self.fractions @ weights, error

    def levels(self) -> tuple[Floats, Floats]:
        """Return the fractions of Levels 0, 1, 2 and 3 (three or more), and their errors."""
        depths = np.arange(len(self.fractions))
        weights = np.zeros((depths.size, 4))
        weights[depths, np.minimum(depths, 3)] = 1.0
        return self.expect(weights)


def depth_profile(
    x_m: Floats, y_m: Floats, radius_m: Floats, polygons: shapely.MultiPolygon, row_m: float = 0.5
) -> DepthProfile:
    """Return the shares of the transit area that hear exactly 0, 1, 2, ... anchors.

    Parameters
    ----------
    x_m, y_m, radius_m : (N,) discs in metres
    polygons : valid, disjoint and not empty, in the same CRS
    row_m : height of a row of ``LINES_PER_ROW`` lines in metres

    Examples
    --------
    >>> two, square = np.array([5.0, 5.0]), shapely.MultiPolygon([shapely.box(0, 0, 10, 10)])
    >>> depth_profile(two, two, np.array([1.0, 2.0]), square, 0.05).fractions.round(3).tolist()
    [0.874, 0.094, 0.031]
    """
    left, low, _, high = polygons.bounds
    x, y = x_m - left, high - y_m
    edges = downward_edges(polygons, left, high)
    rows = max(int(np.ceil((high - low) / row_m)), 1)
    sums = np.zeros((LINES_PER_ROW, 1))
    for first in range(0, rows, _ROWS_AT_ONCE):
        count = min(_ROWS_AT_ONCE, rows - first)
        near = within_rows(y, radius_m, first * row_m, (first + count) * row_m)
        with announced():
            part = _depths_of_rows(
                x[near], y[near], radius_m[near], edges, first, count, row_m, LINES_PER_ROW
            )
        deeper = max(sums.shape[1], part.shape[1])
        sums = _widened(sums, deeper) + _widened(part, deeper)
    deepest = int(np.flatnonzero(sums.any(axis=0)).max(initial=0)) + 1
    sums = sums[:, :deepest]
    return DepthProfile(
        sums.sum(axis=0) / sums.sum(), sums / np.maximum(sums.sum(axis=1, keepdims=True), 1e-300)
    )


def within_rows(y: Floats, radius_m: Floats, top: float, bottom: float) -> npt.NDArray[np.intp]:
    """Return the indices of the discs that reach a band of rows (y grows downwards here)."""
    return np.flatnonzero((y + radius_m > top) & (y - radius_m < bottom))


def downward_edges(polygons: shapely.MultiPolygon, left: float, top: float) -> Floats:
    """Return (E, 4) directed edges x0, y0, x1, y1 from a corner at the upper left, y downwards."""
    x0, y0, x1, y1 = directed_edges(polygons).T
    return np.ascontiguousarray(np.column_stack([x0 - left, top - y0, x1 - left, top - y1]))


def _widened(sums: Floats, columns: int) -> Floats:
    return np.pad(sums, ((0, 0), (0, columns - sums.shape[1])))


@compiled
def _depths_of_rows(x, y, radius, edges, first, rows, row_m, per_row):
    """Return (per_row, depth) transit area by depth from the lines of some rows."""
    lines = rows * per_row
    top = first * row_m
    step = row_m / per_row
    spans, span_at = crossings(edges, top, step, lines)
    starts, ends, disc_at = _chords(x, y, radius, top, step, lines)
    areas = _row_areas(edges, first, rows, row_m)
    deepest = 0
    for line in range(lines):
        deepest = max(deepest, disc_at[line + 1] - disc_at[line])
    sums = np.zeros((per_row, deepest + 1))
    row_sums = np.zeros((per_row, deepest + 1))
    scratch, buckets = np.empty(deepest), np.empty(deepest + 2, dtype=np.int64)
    for row in range(rows):
        row_sums[:] = 0.0
        for k in range(per_row):
            line = row * per_row + k
            a, b = disc_at[line], disc_at[line + 1]
            on_line = spans[span_at[line] : span_at[line + 1]]
            if on_line.size == 0:
                continue
            bucket_sort(starts[a:b], scratch, buckets)
            bucket_sort(ends[a:b], scratch, buckets)
            _sweep(on_line, starts[a:b], ends[a:b], row_sums[k])
        seen = row_sums.sum()
        if seen > 0:
            sums += row_sums * (areas[row] / seen)
    return sums


@compiled
def crossings(edges, top, step, lines):
    """Return where lines cross the edges, sorted along each line, and the offset of each line.

    Line ``i`` runs at ``top + (i + 0.5) * step``; an edge holds its upper end and not its lower.
    """
    offsets = np.zeros(lines + 1, dtype=np.int64)
    for turn in range(2):
        if turn == 1:
            for line in range(lines):
                offsets[line + 1] += offsets[line]
            xs = np.empty(offsets[lines])
            cursor = offsets[:-1].copy()
        for e in range(len(edges)):
            x0, y0, x1, y1 = edges[e]
            if y0 > y1:
                x0, y0, x1, y1 = x1, y1, x0, y0
            a = max(int(np.ceil((y0 - top) / step - 0.5)), 0)
            b = min(int(np.ceil((y1 - top) / step - 0.5)), lines)
            for line in range(a, b):
                if turn == 0:
                    offsets[line + 1] += 1
                else:
                    share = (top + (line + 0.5) * step - y0) / (y1 - y0)
                    xs[cursor[line]] = x0 + share * (x1 - x0)
                    cursor[line] += 1
    for line in range(lines):
        xs[offsets[line] : offsets[line + 1]].sort()
    return xs, offsets


@compiled
def _chords(x, y, radius, top, step, lines):
    """Return where each line enters and leaves discs, and the offset of each line."""
    offsets = np.zeros(lines + 1, dtype=np.int64)
    for turn in range(2):
        if turn == 1:
            for line in range(lines):
                offsets[line + 1] += offsets[line]
            starts, ends = np.empty(offsets[lines]), np.empty(offsets[lines])
            cursor = offsets[:-1].copy()
        for i in range(len(x)):
            a = max(int(np.ceil((y[i] - radius[i] - top) / step - 0.5)), 0)
            b = min(int(np.ceil((y[i] + radius[i] - top) / step - 0.5)), lines)
            for line in range(a, b):
                if turn == 0:
                    offsets[line + 1] += 1
                else:
                    off = top + (line + 0.5) * step - y[i]
                    half = np.sqrt(max(radius[i] * radius[i] - off * off, 0.0))
                    starts[cursor[line]] = x[i] - half
                    ends[cursor[line]] = x[i] + half
                    cursor[line] += 1
    return starts, ends, offsets


@compiled
def _row_areas(edges, first, rows, row_m):
    """Return the exact transit area of each row: the sum over edges of the integral of x dy."""
    areas = np.zeros(rows)
    for e in range(len(edges)):
        x0, y0, x1, y1 = edges[e]
        if y0 == y1:
            continue
        slope = (x1 - x0) / (y1 - y0)
        a = max(int(min(y0, y1) / row_m), first)
        b = min(int(max(y0, y1) / row_m) + 1, first + rows)
        for row in range(a, b):
            u = min(max(y0, row * row_m), (row + 1) * row_m)
            v = min(max(y1, row * row_m), (row + 1) * row_m)
            areas[row - first] -= (x0 + slope * (0.5 * (u + v) - y0)) * (v - u)
    return areas


@compiled
def bucket_sort(values, scratch, buckets):
    """Sort values in place in time that grows with their number: one bucket for each value."""
    count = values.size
    if count < 2:
        return
    low, high = values.min(), values.max()
    scale = (count - 1) / (high - low) if high > low else 0.0
    buckets[: count + 1] = 0
    for i in range(count):
        buckets[int((values[i] - low) * scale) + 1] += 1
    for i in range(count):
        buckets[i + 1] += buckets[i]
    for i in range(count):
        bucket = int((values[i] - low) * scale)
        scratch[buckets[bucket]] = values[i]
        buckets[bucket] += 1
    for i in range(count):
        value, j = scratch[i], i
        while j > 0 and values[j - 1] > value:
            values[j] = values[j - 1]
            j -= 1
        values[j] = value


@compiled
def _sweep(spans, starts, ends, sums):
    """Add the lengths of the spans by depth; spans, starts and ends are sorted."""
    i, j, count = 0, 0, starts.size
    for s in range(0, spans.size - 1, 2):
        here, stop = spans[s], spans[s + 1]
        while i < count and starts[i] <= here:
            i += 1
        while j < count and ends[j] <= here:
            j += 1
        while here < stop:
            there = stop
            if i < count:
                there = min(there, starts[i])
            if j < count:
                there = min(there, ends[j])
            sums[i - j] += there - here
            here = there
            while i < count and starts[i] <= here:
                i += 1
            while j < count and ends[j] <= here:
                j += 1

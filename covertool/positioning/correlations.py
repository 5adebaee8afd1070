"""What the errors of each two cars have in common, with the runs side by side.

A covariance of two cars is kept once, as the block of the pair of their seats: four numbers (xx,
xy, yx, yy; the lower seat first) for each of ``LANES`` runs. Cars that never met, not even through
others, are not linked, and cost nothing; cars that have nearly nothing in common any more are
parted again.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from covertool.model import Floats
from covertool.positioning.kernel import kernel
from covertool.positioning.noise import Indices

LANES = 8
"""Runs whose correlations move side by side."""

FORGOTTEN = 1e-3
"""A correlation below this, along whatever axes, counts as none."""

_XX, _XY, _YX, _YY = 0, LANES, 2 * LANES, 3 * LANES

Links = npt.NDArray[np.uint8]


class Correlations:
    """Seats for the cars on the road, and a block for each pair of seats.

    ``block`` is (groups of runs, pairs, 4 * LANES) in square metres and ``linked`` (groups, pairs):
    the pair of seats ``low < high`` is row ``high (high - 1) / 2 + low``.
    """

    def __init__(self, groups: int) -> None:
        self.groups = groups
        self.block = np.zeros((groups, 0, 4 * LANES))
        self.linked = np.zeros((groups, 0), np.uint8)
        self._seat = np.full(0, -1, np.int64)

    def seat(self, car: Indices, fresh: npt.NDArray[np.bool_]) -> Indices:
        """Return the seat of each car; ``fresh`` ones have nothing in common with anyone."""
        missing = max(int(car.max(initial=-1)) + 1 - self._seat.size, 0)
        self._seat = np.concatenate([self._seat, np.full(missing, -1, np.int64)])
        gone = np.ones(self._seat.size, bool)
        gone[car] = False
        self._seat[gone] = -1
        new = self._seat[car] < 0
        taken = self._seat[self._seat >= 0]
        free = np.setdiff1d(np.arange(car.size + taken.size), taken)
        self._seat[car[new]] = free[: int(new.sum())]
        seats = self._seat[car]
        self._widen(int(seats.max(initial=0)) + 1)
        for block, linked in zip(self.block, self.linked, strict=True):
            _forget(block, linked, seats[new | fresh])
        return seats

    def _widen(self, seats: int) -> None:
        more = seats * (seats - 1) // 2 - self.linked.shape[1]
        if more > 0:
            blocks = np.zeros((self.groups, more, 4 * LANES))
            self.block = np.concatenate([self.block, blocks], axis=1)
            links = np.zeros((self.groups, more), np.uint8)
            self.linked = np.concatenate([self.linked, links], axis=1)


@kernel
def pair_of(one: int, other: int) -> int:
    """Return the row of a pair of seats."""
    low, high = min(one, other), max(one, other)
    return high * (high - 1) // 2 + low


@kernel
def _forget(block: Floats, linked: Links, seats: Indices) -> None:
    for seat in seats:
        other = 0
        while other == seat or pair_of(seat, other) < linked.size:
            if other != seat and linked[pair_of(seat, other)]:
                linked[pair_of(seat, other)] = 0
                block[pair_of(seat, other)] = 0.0
            other += 1


@kernel
def pass_on(block: Floats, linked: Links, seat: Indices, a: Floats, least_m2: Floats) -> None:
    """Let the correlations of one group go by ``C_ij -> A_i C_ij A_j'``, and part who may part.

    ``a`` is (cars, 4 * LANES), and ``least_m2`` (cars, LANES): no variance of a car is less.
    """
    for j in range(seat.size):
        for i in range(j):
            pair = pair_of(seat[i], seat[j])
            if linked[pair]:
                low, high = (i, j) if seat[i] < seat[j] else (j, i)
                c = block[pair]
                _between(c, a[low], a[high])
                linked[pair] = _part(c, least_m2[low], least_m2[high])


@kernel
def _between(c: Floats, left: Floats, right: Floats) -> None:
    for r in range(c.size // 4):
        lxx, lxy, lyx, lyy = left[_XX + r], left[_XY + r], left[_YX + r], left[_YY + r]
        rxx, rxy, ryx, ryy = right[_XX + r], right[_XY + r], right[_YX + r], right[_YY + r]
        xx = lxx * c[_XX + r] + lxy * c[_YX + r]
        xy = lxx * c[_XY + r] + lxy * c[_YY + r]
        yx = lyx * c[_XX + r] + lyy * c[_YX + r]
        yy = lyx * c[_XY + r] + lyy * c[_YY + r]
        c[_XX + r], c[_XY + r] = xx * rxx + xy * rxy, xx * ryx + xy * ryy
        c[_YX + r], c[_YY + r] = yx * rxx + yy * rxy, yx * ryx + yy * ryy


@kernel
def _part(c: Floats, one_m2: Floats, other_m2: Floats) -> int:
    """Clear the runs in which two cars have nearly nothing in common; 0 when that is all."""
    linked = 0
    for r in range(one_m2.size):
        most = max(abs(c[_XX + r]), abs(c[_XY + r]), abs(c[_YX + r]), abs(c[_YY + r]))
        if most * most > FORGOTTEN * FORGOTTEN * one_m2[r] * other_m2[r]:
            linked = 1
        else:
            c[_XX + r] = c[_XY + r] = c[_YX + r] = c[_YY + r] = 0.0
    return linked


@kernel
def look_on(
    block: Floats, linked: Links, seat: Indices, i: int, j: int, root: Floats, gain: Floats
) -> None:
    """Let the correlations of cars i and j with the others follow a range between the two.

    With ``z_k = cov(x_i - x_j, x_k)``, both first times ``root`` (LANES,): ``C_ik -= G_i z_k``
    and ``C_jk -= G_j z_k`` for ``gain`` (2, 4 * LANES), which are G_i and G_j. Nobody else learns.
    """
    for k in range(seat.size):
        if k in (i, j):
            continue
        one, two = pair_of(seat[i], seat[k]), pair_of(seat[j], seat[k])
        if not (linked[one] or linked[two]):
            continue
        linked[one] = linked[two] = 1
        c, d = block[one], block[two]
        if seat[k] < seat[i]:
            if seat[k] < seat[j]:
                _follow(c, d, root, gain, _YX, _XY, _YX, _XY)
            else:
                _follow(c, d, root, gain, _YX, _XY, _XY, _YX)
        elif seat[k] < seat[j]:
            _follow(c, d, root, gain, _XY, _YX, _YX, _XY)
        else:
            _follow(c, d, root, gain, _XY, _YX, _XY, _YX)


@kernel
def _follow(
    c: Floats, d: Floats, root: Floats, gain: Floats, cxy: int, cyx: int, dxy: int, dyx: int
) -> None:
    """Correct the blocks c and d of two cars with a third; where it sits lower, xy is yx."""
    g, h = gain[0], gain[1]
    for r in range(root.size):
        c_xx, c_xy = root[r] * c[_XX + r], root[r] * c[cxy + r]
        c_yx, c_yy = root[r] * c[cyx + r], root[r] * c[_YY + r]
        d_xx, d_xy = root[r] * d[_XX + r], root[r] * d[dxy + r]
        d_yx, d_yy = root[r] * d[dyx + r], root[r] * d[_YY + r]
        xx, xy, yx, yy = c_xx - d_xx, c_xy - d_xy, c_yx - d_yx, c_yy - d_yy
        c[_XX + r] = c_xx - (g[_XX + r] * xx + g[_XY + r] * yx)
        c[cxy + r] = c_xy - (g[_XX + r] * xy + g[_XY + r] * yy)
        c[cyx + r] = c_yx - (g[_YX + r] * xx + g[_YY + r] * yx)
        c[_YY + r] = c_yy - (g[_YX + r] * xy + g[_YY + r] * yy)
        d[_XX + r] = d_xx - (h[_XX + r] * xx + h[_XY + r] * yx)
        d[dxy + r] = d_xy - (h[_XX + r] * xy + h[_XY + r] * yy)
        d[dyx + r] = d_yx - (h[_YX + r] * xx + h[_YY + r] * yx)
        d[_YY + r] = d_yy - (h[_YX + r] * xy + h[_YY + r] * yy)

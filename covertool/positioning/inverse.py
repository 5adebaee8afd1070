"""The inverse of a covariance of many cars: the same bits in every process, zeros left alone.

LAPACK's own bits depend on how many threads it uses, and it does not see that cars which never met
have nothing in common.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from covertool.model import Floats
from covertool.positioning.kernel import kernel

Mask = npt.NDArray[np.bool_]

_WIDTH = 8


@kernel
def _small_inverse(d: Floats) -> Floats:
    """Return the inverse of a small positive definite matrix (Gauss and Jordan)."""
    n = len(d)
    a, out = d.copy(), np.eye(n)
    for k in range(n):
        pivot = 1.0 / a[k, k]
        for c in range(n):
            a[k, c] *= pivot
            out[k, c] *= pivot
        for i in range(n):
            factor = a[i, k]
            if i != k and factor != 0.0:
                for c in range(n):
                    a[i, c] -= factor * a[k, c]
                    out[i, c] -= factor * out[k, c]
    return out


@kernel
def _less(row: Floats, f: Floats, i: int, panel: Floats) -> None:
    """Take ``f[:, i] @ panel`` from the row, in one pass over it."""
    f0, f1, f2, f3 = f[0, i], f[1, i], f[2, i], f[3, i]
    f4, f5, f6, f7 = f[4, i], f[5, i], f[6, i], f[7, i]
    p0, p1, p2, p3 = panel[0], panel[1], panel[2], panel[3]
    p4, p5, p6, p7 = panel[4], panel[5], panel[6], panel[7]
    for q in range(row.size):
        first = (f0 * p0[q] + f1 * p1[q]) + (f2 * p2[q] + f3 * p3[q])
        second = (f4 * p4[q] + f5 * p5[q]) + (f6 * p6[q] + f7 * p7[q])
        row[q] -= first + second


@kernel
def _factors(panel: Floats, d: Floats, f: Floats) -> Mask:
    """Write ``D A_KR`` to f, and return which columns of the panel are not zero."""
    touched = np.zeros(panel.shape[1], np.bool_)
    f[:] = 0.0
    for c in range(len(d)):
        own, row = panel[c], f[c]
        for i in range(touched.size):
            touched[i] |= own[i] != 0.0
        for e in range(len(d)):
            factor, other = d[e, c], panel[e]
            for i in range(row.size):
                row[i] += factor * other[i]
    return touched


@kernel
def inverse(matrix: Floats) -> Floats:
    """Return the inverse of a symmetric positive definite matrix, of which it reads the lower half.

    The sweep operator (Beaton 1964), eight columns K at a time: with ``D = A_KK^-1``,
    ``A_RR -= A_RK D A_KR``, ``A_RK -> A_RK D`` and ``A_KK -> -D`` end in ``-A^-1``. Rows that have
    nothing in common with the columns are passed by: the cost is that of the clusters of cars.

    >>> inverse(np.array([[2.0, 0.0, 1.0], [0.0, 4.0, 0.0], [1.0, 0.0, 1.0]])).tolist()
    [[1.0, 0.0, -1.0], [0.0, 0.25, 0.0], [-1.0, 0.0, 2.0]]
    """
    n = len(matrix)
    a, out = matrix.copy(), np.empty((n, n))
    panel, f = np.empty((_WIDTH, n)), np.empty((_WIDTH, n))
    for start in range(0, n, _WIDTH):
        end = min(start + _WIDTH, n)
        panel[:] = 0.0
        for k in range(start, end):
            panel[k - start, : k + 1] = a[k, : k + 1]
            for q in range(k + 1, n):
                panel[k - start, q] = a[q, k]
        d = _small_inverse(panel[: end - start, start:end])
        touched = _factors(panel, d, f)
        for i in range(n):
            if touched[i] and not start <= i < end:
                _less(a[i, : i + 1], f, i, panel)
        for k in range(start, end):
            a[k, :start] = f[k - start, :start]
            a[k, start : k + 1] = -d[k - start, : k + 1 - start]
            for i in range(end, n):
                a[i, k] = f[k - start, i]
    for i in range(n):
        for k in range(i + 1):
            out[i, k] = out[k, i] = 0.0 - a[i, k]
    return out

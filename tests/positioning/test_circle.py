"""What a range leaves of a covariance, against LAPACK and against a sum over a plain grid."""

import numpy as np
import pytest

from covertool.positioning.circle import moments, shrink


def matrix(spread):
    return np.array([[spread[0], spread[1]], [spread[1], spread[2]]])


@pytest.mark.parametrize("most", [0.6, 3.0])
def test_what_stays_of_a_covariance_is_kept_between_nothing_and_all(most):
    rng = np.random.default_rng(0)
    for _ in range(300):
        root = np.linalg.cholesky(np.cov(rng.normal(size=(2, 4))) + 1e-3 * np.eye(2))
        share = rng.uniform(0, most, 2)
        turn = np.linalg.qr(rng.normal(size=(2, 2)))[0] @ np.diag(share**0.5)
        before, after = root @ root.T, root @ turn @ turn.T @ root.T
        w, inverse, widest = shrink(*(tuple(m[[0, 0, 1], [0, 1, 1]]) for m in (before, after)))
        values, vectors = np.linalg.eigh(turn @ turn.T)
        kept = root @ vectors @ np.diag(np.clip(values, 0, 1)) @ vectors.T @ root.T
        plain = np.linalg.inv(before)
        scale = np.abs(plain).max()
        expected = plain @ (before - kept) @ plain
        np.testing.assert_allclose(matrix(w), expected, atol=1e-8 * scale)
        np.testing.assert_allclose(matrix(inverse), plain, atol=1e-8 * scale)
        assert widest == pytest.approx(share.max())


@pytest.mark.parametrize("at", [(3.0, 1.0), (0.5, 0.2), (-2.0, 6.0)])
def test_a_sharp_range_to_a_near_neighbour_has_the_moments_of_a_sum_over_a_grid(at):
    """A prior of 4 m by 3 m and a range of 5 m: the posterior is a piece of a ring."""
    prior, r = np.array([[16.0, 2.0], [2.0, 9.0]]), 0.3**2
    axis = np.linspace(-9, 9, 1801)
    x, y = np.meshgrid(axis, axis)
    off = np.stack([x - at[0], y - at[1]], axis=-1)
    level = np.einsum("...i,ij,...j", off, np.linalg.inv(prior), off)
    weight = np.exp(-0.5 * level - 0.5 * (5.0 - np.hypot(x, y)) ** 2 / r)
    weight /= weight.sum()
    mean = np.array([(weight * x).sum(), (weight * y).sum()])
    spread = [
        (weight * (x - mean[0]) ** 2).sum(),
        (weight * (x - mean[0]) * (y - mean[1])).sum(),
        (weight * (y - mean[1]) ** 2).sum(),
    ]
    found = moments(*at, 16.0, 2.0, 9.0, 5.0, r)
    np.testing.assert_allclose(found[:2], mean, atol=0.03)
    np.testing.assert_allclose(found[2:], spread, rtol=0.02, atol=0.02)

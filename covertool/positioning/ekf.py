"""The extended Kalman filter of Parker and Valaee (2007), as the paper uses it."""

from __future__ import annotations

import math

import numpy as np

from covertool.model import Floats
from covertool.positioning.estimators import Measurements, State, isotropic
from covertool.positioning.kernel import kernel
from covertool.positioning.linear import carry_on
from covertool.positioning.noise import Indices

LEAST_VARIANCE_M2 = 1e-8
"""Below this a measured range counts as exact; it keeps the information finite."""


@kernel
def _update(
    position: Floats,
    covariance: Floats,
    count: Indices,
    ranges: Floats,
    variance: Floats,
    x: Floats,
    y: Floats,
    shared: Floats,
    literal: bool,
) -> tuple[Floats, Floats]:
    new, new_covariance = np.empty_like(position), np.empty_like(covariance)
    for i in range(count.size):
        px, py = position[i, 0], position[i, 1]
        pxx, pxy, pyy = covariance[i, 0], covariance[i, 1], covariance[i, 2]
        determinant = pxx * pyy - pxy * pxy
        ixx, ixy, iyy = pyy / determinant, -pxy / determinant, pxx / determinant
        gx = gy = 0.0
        for m in range(count[i]):
            dx, dy = px - x[i, m], py - y[i, m]
            d = max(math.sqrt(dx * dx + dy * dy), 1e-9)
            ux, uy = dx / d, dy / d
            r = variance[i, m]
            if not literal:
                r += ux * ux * shared[i, m, 0]
                r += 2.0 * ux * uy * shared[i, m, 1] + uy * uy * shared[i, m, 2]
            w = 1.0 / max(r, LEAST_VARIANCE_M2)
            ixx += w * ux * ux
            ixy += w * ux * uy
            iyy += w * uy * uy
            gx += w * ux * (ranges[i, m] - d)
            gy += w * uy * (ranges[i, m] - d)
        determinant = ixx * iyy - ixy * ixy
        pxx, pxy, pyy = iyy / determinant, -ixy / determinant, ixx / determinant
        new[i, 0], new[i, 1] = px + pxx * gx + pxy * gy, py + pxy * gx + pyy * gy
        new_covariance[i, 0], new_covariance[i, 1], new_covariance[i, 2] = pxx, pxy, pyy
    return new, new_covariance


class Ekf:
    """Position carried on by velocity and corrected by all ranges of a step at once.

    Prediction: ``x- = x + Ts v`` and ``P- = P + Ts^2 sigma_gamma^2 I + sigma_q^2 I``. Correction
    by ranges with Jacobian rows ``u'`` (unit vectors from the neighbours) and variances
    ``R_j = sigma_R^2 + u' P_j u``, written in its information form, which is the same filter.

    Parameters
    ----------
    sigma_q : float
        Process noise in metres.
    sigma_gamma : float
        Noise of the velocity in m/s.
    literal : bool
        Leave out ``u' P_j u``, as printed: the filter then trusts a neighbour's GPS fix as if it
        were exact.
    """

    name = "ekf"
    uses_gps = False
    gives_covariance = True

    def __init__(
        self, sigma_q: float = 2.0, sigma_gamma: float = 0.5, literal: bool = False
    ) -> None:
        self.sigma_q, self.sigma_gamma, self.literal = sigma_q, sigma_gamma, literal

    def start(self, gps: Floats, variance_m2: float) -> State:
        """Return the first GPS fix."""
        return State(gps.copy(), isotropic(len(gps), max(variance_m2, LEAST_VARIANCE_M2)))

    def predict(self, state: State, velocity: Floats, step_s: float) -> State:
        """Return the state carried on by the velocity."""
        added = (step_s * self.sigma_gamma) ** 2 + self.sigma_q**2
        return carry_on(state, velocity, step_s, added)

    def update(self, predicted: State, heard: Measurements) -> State:
        """Return the state corrected by the ranges; without any it stays the prediction."""
        return State(
            *_update(
                predicted.position,
                predicted.covariance,
                heard.count,
                heard.range_m,
                heard.range_variance_m2,
                heard.x,
                heard.y,
                heard.shared,
                self.literal,
            )
        )

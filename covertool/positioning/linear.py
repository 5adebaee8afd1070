"""The two arms that the paper lacks: GPS alone, and GPS with odometry in a Kalman filter."""

from __future__ import annotations

import numpy as np

from covertool.model import Floats
from covertool.positioning.estimators import Measurements, State, isotropic

DIFFUSE_M2 = 1e8
"""Variance of a place of which nothing is known."""


class GpsOnly:
    """Takes every GPS fix as it is."""

    name = "gps"
    uses_gps = True
    gives_covariance = True

    def start(self, gps: Floats, variance_m2: float) -> State:
        """Return the fix."""
        return State(gps.copy(), isotropic(len(gps), variance_m2))

    def predict(self, state: State, velocity: Floats, step_s: float) -> State:
        """Return the state as it is: the next fix replaces it."""
        return state

    def update(self, predicted: State, heard: Measurements) -> State:
        """Return the fix."""
        return self.start(heard.gps, heard.gps_variance_m2)


class GpsOdometry:
    """Kalman filter of a position carried on by measured velocity and corrected by GPS.

    Parameters
    ----------
    sigma_velocity : float
        Noise of the measured velocity per axis in m/s.
    """

    name = "gps_odometry"
    uses_gps = True
    gives_covariance = True

    def __init__(self, sigma_velocity: float = 0.5) -> None:
        self.sigma_velocity = sigma_velocity

    def start(self, gps: Floats, variance_m2: float) -> State:
        """Return a place of which nothing is known: the first update takes the fix."""
        return State(gps.copy(), isotropic(len(gps), DIFFUSE_M2))

    def predict(self, state: State, velocity: Floats, step_s: float) -> State:
        """Return the state carried on, with the variance that the odometry adds."""
        return carry_on(state, velocity, step_s, (self.sigma_velocity * step_s) ** 2)

    def update(self, predicted: State, heard: Measurements) -> State:
        """Return the prediction corrected by the fix."""
        return fuse_position(predicted, heard.gps, heard.gps_variance_m2)


def carry_on(state: State, velocity: Floats, step_s: float, added_m2: float) -> State:
    """Return dead reckoning: ``x + Ts v``, with a variance added along both axes."""
    covariance = state.covariance.copy()
    covariance[:, 0] += added_m2
    covariance[:, 2] += added_m2
    return State(state.position + step_s * velocity, covariance)


def fuse_position(state: State, position: Floats, variance_m2: float) -> State:
    """Return the state corrected by a measured position with the same variance on both axes."""
    xx, xy, yy = state.covariance.T
    r = max(variance_m2, 1e-12)
    determinant = (xx + r) * (yy + r) - xy * xy
    # K = P (P + r I)^-1, and P+ = (I - K) P = r K
    k_xx = (xx * (yy + r) - xy * xy) / determinant
    k_yy = (yy * (xx + r) - xy * xy) / determinant
    k_xy = r * xy / determinant
    dx, dy = (position - state.position).T
    moved = np.stack([k_xx * dx + k_xy * dy, k_xy * dx + k_yy * dy], axis=1)
    return State(state.position + moved, r * np.stack([k_xx, k_xy, k_yy], axis=1))

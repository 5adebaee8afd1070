"""What a car measures by itself: its GPS fix and its velocity."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from covertool.model import Floats
from covertool.positioning.kernel import kernel
from covertool.positioning.noise import GPS, VELOCITY, Indices, fill_normal_pairs


@kernel
def noise_of_runs(
    key: tuple[int, int], purpose: int, first_run: int, runs: int, time: int, car: Indices
) -> Floats:
    """Return (runs * cars, 2) standard normals of one step, the same for both arms."""
    n = car.size
    out = np.empty((runs * n, 2))
    zero = np.zeros(n, np.int64)
    first, second = np.empty(n), np.empty(n)
    for r in range(runs):
        fill_normal_pairs(key, purpose, first_run + r, time, car, zero, first, second)
        for i in range(n):
            out[r * n + i, 0], out[r * n + i, 1] = first[i], second[i]
    return out


class Sensors:
    """GPS and odometry of all cars in a block of runs.

    Parameters
    ----------
    key : (seed, scenario)
    first_run, runs : the block
    cars : cars in the whole trace
    gps_m, correlation : standard deviation of GPS per axis in metres, and the correlation of two
        steps' errors (Gauss-Markov; 0 for white)
    sigma_velocity : noise of the velocity per axis in m/s
    """

    def __init__(
        self,
        key: tuple[int, int],
        first_run: int,
        runs: int,
        cars: int,
        gps_m: float,
        correlation: float,
        sigma_velocity: float,
    ) -> None:
        self._address = (first_run, runs)
        self._key = key
        self._gps_m, self._correlation = gps_m, correlation
        self._sigma_velocity = sigma_velocity
        self._error = np.zeros((runs, cars if correlation > 0 else 0, 2))

    def _normals(self, purpose: int, time: int, car: Indices) -> Floats:
        return noise_of_runs(self._key, purpose, *self._address, time, car)

    def gps(self, time: int, car: Indices, truth: Floats, new: npt.NDArray[np.bool_]) -> Floats:
        """Return (runs * cars, 2) fixes; ``new`` marks cars whose error has no past."""
        normals = self._normals(GPS, time, car)
        runs = self._address[1]
        if self._correlation > 0:
            a = self._correlation
            fresh = normals.reshape(runs, car.size, 2)
            past = self._error[:, car]
            stay = a * past + math.sqrt(1 - a * a) * fresh
            error = np.where(new[None, :, None], fresh, stay)
            self._error[:, car] = error
            normals = error.reshape(-1, 2)
        return _around(truth, self._gps_m, normals)

    def velocity(self, time: int, car: Indices, truth: Floats) -> Floats:
        """Return (runs * cars, 2) measured velocities in m/s."""
        normals = self._normals(VELOCITY, time, car)
        return _around(truth, self._sigma_velocity, normals)


def _around(truth: Floats, sigma: float, normals: Floats) -> Floats:
    """Return the truth of each car with its noise in every run."""
    noisy: Floats = sigma * normals.reshape(-1, *truth.shape)
    noisy += truth
    return noisy.reshape(-1, 2)

"""Which places are taken: exactly as many cars as the paper counted, clustered as in a town."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter

from data.recipe.carparks import Bays
from data.recipe.parameters import CARS, Calibrated, stream

_PATCH_M = 18.0
_CELL_M = 10.0
_REACH_M = 2600.0


def parked_cars(lots: Bays, kerbs: Bays, drives: Bays, calibrated: Calibrated) -> Bays:
    """Return the taken places: CARS in all, in the calibrated shares of lot, kerb and driveway.

    A place is taken with a chance proportional to a log-normal weight of its street and of its
    patch of town: some streets and quarters are full, others nearly empty.
    """
    in_lots = round(calibrated.share_lot * CARS)
    at_kerbs = round(calibrated.share_kerb * CARS)
    rng = stream("parked cars")
    parts = [
        _choose(lots, in_lots, calibrated, rng),
        _choose(kerbs, at_kerbs, calibrated, rng),
        _choose(drives, CARS - in_lots - at_kerbs, calibrated, rng),
    ]
    return Bays(
        np.concatenate([part.x_m for part in parts]),
        np.concatenate([part.y_m for part in parts]),
        np.concatenate([part.heading_deg for part in parts]),
        sum((part.site for part in parts), ()),
        sum((part.group for part in parts), ()),
    )


def _choose(places: Bays, count: int, calibrated: Calibrated, rng: np.random.Generator) -> Bays:
    """Return ``count`` places drawn without replacement (Efraimidis and Spirakis 2006)."""
    groups = np.array(places.group)
    names, number = np.unique(groups, return_inverse=True)
    street = rng.normal(0.0, calibrated.clustering, len(names))[number]
    patch = calibrated.patch_clustering * _patches()(places.x_m, places.y_m)
    keys = np.log(_luck(len(places), calibrated.pairing, rng)) / np.exp(street + patch)
    rows = np.sort(np.argsort(-keys, kind="stable")[:count])
    return Bays(
        places.x_m[rows],
        places.y_m[rows],
        places.heading_deg[rows],
        tuple(places.site[row] for row in rows),
        tuple(places.group[row] for row in rows),
    )


def _luck(count: int, pairing: float, rng: np.random.Generator) -> np.ndarray:
    """Return a uniform number for each place; a share of neighbouring twos have the same."""
    own = rng.random(count)
    first = np.arange(count) // 2 * 2
    together = (rng.random(count) < pairing)[first]
    return np.where(together, own[first], own)


class _patches:  # noqa: N801 - reads as a function: patches()(x, y)
    """A smooth random field over the town, mean 0 and SD 1, a few dozen metres wide."""

    def __init__(self) -> None:
        cells = int(2 * _REACH_M / _CELL_M)
        rough = stream("patches").normal(size=(cells, cells))
        field = gaussian_filter(rough, _PATCH_M / _CELL_M)
        self.field = (field - field.mean()) / field.std()

    def __call__(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        col = np.clip(((x + _REACH_M) / _CELL_M).astype(int), 0, self.field.shape[1] - 1)
        row = np.clip(((y + _REACH_M) / _CELL_M).astype(int), 0, self.field.shape[0] - 1)
        return self.field[row, col]

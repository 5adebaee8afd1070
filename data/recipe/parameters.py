"""The numbers that the town is grown from; those marked calibrated were set by Table IV."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

TOWN = "Synthetic Maynooth-like town"
CRS_CODE = 2157
ORIGIN_M = (694_000.0, 737_500.0)
"""Where the drawing's (0, 0), the middle of Main Street, lies in EPSG:2157."""

SEED = 4541
CARS = 4541
"""Parked cars, the number that the paper counted in Maynooth."""

TABLE_IV_PERCENT = {
    15.0: (45.43, 14.81, 11.98, 27.78),
    100.0: (2.45, 0.31, 0.22, 97.02),
}
"""Levels 0, 1, 2, 3 of the paper's Table IV: the calibration target, in percent."""

WIDTHS_M = {
    "main": 8.6,
    "arterial": 7.6,
    "regional": 7.0,
    "collector": 6.4,
    "residential": 5.4,
    "close": 4.9,
    "service": 5.6,
    "aisle": 6.0,
}
"""Carriageway width of each class of street, kerb to kerb."""


@dataclass(frozen=True)
class Calibrated:
    """Global parameters that bring the coverage near Table IV; nothing local is adjusted.

    Attributes
    ----------
    town_scale : stretch of the built-up boundary about the middle of the town
    outskirts_m : how far the through roads run on beyond the built edge
    share_lot : share of the cars that stand in car parks
    share_kerb : share of the cars that stand along kerbs and in kerbside bays
    clustering : how unevenly streets fill: SD of a street's log weight
    patch_clustering : the same for patches of the town, a few dozen metres wide
    pairing : share of neighbouring places that are taken or free together
    """

    town_scale: float = 1.15
    outskirts_m: float = 60.0
    share_lot: float = 0.36
    share_kerb: float = 0.2
    clustering: float = 0.1
    patch_clustering: float = 0.85
    pairing: float = 0.85


def stream(stage: str) -> np.random.Generator:
    """Return the random stream of one stage, so that stages do not disturb each other."""
    return np.random.default_rng([SEED, *stage.encode()])

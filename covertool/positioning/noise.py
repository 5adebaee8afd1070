"""Chance with an address: any number can be drawn again, in any order, by any worker.

Philox4x32-10 (Salmon, Moraes, Dror and Shaw 2011, "Parallel random numbers: as easy as 1, 2, 3")
turns a counter and a key into four 32-bit words. The key is (seed, scenario); the counter is
(time, car, neighbour, run and purpose). Both arms of an experiment thus see the same noise.
"""

from __future__ import annotations

import math

import numpy as np

from covertool.errors import OptionError
from covertool.positioning.kernel import kernel

GPS, VELOCITY, RANGE_TO_CAR, RANGE_TO_ANCHOR, SWARM, ANCHOR, NLOS_CAR, NLOS_ANCHOR = range(8)
"""What a number is drawn for: the last byte of the counter."""

MAX_RUNS = 1 << 24

_LOW = np.uint64(0xFFFFFFFF)
_32 = np.uint64(32)
_MULTIPLIER_0, _MULTIPLIER_1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_WEYL_0, _WEYL_1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
_UNIT_32 = 2.0**-32
_TWO_PI = 2.0 * math.pi


def check_address(seed: int, runs: int) -> None:
    """Raise OptionError unless the seed fits 32 bits and the runs 24."""
    if not 0 <= seed < 2**32:
        raise OptionError("the seed is out of range", f"seed={seed}", "use 0 to 4294967295")
    if not 1 <= runs <= MAX_RUNS:
        raise OptionError("the number of runs is out of range", f"runs={runs}", "use 1 or more")


@kernel
def philox(
    c0: int, c1: int, c2: int, c3: int, k0: int, k1: int
) -> tuple[np.uint64, np.uint64, np.uint64, np.uint64]:
    """Return the four 32-bit words of Philox4x32-10 for a counter and a key of 32-bit words.

    >>> [f"{word:08x}" for word in philox(0, 0, 0, 0, 0, 0)]
    ['6627e8d5', 'e169c58d', 'bc57ac4c', '9b00dbd8']
    """
    a, b, c, d = np.uint64(c0), np.uint64(c1), np.uint64(c2), np.uint64(c3)
    key_0, key_1 = np.uint64(k0), np.uint64(k1)
    for _ in range(10):
        p = _MULTIPLIER_0 * a
        q = _MULTIPLIER_1 * c
        a, b, c, d = (q >> _32) ^ b ^ key_0, q & _LOW, (p >> _32) ^ d ^ key_1, p & _LOW
        key_0 = (key_0 + _WEYL_0) & _LOW
        key_1 = (key_1 + _WEYL_1) & _LOW
    return a, b, c, d


@kernel
def words(
    key: tuple[int, int], purpose: int, run: int, time: int, car: int, neighbour: int
) -> tuple[np.uint64, np.uint64, np.uint64, np.uint64]:
    """Return the four words at an address."""
    return philox(time, car, neighbour, (run << 8) | purpose, key[0], key[1])


@kernel
def unit(word: np.uint64) -> float:
    """Return a 32-bit word as a number in the open interval (0, 1)."""
    return (np.float64(word) + 0.5) * _UNIT_32


@kernel
def normal_pair(
    key: tuple[int, int], purpose: int, run: int, time: int, car: int, neighbour: int
) -> tuple[float, float]:
    """Return two independent standard normals at an address, by Box and Muller (1958)."""
    a, b, _, _ = words(key, purpose, run, time, car, neighbour)
    size = math.sqrt(-2.0 * math.log(unit(a)))
    angle = _TWO_PI * unit(b)
    return size * math.cos(angle), size * math.sin(angle)


@kernel
def normal(
    key: tuple[int, int], purpose: int, run: int, time: int, car: int, neighbour: int
) -> float:
    """Return one standard normal at an address: the first of its pair."""
    a, b, _, _ = words(key, purpose, run, time, car, neighbour)
    return math.sqrt(-2.0 * math.log(unit(a))) * math.cos(_TWO_PI * unit(b))

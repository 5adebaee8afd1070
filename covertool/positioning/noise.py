"""Chance with an address: any number can be drawn again, in any order, by any worker.

Philox4x32-10 (Salmon, Moraes, Dror and Shaw 2011, "Parallel random numbers: as easy as 1, 2, 3")
turns a counter and a key into four 32-bit words. The key is (seed, scenario); the counter is
(time, car, neighbour, run and purpose). Both arms of an experiment thus see the same noise.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from covertool.errors import OptionError
from covertool.model import Floats
from covertool.positioning.kernel import kernel

GPS, VELOCITY, RANGE, SWARM, ANCHOR, NLOS = range(6)
"""What a number is drawn for: the last byte of the counter."""

ANCHOR_BIT = 1 << 31
"""Marks a neighbour's address as an anchor's number, not a car's."""

Indices = npt.NDArray[np.int64]
Words = npt.NDArray[np.uint32]
MAX_RUNS = 1 << 24

_32 = np.uint64(32)
_MULTIPLIER_0, _MULTIPLIER_1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_WEYL_0, _WEYL_1 = np.uint32(0x9E3779B9), np.uint32(0xBB67AE85)
_BLOCK = 64
_UNIT_32 = 2.0**-32
_LOG_2 = math.log(2.0)
_SQRT_2 = math.sqrt(2.0)
_MANTISSA, _EXPONENT_ONE = np.int64((1 << 52) - 1), np.int64(1023 << 52)
_SINE = tuple((-1.0) ** k / math.factorial(2 * k + 1) for k in range(11))
_COSINE = tuple((-1.0) ** k / math.factorial(2 * k) for k in range(12))
_ATANH = tuple(2.0 / (2 * k + 1) for k in range(12))
_S0, _S1, _S2, _S3, _S4, _S5, _S6, _S7, _S8, _S9, _S10 = _SINE
_C0, _C1, _C2, _C3, _C4, _C5, _C6, _C7, _C8, _C9, _C10, _C11 = _COSINE
_L0, _L1, _L2, _L3, _L4, _L5, _L6, _L7, _L8, _L9, _L10, _L11 = _ATANH


def check_address(seed: int, runs: int) -> None:
    """Raise OptionError unless the seed fits 32 bits and the runs 24."""
    if not 0 <= seed < 2**32:
        raise OptionError("the seed is out of range", f"seed={seed}", "use 0 to 4294967295")
    if not 1 <= runs <= MAX_RUNS:
        raise OptionError("the number of runs is out of range", f"runs={runs}", "use 1 or more")


@kernel
def philox(a: Words, b: Words, c: Words, d: Words, key: tuple[int, int]) -> None:
    """Replace counters by the words of Philox4x32-10, in place.

    The loop over the counters is the only one left once the rounds are unrolled, and each word has
    32 bits, so that it runs in vector registers.

    >>> a, b, c, d = np.zeros((4, 1), np.uint32)
    >>> philox(a, b, c, d, (0, 0))
    >>> f"{a[0]:08x} {b[0]:08x} {c[0]:08x} {d[0]:08x}"
    '6627e8d5 e169c58d bc57ac4c 9b00dbd8'
    """
    first_0, first_1 = np.uint32(key[0]), np.uint32(key[1])
    for i in range(a.size):
        w, x, y, z = a[i], b[i], c[i], d[i]
        key_0, key_1 = first_0, first_1
        for _ in range(10):
            p, q = _MULTIPLIER_0 * np.uint64(w), _MULTIPLIER_1 * np.uint64(y)
            w = np.uint32(np.uint32(q >> _32) ^ x ^ key_0)
            y = np.uint32(np.uint32(p >> _32) ^ z ^ key_1)
            x, z = np.uint32(q), np.uint32(p)
            key_0, key_1 = np.uint32(key_0 + _WEYL_0), np.uint32(key_1 + _WEYL_1)
        a[i], b[i], c[i], d[i] = w, x, y, z


@kernel
def unit(word: np.uint32) -> float:
    """Return a 32-bit word as a number in the open interval (0, 1)."""
    return (np.float64(word) + 0.5) * _UNIT_32


@kernel
def cos_sin_turns(turns: float) -> tuple[float, float]:
    """Return cosine and sine of an angle in turns from 0 to 1, to 2e-15.

    Taylor's series of half the angle from half a turn, then the double-angle formulas: without a
    branch or a call, so that a loop over many angles runs in vector registers.
    """
    a = (turns - 0.5) * math.pi
    z = a * a
    s = _S5 + z * (_S6 + z * (_S7 + z * (_S8 + z * (_S9 + z * _S10))))
    s = a * (_S0 + z * (_S1 + z * (_S2 + z * (_S3 + z * (_S4 + z * s)))))
    c = _C6 + z * (_C7 + z * (_C8 + z * (_C9 + z * (_C10 + z * _C11))))
    c = _C0 + z * (_C1 + z * (_C2 + z * (_C3 + z * (_C4 + z * (_C5 + z * c)))))
    return 2.0 * s * s - 1.0, -2.0 * s * c


@kernel
def log(x: float) -> float:
    """Return the natural logarithm of a positive, normal number, to 2e-15 relative to its terms.

    ``log(m 2^e) = e log 2 + 2 atanh((m - 1) / (m + 1))`` with m near 1; in vector registers too.
    """
    bits = np.float64(x).view(np.int64)
    exponent = np.float64(bits >> 52) - 1023.0
    m = np.int64((bits & _MANTISSA) | _EXPONENT_ONE).view(np.float64)
    large = m > _SQRT_2
    m = m * 0.5 if large else m
    exponent = exponent + 1.0 if large else exponent
    s = (m - 1.0) / (m + 1.0)
    z = s * s
    tail = _L6 + z * (_L7 + z * (_L8 + z * (_L9 + z * (_L10 + z * _L11))))
    tail = _L0 + z * (_L1 + z * (_L2 + z * (_L3 + z * (_L4 + z * (_L5 + z * tail)))))
    return exponent * _LOG_2 + s * tail


@kernel
def fill_unit_pairs(
    key: tuple[int, int],
    purpose: int,
    run: int,
    time: int,
    car: Indices,
    neighbour: Indices,
    first: Floats,
    second: Floats,
) -> None:
    """Write two independent numbers, uniform in (0, 1), for each address.

    Parameters
    ----------
    key : (seed, scenario), each below 2^32
    purpose, run, time : shared parts of the address
    car, neighbour : (N,) the other parts
    first, second : (N,) where the numbers go
    """
    words = np.empty((4, _BLOCK), np.uint32)
    for start in range(0, car.size, _BLOCK):
        size = min(_BLOCK, car.size - start)
        a, b, c, d = words[0, :size], words[1, :size], words[2, :size], words[3, :size]
        for i in range(size):
            a[i], b[i], c[i] = time, car[start + i], neighbour[start + i]
            d[i] = (run << 8) | purpose
        philox(a, b, c, d, key)
        for i in range(size):
            first[start + i], second[start + i] = unit(a[i]), unit(b[i])


@kernel
def fill_normal_pairs(
    key: tuple[int, int],
    purpose: int,
    run: int,
    time: int,
    car: Indices,
    neighbour: Indices,
    first: Floats,
    second: Floats,
) -> None:
    """Write two independent standard normals for each address, by Box and Muller (1958).

    The parameters are those of :func:`fill_unit_pairs`.
    """
    fill_unit_pairs(key, purpose, run, time, car, neighbour, first, second)
    for i in range(car.size):
        size = math.sqrt(-2.0 * log(first[i]))
        cosine, sine = cos_sin_turns(second[i])
        first[i] = size * cosine
        second[i] = size * sine

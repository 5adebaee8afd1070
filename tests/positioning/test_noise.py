"""Chance: the generator's published answers, its distribution, and its addresses."""

import numpy as np
import pytest
from scipy import stats

from covertool.errors import OptionError
from covertool.positioning import noise
from covertool.positioning.kernel import kernel

KNOWN_ANSWERS = [  # kat_vectors of the Random123 distribution, lines "philox4x32 10"
    ((0,) * 4, (0,) * 2, "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
    ((0xFFFFFFFF,) * 4, (0xFFFFFFFF,) * 2, "408f276d 41c83b0e a20bc7c6 6d5451fd"),
    (
        (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
        (0xA4093822, 0x299F31D0),
        "d16cfe09 94fdcceb 5001e420 24126ea1",
    ),
]


@kernel
def _pairs(count):
    out = np.empty((count, 2))
    for i in range(count):
        out[i] = noise.normal_pair((7, 0), noise.GPS, i % 13, i // 13, 3, 5)
    return out


@pytest.mark.parametrize(("counter", "key", "answer"), KNOWN_ANSWERS)
def test_philox_gives_the_published_answers(counter, key, answer):
    assert " ".join(f"{word:08x}" for word in noise.philox(*counter, *key)) == answer


def test_box_muller_pairs_are_standard_normal_and_uncorrelated():
    pairs = _pairs(200_000)
    assert stats.kstest(pairs.ravel(), "norm").pvalue > 1e-3
    assert abs(np.corrcoef(pairs.T)[0, 1]) < 4 / np.sqrt(len(pairs))
    assert abs(np.corrcoef(pairs[:-1, 0], pairs[1:, 0])[0, 1]) < 4 / np.sqrt(len(pairs))


def test_every_part_of_the_address_changes_the_number():
    base = [(7, 0), noise.GPS, 1, 2, 3, 4]
    other = [(8, 0), noise.VELOCITY, 2, 3, 4, 5]
    drawn = {noise.normal(*base)} | {
        noise.normal(*base[:i], other[i], *base[i + 1 :]) for i in range(6)
    }
    assert len(drawn) == 7


def test_one_normal_is_the_first_of_its_pair():
    address = ((7, 1), noise.RANGE_TO_CAR, 1, 2, 3, 4)
    assert noise.normal(*address) == noise.normal_pair(*address)[0]


@pytest.mark.parametrize(("seed", "runs"), [(-1, 1), (2**32, 1), (0, 0)])
def test_a_seed_or_a_number_of_runs_out_of_range_is_refused(seed, runs):
    with pytest.raises(OptionError):
        noise.check_address(seed, runs)

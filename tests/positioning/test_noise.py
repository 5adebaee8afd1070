"""Chance: the generator's published answers, its distribution, and its addresses."""

import numpy as np
import pytest
from scipy import stats

from covertool.errors import OptionError
from covertool.positioning import noise

KNOWN_ANSWERS = [  # kat_vectors of the Random123 distribution, lines "philox4x32 10"
    ((0,) * 4, (0,) * 2, "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
    ((0xFFFFFFFF,) * 4, (0xFFFFFFFF,) * 2, "408f276d 41c83b0e a20bc7c6 6d5451fd"),
    (
        (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
        (0xA4093822, 0x299F31D0),
        "d16cfe09 94fdcceb 5001e420 24126ea1",
    ),
]


def _pairs(car, neighbour, *, key=(7, 0), purpose=noise.GPS, run=1, time=2):
    first, second = np.empty(car.size), np.empty(car.size)
    noise.fill_normal_pairs(key, purpose, run, time, car, neighbour, first, second)
    return np.stack([first, second], axis=1)


@pytest.mark.parametrize(("counter", "key", "answer"), KNOWN_ANSWERS)
def test_philox_gives_the_published_answers(counter, key, answer):
    words = [np.full(70, word, dtype=np.uint32) for word in counter]
    noise.philox(*words, key)
    for place in (0, 69):
        assert " ".join(f"{word[place]:08x}" for word in words) == answer


def test_box_muller_pairs_are_standard_normal_and_uncorrelated():
    numbers = np.arange(200_000)
    pairs = _pairs(numbers % 449, numbers // 449)
    assert stats.kstest(pairs.ravel(), "norm").pvalue > 1e-3
    assert abs(np.corrcoef(pairs.T)[0, 1]) < 4 / np.sqrt(len(pairs))
    assert abs(np.corrcoef(pairs[:-1, 0], pairs[1:, 0])[0, 1]) < 4 / np.sqrt(len(pairs))


def test_cosine_and_sine_of_turns_agree_with_numpy():
    turns = np.linspace(0.0, 1.0, 10_001)
    ours = np.array([noise.cos_sin_turns(turn) for turn in turns])
    theirs = np.stack([np.cos(2 * np.pi * turns), np.sin(2 * np.pi * turns)], axis=1)
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=3e-15)


def test_the_logarithm_agrees_with_numpy():
    x = np.concatenate([2.0 ** -np.arange(1, 34.0), np.linspace(1e-6, 2.0, 10_001)])
    ours = np.array([noise.log(value) for value in x])
    np.testing.assert_allclose(ours, np.log(x), rtol=2e-15, atol=2e-15)


def test_every_part_of_the_address_changes_the_number():
    three, four, five = np.array([3]), np.array([4]), np.array([5])
    drawn = {
        float(pair[0, 0])
        for pair in (
            _pairs(three, four),
            _pairs(five, four),
            _pairs(three, five),
            _pairs(three, four, key=(8, 0)),
            _pairs(three, four, key=(7, 1)),
            _pairs(three, four, purpose=noise.RANGE),
            _pairs(three, four, run=2),
            _pairs(three, four, time=3),
        )
    }
    assert len(drawn) == 8


def test_a_number_does_not_depend_on_what_is_drawn_beside_it():
    cars = np.arange(101)
    together, alone = _pairs(cars, cars), _pairs(cars[57:58], cars[57:58])
    assert (together[57] == alone[0]).all()


@pytest.mark.parametrize(("seed", "runs"), [(-1, 1), (2**32, 1), (0, 0)])
def test_a_seed_or_a_number_of_runs_out_of_range_is_refused(seed, runs):
    with pytest.raises(OptionError):
        noise.check_address(seed, runs)

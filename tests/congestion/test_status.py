import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from covertool.congestion.status import (
    DATEX2_V2,
    ORDERED,
    PROFILES,
    SPEED_PROFILES,
    WAZE,
    parse_profile,
    profile_named,
    status_of_speed,
    status_of_words,
)
from covertool.errors import ColumnError, OptionError


def words(*given: object) -> np.ndarray:
    return np.array(given, dtype=object)


@pytest.mark.parametrize(
    ("name", "bands"),
    [("datex", (0.75, 0.25, 0.10)), ("tomtom-tile", (0.75, 0.35, 0.15)),
     ("tomtom-feed", (0.625, 0.35, 0.25))],
)  # fmt: skip
def test_a_band_begins_at_its_least_speed_and_ends_just_below(name, bands):
    profile = profile_named(name)
    at = status_of_speed(np.array(bands), profile)
    below = status_of_speed(np.nextafter(np.array(bands), 0), profile)
    assert at.tolist() == ["free", "slow", "very_slow"]
    assert below.tolist() == ["slow", "very_slow", "stationary"]


@given(st.floats(0, 3), st.floats(0, 3))
def test_slower_is_never_better(one, other):
    for profile in SPEED_PROFILES:
        fast, slow = status_of_speed(np.array([max(one, other), min(one, other)]), profile)
        assert ORDERED.index(fast) <= ORDERED.index(slow)


def test_heavy_without_a_profile_is_refused_and_the_scale_itself_is_not():
    with pytest.raises(ColumnError, match="heavy"):
        status_of_words(words("slow", "heavy"))
    assert status_of_words(words(*ORDERED, "closed")).tolist() == [*ORDERED, "closed"]


def test_datex_2_words_mean_what_the_schema_says():
    given = words("freeFlow", "heavy", "congested", "impossible", "unknown")
    assert status_of_words(given, DATEX2_V2).tolist() == [
        "free", "slow", "very_slow", "stationary", "unknown",
    ]  # fmt: skip


def test_a_waze_level_5_is_closed_and_no_level_is_stationary():
    status = status_of_words(words("0", "1", "2", "3", "4", "5"), WAZE)
    assert status.tolist() == ["free", "free", "slow", "very_slow", "very_slow", "closed"]


def test_every_profile_names_its_source():
    assert all(len(profile.reference) > 20 for profile in PROFILES.values())


def test_a_users_own_profile_maps_words_and_bands():
    mine = parse_profile(
        'name = "city"\n[bands]\nfree = 0.8\nslow = 0.5\nvery_slow = 0.2\n[words]\nRed = "closed"'
    )
    assert status_of_words(words("red"), mine).tolist() == ["closed"]
    assert status_of_speed(np.array([0.79, 0.1]), mine).tolist() == ["slow", "stationary"]


@pytest.mark.parametrize(
    "text",
    ["[words]\nred = 'crimson'", "bands = 3", "[bands]\nfree = 0.1\nslow = 0.5\nvery_slow = 0.2",
     "colour = 'red'", "not toml at all", "[bands]\nfree = 0.5"],
)  # fmt: skip
def test_a_wrong_profile_file_is_refused_by_name(text):
    with pytest.raises(OptionError):
        parse_profile(text, "mine.toml")

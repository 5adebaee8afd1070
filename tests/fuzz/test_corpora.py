"""The fuzzers' corpora are replayed; so is each input that once broke a reader."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fuzz.targets import CORPUS, TARGETS

SEEDS = sorted(path for path in CORPUS.rglob("*") if path.is_file())
TOKENS = (
    b"|\x00|-1|1e999|nan|inf|null|[]|{}|\"|'|<|</|&x;|99999999999999999999|\xff\xfe|\xb0|,|;|\n|true"
    b"|<!DOCTYPE a>|0001-01-01T00:00|=|[[|]]|:|../|*|%s"
).split(b"|")
TOKENS += [b"9" * 5000, b"[" * 3000, b"<a>" * 300]
CUTS = st.lists(
    st.tuples(st.floats(0, 1), st.integers(0, 12), st.sampled_from(TOKENS) | st.binary(max_size=4)),
    min_size=1,
    max_size=4,
)


@pytest.mark.parametrize("path", SEEDS, ids=lambda path: f"{path.parent.name}-{path.name}")
def test_a_seed_is_read_or_refused(path: Path) -> None:
    TARGETS[path.parent.name](path.read_bytes())


def test_every_target_has_a_corpus_and_every_corpus_a_target() -> None:
    assert {path.parent.name for path in SEEDS} == set(TARGETS)
    assert sum(path.stat().st_size for path in SEEDS) < 100_000


@pytest.mark.parametrize("name", TARGETS)
@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(which=st.integers(0, 99), cuts=CUTS)
def test_a_damaged_seed_is_read_or_refused(
    name: str, which: int, cuts: list[tuple[float, int, bytes]]
) -> None:
    seeds = [path for path in SEEDS if path.parent.name == name]
    raw = seeds[which % len(seeds)].read_bytes()
    for place, removed, put in cuts:
        at = int(place * len(raw))
        raw = raw[:at] + put + raw[at + removed :]
    TARGETS[name](raw)

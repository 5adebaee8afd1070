"""The compiled loops' own promises: what they gather, and what numba refuses them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import config
from numba.core.errors import TypingError

from covertool.coverage.compiled import borrowing
from covertool.coverage.gathering import gathered


@given(st.lists(st.integers(0, 6), max_size=40))
def test_rows_are_gathered_as_a_stable_sort_gathers_them(keys: list[int]) -> None:
    key = np.array(keys, dtype=np.int64)
    order, first = gathered(key, 7)
    assert order.tolist() == np.argsort(key, kind="stable").tolist()
    assert [key[order[first[k] : first[k + 1]]].tolist() for k in range(7)] == [
        [k] * keys.count(k) for k in range(7)
    ]


@pytest.mark.skipif(bool(config.DISABLE_JIT), reason="nothing is compiled in this run")
def test_a_loop_that_counts_no_references_cannot_make_an_array() -> None:
    def last_of_new(size):  # type: ignore[no-untyped-def]
        return np.zeros(size)[-1]

    with pytest.raises(TypingError):
        borrowing(last_of_new)(3)

"""The one way in which this room compiles: no hidden threads, kept on disk, exact arithmetic."""

from collections.abc import Callable
from typing import TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., object])


def kernel(function: Function) -> Function:
    """Return the function compiled by numba, released from the GIL and kept on disk.

    No fast-math and no threads inside: the same numbers give the same bits in every process.
    """
    compiled = numba.njit(nogil=True, cache=True, error_model="numpy")(function)
    return cast(Function, compiled)


def copied(function: Function) -> Function:
    """Return a function that is copied into the kernels that call it.

    For what is called car by car: to hand arrays to a compiled function costs more than looking
    at a few points.
    """
    compiled = numba.njit(nogil=True, inline="always", error_model="numpy")(function)
    return cast(Function, compiled)

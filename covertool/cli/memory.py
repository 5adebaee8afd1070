"""A limit of memory set from outside (ulimit -v) ends a run with words, not in a hang."""

from __future__ import annotations

import importlib
import os

from covertool.errors import ComputationError

LEAST_BYTES = 256 << 20
"""Below this the libraries that every verb needs do not load."""


def out_of_memory() -> ComputationError:
    """Return the error that tells that memory ran out."""
    return ComputationError(
        "there is not enough memory",
        "this machine, or the limit set for this process",
        "take a smaller area, or tiles where the verb offers them (--tile, --workers)",
    )


def heed_limit() -> None:
    """Load OpenBLAS first when memory is limited.

    It asks for its buffers again and again, for ever, when there is no room for them, and most of
    what a verb loads would come before it.

    Raises
    ------
    ComputationError
        When the limit is below 256 MiB.
    """
    limit = _limit_bytes()
    if limit is None:
        return
    if limit < LEAST_BYTES:
        raise out_of_memory()
    importlib.import_module("scipy.linalg")


def is_limited() -> bool:
    """Whether a limit of memory is set for this process."""
    return _limit_bytes() is not None


def _limit_bytes() -> int | None:
    if os.name != "posix":
        return None
    import resource

    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    return None if limit == resource.RLIM_INFINITY else limit

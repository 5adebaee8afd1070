"""Loops compiled to machine code by numba, once for each machine, and said so when it happens."""

from __future__ import annotations

import hashlib
import importlib
import logging
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import TypeVar, cast

import numba
import numba.np.linalg
from numba.core import event

Loop = TypeVar("Loop", bound=Callable[..., object])

_logger = logging.getLogger(__name__)


def _load_without_scipy() -> None:
    """Load numba's array functions without scipy.linalg, which takes longer than they do.

    numba imports it only to see that it is there, before anything is compiled; it asks again when
    a loop really uses linear algebra, which none of ours does.
    """
    asks = getattr(numba.np.linalg, "ensure_blas", None)
    if asks is None or "numba.np.arraymath" in sys.modules:
        return
    numba.np.linalg.ensure_blas = lambda: None
    try:
        arrays = importlib.import_module("numba.np.arraymath")
    finally:
        numba.np.linalg.ensure_blas = asks
    arrays.ensure_blas = asks  # type: ignore[attr-defined]


_load_without_scipy()


def compiled(loop: Loop) -> Loop:
    """Return a loop that numba compiles on its first call and keeps on disk for later runs.

    The loops release the interpreter lock and start no threads of their own. Where no folder for
    the cache can be written, they are compiled again in every run.
    """
    return _kept(loop)


def borrowing(loop: Loop) -> Loop:
    """Return a compiled loop that makes and returns no arrays, only works on those it is given.

    The caller keeps these alive, so that nobody has to count references to them. Counted they are
    otherwise, atomically, at each call of a loop by a loop: a third of the engine's time.
    """
    return _kept(loop, _nrt=False)


def inlined(loop: Loop) -> Loop:
    """Return a small borrowing loop that is written into each compiled loop that calls it."""
    return _numba(loop, forceinline=True, _nrt=False)


def _kept(loop: Loop, **options: bool) -> Loop:
    try:
        fast = _numba(loop, cache=True, **options)
    except RuntimeError:
        return _numba(loop, **options)
    # numba looks for changes only in the loop's own file, not in those of the loops it calls.
    index = getattr(getattr(fast, "_cache", None), "_cache_file", None)
    if index is not None and hasattr(index, "_source_stamp"):
        index._source_stamp = _source_stamp()
    return fast


def _numba(loop: Loop, **options: bool) -> Loop:
    njit: Callable[..., object] = numba.njit  # its types leave out _nrt
    return cast(Loop, njit(loop, nogil=True, error_model="numpy", **options))


@cache
def _source_stamp() -> str:
    """Return a digest of all files of this room that hold compiled loops."""
    sources = [file.read_bytes() for file in sorted(Path(__file__).parent.glob("*.py"))]
    marks = (b"\n@compiled\n", b"\n@borrowing\n", b"\n@inlined\n")
    loops = (source for source in sources if any(mark in source for mark in marks))
    return hashlib.sha256(b"".join(loops)).hexdigest()


class _Announcement(event.Listener):
    said = False

    def on_start(self, event: object) -> None:
        if not _Announcement.said:
            _logger.warning("compiling the coverage engine for this machine, once (about 30 s) ...")
            _Announcement.said = True

    def on_end(self, event: object) -> None:
        """Nothing is said at the end: the result follows."""


@contextmanager
def announced() -> Iterator[None]:
    """Log one warning if a loop is really being compiled, and none when the cache has it."""
    with event.install_listener("numba:compile", _Announcement()):
        yield

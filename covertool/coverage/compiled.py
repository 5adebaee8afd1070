"""Loops compiled to machine code by numba, once for each machine, and said so when it happens."""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, partial
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core import event
from numba.core.runtime.nrt import rtsys

Loop = TypeVar("Loop", bound=Callable[..., object])

_logger = logging.getLogger(__name__)


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
    store = getattr(fast, "_cache", None)
    # numba looks for changes only in the loop's own file, not in those of the loops it calls.
    if hasattr(getattr(store, "_cache_file", None), "_source_stamp"):
        store._cache_file._source_stamp = _source_stamp()  # type: ignore[union-attr]
    if hasattr(store, "_load_overload"):
        counts = options.get("_nrt", True)
        store.load_overload = partial(_loaded, store, counts)  # type: ignore[union-attr]
    return fast


def _loaded(store: Any, counts: bool, signature: object, target: Any) -> object:
    """Return a loop's machine code from the disk, or None when it is not there.

    numba would first load all that it can compile, which takes a fifth of a short run: code that
    is compiled already needs no more than the functions that count references, if it does count.
    """
    if counts:
        rtsys.initialize(target)
    return store._load_overload(signature, target)


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

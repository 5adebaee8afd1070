"""Ctrl-C ends a run wherever it comes, and harms nothing."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

AGAIN_S = 0.01
"""How soon an interrupt that came at a bad moment is tried again."""


@contextmanager
def careful_interrupts() -> Iterator[None]:
    """Raise KeyboardInterrupt where it can be borne, in what this block runs.

    The compiler under numba calls back into Python. An interrupt that is raised there is lost, or
    leaves what the compiler owns in halves and crashes the process later; so it waits until the
    compiler is left. One that is lost elsewhere, such as in a finalizer, is raised again.
    """
    if not _is_ours_to_meet():
        yield
        return
    usual = sys.unraisablehook

    def raise_again(lost: Any) -> None:
        if lost.exc_type is KeyboardInterrupt:
            _try_again()
        else:
            usual(lost)

    sys.unraisablehook = raise_again
    signal.signal(signal.SIGINT, _interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        sys.unraisablehook = usual


def is_interrupt(error: BaseException | None) -> bool:
    """Whether an error came of Ctrl-C; compiled code tells it as its own."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__
    return error is not None


def _is_ours_to_meet() -> bool:
    """Whether nobody else meets, or ignores, SIGINT."""
    is_main = threading.current_thread() is threading.main_thread()
    return is_main and signal.getsignal(signal.SIGINT) is signal.default_int_handler


def _interrupt(number: int, frame: FrameType | None) -> None:
    while frame is not None:
        if frame.f_globals.get("__name__", "").startswith("llvmlite"):
            _try_again()
            return
        frame = frame.f_back
    raise KeyboardInterrupt


def _try_again() -> None:
    later = threading.Timer(AGAIN_S, signal.raise_signal, [signal.SIGINT])
    later.daemon = True
    later.start()

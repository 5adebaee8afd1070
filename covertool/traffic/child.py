"""A child process that cannot outlive us: watched, timed, ended, and its last words kept."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from covertool.errors import ComputationError, OptionError
from covertool.traffic.sumo import Sumo

_POLL_S = 0.05
_GRACE_S = 5.0
"""What a program gets between TERM and KILL."""
_PR_SET_PDEATHSIG = 1
_LIBC = ctypes.CDLL(None, use_errno=True) if sys.platform == "linux" else None


@dataclass(frozen=True)
class Finished:
    """How a program ended: its name, exit code (minus the signal that killed it) and messages."""

    program: str
    code: int
    messages: str

    @property
    def last_lines(self) -> str:
        """The last 20 lines of its messages."""
        return "\n".join(self.messages.strip().splitlines()[-20:])

    @property
    def first_error(self) -> str:
        """The first error that it told, without the word; empty when it told none."""
        for line in self.messages.splitlines():
            if line.startswith("Error: "):
                return line.removeprefix("Error: ").strip()
        return ""

    @property
    def ending(self) -> str:
        """How it ended, in words."""
        if self.code >= 0:
            return f"ended with exit code {self.code}"
        try:
            return f"was ended by {signal.Signals(-self.code).name}"
        except ValueError:
            return f"was ended by signal {-self.code}"


def run_program(
    sumo: Sumo,
    program: str,
    arguments: Sequence[str],
    folder: Path,
    *,
    timeout_s: float,
    on_poll: Callable[[], object] | None = None,
) -> Finished:
    """Run one of SUMO's programs in a folder to its end and return how it ended.

    Whatever happens here (an exception, Ctrl-C, even a kill of this process on Linux), the child
    ends too. Exit codes are returned, not judged: SUMO's is 0 on a full disk.

    Parameters
    ----------
    sumo : the installation
    program : such as ``netconvert``
    arguments : of the program
    folder : where it runs; its messages are kept there
    timeout_s : after which it is ended
    on_poll : called twenty times a second while it runs

    Raises
    ------
    ComputationError
        When it runs longer than ``timeout_s``.
    """
    if not timeout_s > 0:
        raise OptionError(f"a time-out of {timeout_s} s is no time", "timeout_s", "use seconds")
    log = folder / f"{program}.messages"
    command = [sumo.program(program), *arguments]
    with _started(command, folder, log, dict(sumo.environment)) as child:
        deadline = time.monotonic() + timeout_s
        while child.poll() is None:
            if time.monotonic() > deadline:
                raise ComputationError(
                    f"{program} ran longer than {timeout_s:g} s and was ended",
                    f"SUMO {sumo.version}",
                    "give it more time, or simulate fewer cars or a shorter horizon",
                )
            if on_poll is not None:
                on_poll()
            _wait(child, _POLL_S)
    messages = log.read_text(encoding="utf-8", errors="replace")
    return Finished(program, child.returncode, messages)


@contextmanager
def _started(
    command: list[str], folder: Path, log: Path, environment: dict[str, str]
) -> Iterator[subprocess.Popen[bytes]]:
    """Yield a running child; on the way out it is ended if it still runs."""
    with log.open("wb") as messages:
        child = subprocess.Popen(
            command,
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=messages,
            stderr=messages,
            start_new_session=True,  # a Ctrl-C is ours to handle
            preexec_fn=_die_with(os.getpid()) if _LIBC is not None else None,
        )
    try:
        yield child
    finally:
        _end(child)


def _die_with(parent: int) -> Callable[[], None]:
    """Return what asks Linux, in the child, to kill it when its parent dies."""

    def ask() -> None:
        assert _LIBC is not None
        _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
        if os.getppid() != parent:  # it died before we asked
            os._exit(1)

    return ask


def _end(child: subprocess.Popen[bytes]) -> None:
    """End a child that still runs: TERM first, then KILL."""
    if child.poll() is not None:
        return
    child.terminate()
    _wait(child, _GRACE_S)
    if child.poll() is None:
        child.kill()
        child.wait()


def _wait(child: subprocess.Popen[bytes], seconds: float) -> None:
    try:
        child.wait(seconds)
    except subprocess.TimeoutExpired:
        return

"""covertool as a user runs it: as a program of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import Any

COVERTOOL = (sys.executable, "-m", "covertool")


def run(*words: object, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run a command to its end, with more variables in its environment."""
    return subprocess.run(
        [*COVERTOOL, *map(str, words)], capture_output=True, text=True, check=False,
        env={**os.environ, **variables}, timeout=600,
    )  # fmt: skip


def ok(*words: object) -> str:
    """Run a command that must do well, and return what it prints."""
    done = run(*words)
    assert done.returncode == 0, done.stderr
    return done.stdout


def answer(*words: object) -> dict[str, Any]:
    """Run a command that must do well, and return its JSON."""
    found: dict[str, Any] = json.loads(ok(*words, "--json"))
    return found


def start(*words: object) -> subprocess.Popen[str]:
    """Start a command as the leader of a group of its own, so that its children die with it."""
    return subprocess.Popen(
        [*COVERTOOL, *map(str, words)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def finished(process: subprocess.Popen[str]) -> dict[str, Any]:
    """Wait for a command that was started with ``--json``, and return its JSON."""
    out, error = process.communicate(timeout=300)
    assert process.returncode == 0, error
    found: dict[str, Any] = json.loads(out)
    return found

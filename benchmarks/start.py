"""How long a short run takes to start, beside an interpreter that only loads the libraries.

python -m benchmarks.start [--quick]
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator

from benchmarks.rows import Row, main

LIBRARIES = "import numpy, shapely, pyogrio, numba"
WORK = {
    "coverage of the sample study at 15 m": "coverage --radius 15",
    "help": "--help",
}


def spent(arguments: list[str]) -> tuple[float, float]:
    """Return the seconds by the clock and of the processor that a fresh interpreter takes."""
    # A user's interpreter keeps the bytecode of what it has imported once.
    usual = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    begun = time.perf_counter()
    child = subprocess.Popen(
        [sys.executable, *arguments],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=usual,
    )  # fmt: skip
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise SystemExit(f"{' '.join(arguments)} failed")
    return time.perf_counter() - begun, usage.ru_utime + usage.ru_stime


def rows(quick: bool) -> Iterator[Row]:
    """Yield a run's processor time over that of the libraries alone, and its time by the clock."""
    runs = 2 if quick else 5
    commands = {"": ["-c", LIBRARIES]} | {
        name: ["-m", "covertool", *words.split()] for name, words in WORK.items()
    }
    for arguments in commands.values():
        spent(arguments)  # compiled once, and in the file system's cache
    taken: dict[str, list[tuple[float, float]]] = {name: [] for name in commands}
    for _ in range(runs):
        for name, arguments in commands.items():
            taken[name].append(spent(arguments))
    for name in WORK:
        ratios = tuple(
            ours[1] / alone[1] for ours, alone in zip(taken[name], taken[""], strict=True)
        )
        yield Row(name, LIBRARIES, ratios, higher=False)
    clock = tuple(turn[0] for turn in taken["coverage of the sample study at 15 m"])
    yield Row("coverage of the sample study at 15 m", "the clock", clock, "s", False, 1.5)


if __name__ == "__main__":
    main(rows, __doc__)

"""How long a short run takes to start, beside an interpreter that only loads the libraries.

python -m benchmarks.start [--quick]
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time

LIBRARIES = "import numpy, shapely, pyogrio, numba"
WORK = {
    "coverage of the sample study at 15 m": "coverage --radius 15",
    "help": "--help",
}


def spent(arguments: list[str]) -> tuple[float, float]:
    """Return the seconds by the clock and of the processor that a fresh interpreter takes."""
    begun = time.perf_counter()
    child = subprocess.Popen(
        [sys.executable, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise SystemExit(f"{' '.join(arguments)} failed")
    return time.perf_counter() - begun, usage.ru_utime + usage.ru_stime


def best(taken: list[tuple[float, float]]) -> tuple[float, float]:
    """Return the least of both: other work on the machine only adds."""
    return min(clock for clock, _ in taken), min(cpu for _, cpu in taken)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="run each only twice")
    runs = 2 if parser.parse_args().quick else 5
    commands = {"libraries alone": ["-c", LIBRARIES]} | {
        name: ["-m", "covertool", *words.split()] for name, words in WORK.items()
    }
    for arguments in commands.values():
        spent(arguments)  # compiled once, and in the file system's cache
    taken: dict[str, list[tuple[float, float]]] = {name: [] for name in commands}
    for _ in range(runs):
        for name, arguments in commands.items():
            taken[name].append(spent(arguments))
    base = best(taken["libraries alone"])[1]
    print("| start (demand for the sample: 1.5 s on a quiet machine) | clock, s | CPU, s | ratio |")
    print("| --- | ---: | ---: | ---: |")
    for name, rows in taken.items():
        clock, cpu = best(rows)
        print(f"| {name} | {clock:.2f} | {cpu:.2f} | {cpu / base:.2f} |")


if __name__ == "__main__":
    main()

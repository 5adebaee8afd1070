"""Mutation tests: small faults are put into a module, and its tests must notice each of them.

python -m tests.mutation [NAME ...] [--most 200] [--seed 1] [--folder FOLDER]

The mutants are made by cosmic-ray in a copy of the source tree, at most so many a module, drawn by
a seed. Survivors are printed as differences; the README beside says what became of them.
Compiled loops run as plain Python, so that a mutant does not wait for the compiler.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import sqlite3
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
COPIED = ("covertool", "tests", "data", "pyproject.toml")


@dataclass(frozen=True)
class Subject:
    """A module and the tests that look after it, which must be quick without the compiler."""

    module: str
    tests: str
    timeout_s: float = 120.0


QUICK_AREAS = "tests/analytic -k 'not 0.001 and not poisson'"
SUBJECTS = {
    "areas": Subject(
        "covertool/coverage/areas.py",
        QUICK_AREAS,
    ),
    "cells": Subject(
        "covertool/coverage/cells.py",
        QUICK_AREAS,
    ),
    "arcs": Subject(
        "covertool/coverage/arcs.py",
        QUICK_AREAS,
    ),
    "occupancy": Subject(
        "covertool/congestion/occupancy.py",
        "tests/congestion/test_occupancy.py tests/congestion/test_paper_numbers.py",
    ),
    "ekf": Subject(
        "covertool/positioning/ekf.py",
        "tests/positioning/test_ekf.py tests/positioning/test_estimators.py -k ekf",
    ),
}


def configure(subject: Subject, tree: Path) -> Path:
    """Write cosmic-ray's configuration of one module."""
    command = f"{sys.executable} -m pytest -x -q -p no:cacheprovider {subject.tests}"
    path = tree / "mutation.toml"
    path.write_text(
        "[cosmic-ray]\n"
        f'module-path = "{subject.module}"\n'
        f"timeout = {subject.timeout_s}\n"
        "excluded-modules = []\n"
        f'test-command = "{command}"\n'
        '[cosmic-ray.distributor]\nname = "local"\n',
        encoding="utf-8",
    )
    return path


def draw(session: Path, most: int, seed: int) -> tuple[int, int]:
    """Leave so many mutants in the session; return how many are left, and how many there were.

    A ``|`` stands in these modules only in annotations, which never run: those are left out.
    """
    with sqlite3.connect(session) as database:
        jobs = sorted(row[0] for row in database.execute("select job_id from mutation_specs"))
        places = database.execute(
            "select job_id from mutation_specs where operator_name not like '%BitOr%' "
            "order by start_pos_row, start_pos_col, operator_name, occurrence"
        )
        ordered = [row[0] for row in places]
        kept = set(random.Random(seed).sample(ordered, min(most, len(ordered))))
        gone = [(job,) for job in jobs if job not in kept]
        database.executemany("delete from mutation_specs where job_id = ?", gone)
        database.executemany("delete from work_items where job_id = ?", gone)
    return len(kept), len(jobs)


def survivors(session: Path) -> tuple[int, list[tuple[str, str]]]:
    """Return how many mutants were tried, and of those that no test noticed place and change."""
    with sqlite3.connect(session) as database:
        tried = database.execute("select count(*) from work_results").fetchone()[0]
        rows = database.execute(
            "select s.start_pos_row, s.operator_name, r.diff from work_results r "
            "join mutation_specs s on s.job_id = r.job_id "
            "where r.test_outcome = 'SURVIVED' order by s.start_pos_row"
        )
        found = [(f"line {row}: {name}", diff or "") for row, name, diff in rows]
    return tried, found


def run(name: str, most: int, seed: int, folder: Path) -> int:
    """Try the mutants of one module, print the survivors and return their number."""
    subject = SUBJECTS[name]
    tree, session = folder / name, folder / f"{name}.sqlite"
    for item in COPIED:
        source = ROOT / item
        copy = shutil.copytree if source.is_dir() else shutil.copy2
        tree.mkdir(exist_ok=True)
        copy(source, tree / item)
    ray = str(Path(sys.executable).with_name("cosmic-ray"))
    config = str(configure(subject, tree))
    plain = os.environ | {
        "NUMBA_DISABLE_JIT": "1",
        "PYTHONPATH": str(tree),
        "PYTHONDONTWRITEBYTECODE": "1",
        "HYPOTHESIS_STORAGE_DIRECTORY": str(folder / "hypothesis"),
    }

    def call(*words: str) -> None:
        subprocess.run([ray, *words], cwd=tree, env=plain, check=True)

    call("baseline", config)
    call("init", config, str(session))
    kept, all_ = draw(session, most, seed)
    print(f"{subject.module}: {kept} of {all_} mutants", flush=True)
    call("exec", config, str(session))
    tried, found = survivors(session)
    for place, diff in found:
        print(f"\n{place}\n{diff}")
    print(f"{subject.module}: {tried - len(found)} of {tried} noticed")
    return len(found)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=list(SUBJECTS), metavar="NAME")
    parser.add_argument("--most", type=int, default=200, help="mutants a module")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--folder", type=Path, help="keep sessions here")
    options = parser.parse_args()
    folder = options.folder or Path(tempfile.mkdtemp())
    folder.mkdir(parents=True, exist_ok=True)
    for name in options.names:
        run(name, options.most, options.seed, folder)


if __name__ == "__main__":
    main()

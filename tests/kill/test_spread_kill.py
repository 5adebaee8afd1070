"""Workers and whole runs are killed with SIGKILL; the results are the same as undisturbed."""

import json
import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pytest

WORK = '''
import os, signal, sys, time
from pathlib import Path

def square(piece):
    """Kill this worker the first time that piece 3 comes; note every finished piece."""
    folder = Path(os.environ["NOTES"])
    victim = folder / "killed"
    if os.environ.get("KILL") == "once" and piece == 3 and not victim.exists():
        victim.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    if os.environ.get("KILL") == "always" and piece == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(float(os.environ.get("PAUSE", "0")))
    with open(folder / "finished", "a") as notes:
        notes.write(f"{piece} {os.getpid()}\\n")
    return piece * piece
'''

MAIN = """
import json, os, sys
from pathlib import Path
from covertool.errors import ComputationError
from covertool.spread import Ledger, spread
from work import square

if __name__ == "__main__":
    options = json.loads(sys.argv[1])
    folder = options.pop("ledger", None)
    ledger = Ledger(Path(folder), "squares") if folder else None
    try:
        print(json.dumps(spread(square, list(range(8)), ledger=ledger, **options)))
    except ComputationError as error:
        sys.exit(str(error))
"""

SQUARES = [piece * piece for piece in range(8)]


@pytest.fixture
def start(tmp_path):
    """Return a function that starts a run in a real process."""
    (tmp_path / "work.py").write_text(textwrap.dedent(WORK))
    (tmp_path / "main.py").write_text(textwrap.dedent(MAIN))

    def run(options, **environment):
        return subprocess.Popen(
            [sys.executable, "main.py", json.dumps(options)],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": str(tmp_path), "NOTES": str(tmp_path), **environment},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    return run


def finished(folder: Path) -> list[int]:
    notes = folder / "finished"
    if not notes.exists():
        return []
    return [int(line.split()[0]) for line in notes.read_text().splitlines()]


def test_the_piece_of_a_killed_worker_is_done_again(start, tmp_path):
    process = start({"workers": 2}, KILL="once")
    out, error = process.communicate(timeout=60)
    assert process.returncode == 0, error
    assert json.loads(out) == SQUARES
    assert (tmp_path / "killed").exists()


def test_a_piece_that_always_kills_its_worker_ends_the_run_with_a_word(start):
    process = start({"workers": 2}, KILL="always")
    _, error = process.communicate(timeout=60)
    assert process.returncode == 1
    assert "workers die again and again" in error
    assert "mend:" in error


@pytest.mark.slow
def test_dask_does_the_piece_of_a_killed_worker_again(start):
    pytest.importorskip("distributed")
    process = start({"workers": 2, "scheduler": "local"}, KILL="once")
    out, error = process.communicate(timeout=120)
    assert process.returncode == 0, error
    assert json.loads(out) == SQUARES


@pytest.mark.parametrize("workers", [1, 2])
def test_a_run_killed_half_way_resumes_from_the_finished_pieces(start, tmp_path, workers):
    options = {"workers": workers, "ledger": str(tmp_path / "ledger")}
    process = start(options, PAUSE="0.4")
    deadline = time.monotonic() + 60
    while len(list((tmp_path / "ledger").glob("*.piece"))) < 2 and time.monotonic() < deadline:
        time.sleep(0.02)
    os.kill(process.pid, signal.SIGKILL)
    process.communicate(timeout=60)
    kept = len(list((tmp_path / "ledger").glob("*.piece")))
    assert 2 <= kept < 8
    time.sleep(0.6)
    before = len(finished(tmp_path))

    process = start(options)
    out, error = process.communicate(timeout=60)
    assert process.returncode == 0, error
    assert json.loads(out) == SQUARES
    assert len(finished(tmp_path)) - before == 8 - kept


def test_the_workers_of_a_killed_run_do_not_live_on(start, tmp_path):
    process = start({"workers": 2}, PAUSE="0.3")
    deadline = time.monotonic() + 60
    while not finished(tmp_path) and time.monotonic() < deadline:
        time.sleep(0.02)
    os.kill(process.pid, signal.SIGKILL)
    process.communicate(timeout=60)
    workers = {int(line.split()[1]) for line in (tmp_path / "finished").read_text().splitlines()}
    deadline = time.monotonic() + 10
    while any(alive(pid) for pid in workers) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not any(alive(pid) for pid in workers)


def alive(pid: int) -> bool:
    try:
        status = Path(f"/proc/{pid}/status").read_text()
    except FileNotFoundError:
        return False
    return "State:\tZ" not in status

"""Signals, full disks, closed pipes and too little memory, on real processes."""

import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest

from covertool.gis.sample import SAMPLE_STUDY, SAMPLE_TRACE, sample_folder

SAMPLE = sample_folder()
STUDY = SAMPLE / SAMPLE_STUDY
COVERTOOL = [sys.executable, "-m", "covertool"]


def run(
    words: list[str], before: Callable[[], None] | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a verb, with something done in the child before it starts."""
    return subprocess.run(
        [*COVERTOOL, *words], capture_output=True, text=True, check=False, preexec_fn=before,
        timeout=300,
    )  # fmt: skip


def three_lines(text: str) -> bool:
    """Whether a text ends in what, where and mend, and shows no traceback."""
    lines = [line.split(":")[0] for line in text.splitlines() if line][-3:]
    return lines == ["error", "where", "mend"] and "Traceback" not in text


@pytest.mark.parametrize("extension", [".gpkg", ".geojson", ".parquet", ".fgb"])
def test_a_file_that_may_not_grow_is_refused_and_the_old_one_stays(
    extension: str, tmp_path: Path
) -> None:
    """A limit on the size of files stands for a full disk: writes fail in the same places."""

    def limit() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))

    output = tmp_path / f"out{extension}"
    output.write_bytes(b"old")
    words = ["export", str(STUDY), "--layer", "buildings", "-o", str(output), "--overwrite"]
    done = run(words, limit)
    assert done.returncode == 1, done.stderr
    assert three_lines(done.stderr), done.stderr
    assert output.read_bytes() == b"old"
    assert [path.name for path in tmp_path.iterdir()] == [output.name]


@pytest.mark.skipif(os.geteuid() != 0, reason="mounting a small disk needs root")
def test_a_full_disk_is_told_and_leaves_nothing(tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(disk)]
    if subprocess.run(mount, capture_output=True, check=False).returncode != 0:
        pytest.skip("a small disk cannot be mounted here")
    try:
        done = run(["coverage", str(STUDY), "--radius", "15", "-o", str(disk / "out.gpkg")])
        assert done.returncode == 1
        assert three_lines(done.stderr), done.stderr
        assert list(disk.iterdir()) == []
    finally:
        subprocess.run(["umount", str(disk)], check=True)


def loaded(process: subprocess.Popen[str], library: str) -> None:
    """Wait until a process has loaded a library."""
    while process.poll() is None and library not in Path(f"/proc/{process.pid}/maps").read_text():
        time.sleep(0.01)


@pytest.mark.parametrize("library", ["_multiarray_umath", "llvmlite", "shapely"])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_run_with_its_code_and_no_traceback(
    number: signal.Signals, library: str, tmp_path: Path
) -> None:
    output = tmp_path / "out.gpkg"
    words = ["coverage", str(STUDY), "--radius", "15", "--penetration", "0.1", "-o", str(output)]
    process = subprocess.Popen(
        [*COVERTOOL, *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # A shell starts what it puts in the background deaf to SIGINT, and its children inherit it.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    loaded(process, library)
    assert process.poll() is None, "the run ended before the signal"
    process.send_signal(number)
    sent = time.monotonic()
    _, said = process.communicate(timeout=60)
    # 128 and the signal, or dead by the signal itself, which a shell shows as the same number.
    after = f"{time.monotonic() - sent:.2f} s after the signal; output: {list(tmp_path.iterdir())}"
    assert process.returncode in (128 + number, -number), f"{after}; {said}"
    assert "Traceback" not in said
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("spread", [["--workers", "2"], ["--workers", "2", "--scheduler", "local"]])
def test_ctrl_c_in_a_terminal_ends_the_workers_without_a_word(
    spread: list[str], tmp_path: Path
) -> None:
    output = tmp_path / "out.gpkg"
    words = ["coverage", str(STUDY), "--radius", "15", "--tile", "100", "-o", str(output), *spread]
    process = subprocess.Popen(
        [*COVERTOOL, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        start_new_session=True, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    run_by = psutil.Process(process.pid)
    while process.poll() is None and len(run_by.children(recursive=True)) < 3:
        time.sleep(0.01)  # two workers, and what keeps their shared memory
    workers = run_by.children(recursive=True)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to all of them
    _, said = process.communicate(timeout=60)
    assert process.returncode in (130, -signal.SIGINT)
    assert "Traceback" not in said
    assert not output.exists()
    assert psutil.wait_procs(workers, timeout=20)[1] == []


CTRL_C = """
import signal, sys, time
from covertool.cli.interrupt import careful_interrupts

inside = {"__name__": "llvmlite.binding", "signal": signal}
exec("def callback():\\n    signal.raise_signal(signal.SIGINT)\\n    return 'whole'", inside)

class Lost:
    def __del__(self):
        signal.raise_signal(signal.SIGINT)

signal.signal(signal.SIGINT, signal.default_int_handler)
with careful_interrupts():
    for name, moment in (("compiler", inside["callback"]), ("finalizer", Lost)):
        try:
            made = moment()
            print(name, "" if made == "whole" else "ended", end=" ")
            del made
            time.sleep(10)
        except KeyboardInterrupt:
            print("interrupted")
"""


def test_ctrl_c_waits_for_the_compiler_and_is_not_lost_in_a_finalizer() -> None:
    done = subprocess.run(
        [sys.executable, "-c", CTRL_C], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.split() == ["compiler", "interrupted", "finalizer", "ended", "interrupted"]
    assert done.stderr == ""


def test_a_closed_pipe_ends_a_table_quietly() -> None:
    line = f"{' '.join(COVERTOOL)} coverage {STUDY} --curve 5:200:40 | head -n 1"
    done = subprocess.run(["bash", "-c", line], capture_output=True, text=True, check=False)
    assert done.stdout.startswith("Transit area")
    assert "Traceback" not in done.stderr
    assert "BrokenPipe" not in done.stderr


def test_a_full_standard_output_is_an_error() -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [*COVERTOOL, "coverage", str(STUDY), "--radius", "15"],
            stdout=full, stderr=subprocess.PIPE, text=True, check=False,
        )  # fmt: skip
    assert done.returncode == 1
    assert three_lines(done.stderr)


@pytest.mark.parametrize("megabytes", [150, 300])
def test_too_little_memory_ends_in_an_error_and_not_in_a_hang(
    megabytes: int, tmp_path: Path
) -> None:
    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (megabytes << 20, megabytes << 20))

    output = tmp_path / "out.gpkg"
    done = run(["coverage", str(STUDY), "--radius", "15", "-o", str(output)], limit)
    assert done.returncode != 0
    assert not output.exists()
    if megabytes < 256:
        assert three_lines(done.stderr)


LITTLE_BY_LITTLE = {
    "extract": ["extract", str(SAMPLE / "orthophoto.tif"), "-o", "{folder}/out.gpkg"],
    "report": ["report", str(STUDY), "-o", "{folder}/out.html"],
    "simulate": [
        "simulate", "--fcd", str(SAMPLE / SAMPLE_TRACE), "--crs", "EPSG:2157",
        "--anchors", f"{STUDY}:anchors", "--estimator", "ekf", "--arm", "gps", "--runs", "1",
        "--no-bound", "--horizon", "10", "-o", "{folder}/out.gpkg",
    ],
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("verb", LITTLE_BY_LITTLE)
@pytest.mark.parametrize("megabytes", [260, 400, 780, 900])
def test_with_any_little_memory_there_is_the_whole_output_or_none(
    verb: str, megabytes: int, tmp_path: Path
) -> None:
    """A native library may end the process itself; what Python sees is told in three lines."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (megabytes << 20, megabytes << 20))

    done = run([word.format(folder=tmp_path) for word in LITTLE_BY_LITTLE[verb]], limit)
    outputs = [path.name for path in tmp_path.iterdir()]
    if done.returncode == 0:
        assert outputs in (["out.gpkg"], ["out.html"])
        return
    assert outputs == []
    if done.returncode == 1:
        assert three_lines(done.stderr), done.stderr

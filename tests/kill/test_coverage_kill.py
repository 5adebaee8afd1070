"""Workers of `covertool coverage` and whole runs are killed; the numbers are as undisturbed."""

import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import shapely
from pyproj import CRS

from covertool.gis.parquet import write_anchors
from covertool.gis.sources import write_transit
from covertool.model import Anchors, TransitArea
from tests.running import finished, start

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not Path("/proc/self").exists(), reason="finds workers in /proc"),
]
ITM = CRS(2157)
TILES = 64


@pytest.fixture(scope="module")
def town(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Return the options of a town of 8 x 8 tiles that take a while each."""
    folder = tmp_path_factory.mktemp("town")
    rng = np.random.default_rng(4)
    x, y = rng.uniform(600_000, 601_600, 6000), rng.uniform(700_000, 701_600, 6000)
    write_anchors(folder / "cars.parquet", Anchors.from_points(x, y, ITM))
    strips = [
        shapely.box(600_000, 700_000 + at, 601_599, 700_006 + at) for at in range(0, 1590, 60)
    ]
    write_transit(folder / "roads.parquet", TransitArea(shapely.MultiPolygon(strips), ITM))
    return [
        "--anchors", str(folder / "cars.parquet"), "--transit", str(folder / "roads.parquet"),
        "--radius", "15", "--curve", "5:80:40", "--tile", "200", "--json",
    ]  # fmt: skip


@pytest.fixture(scope="module")
def undisturbed(town: list[str]) -> dict:
    return found_by(start("coverage", *town))


def found_by(process: subprocess.Popen[str]) -> dict:
    """Return what a run found, without what differs between runs."""
    found = finished(process)
    return {key: found[key] for key in ("transit_area_m2", "anchors", "results", "curve")}


def pieces(folder: Path) -> list[Path]:
    return sorted(folder.glob("*.piece"))


def wait_for(what: Callable[[], bool], process: subprocess.Popen[str]) -> None:
    deadline = time.monotonic() + 240
    while not what():
        assert process.poll() is None, "the run ended before it could be disturbed"
        assert time.monotonic() < deadline
        time.sleep(0.01)


def workers(parent: int) -> Iterator[int]:
    """Yield the worker processes that a run has started."""
    for folder in Path("/proc").iterdir():
        if not folder.name.isdigit():
            continue
        try:
            status = (folder / "stat").read_text().rpartition(")")[2].split()
            command = (folder / "cmdline").read_bytes()
        except OSError:
            continue
        if int(status[1]) == parent and b"spawn_main" in command:
            yield int(folder.name)


@pytest.mark.parametrize("how", [[], ["--scheduler", "local"]], ids=["process", "dask"])
def test_the_tile_of_a_killed_worker_is_done_again(
    town: list[str], undisturbed: dict, tmp_path: Path, how: list[str]
) -> None:
    if how:
        pytest.importorskip("distributed")
    ledger = tmp_path / "ledger"
    process = start("coverage", *town, "--workers", "2", "--resume", ledger, *how)
    wait_for(lambda: len(pieces(ledger)) >= 2, process)
    victim = next(workers(process.pid))
    os.kill(victim, signal.SIGKILL)
    assert len(pieces(ledger)) < TILES
    assert found_by(process) == undisturbed
    assert not ledger.exists()


def test_a_killed_run_resumes_and_keeps_the_tiles_that_were_finished(
    town: list[str], undisturbed: dict, tmp_path: Path
) -> None:
    ledger = tmp_path / "ledger"
    first = start("coverage", *town, "--resume", ledger)
    wait_for(lambda: len(pieces(ledger)) >= 3, first)
    os.kill(first.pid, signal.SIGKILL)
    first.communicate(timeout=60)
    kept = {path: path.stat().st_mtime_ns for path in pieces(ledger)}
    assert 3 <= len(kept) < TILES

    second = start("coverage", *town, "--resume", ledger)
    wait_for(lambda: len(pieces(ledger)) > len(kept), second)
    os.kill(second.pid, signal.SIGSTOP)
    try:
        untouched = {path: path.stat().st_mtime_ns for path in kept}
    finally:
        os.kill(second.pid, signal.SIGCONT)
    assert untouched == kept
    assert found_by(second) == undisturbed
    assert not ledger.exists()

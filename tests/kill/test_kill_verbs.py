"""A verb that is killed at any moment leaves the old file or the new one, and a rerun finishes."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pyogrio
import pytest

from covertool.gis.sample import SAMPLE_STUDY, SAMPLE_TRACE, sample_folder

MOMENTS = 20

SAMPLE = sample_folder()
STUDY = SAMPLE / SAMPLE_STUDY
VERBS = {
    "coverage": ["coverage", str(STUDY), "--radius", "15", "--overwrite"],
    "export": ["export", str(STUDY), "--layer", "buildings", "--overwrite"],
    "extract": [
        "extract", str(SAMPLE / "orthophoto.tif"), "--mask", str(SAMPLE / "road_mask.tif"),
        "--overwrite",
    ],
    "simulate": [
        "simulate", "--fcd", str(SAMPLE / SAMPLE_TRACE), "--crs", "EPSG:2157",
        "--anchors", f"{STUDY}:anchors", "--estimator", "ekf", "--arm", "gps", "--runs", "1",
        "--no-bound", "--horizon", "10", "--overwrite",
    ],
}  # fmt: skip


def start(words: list[str]) -> subprocess.Popen[bytes]:
    """Start a verb as the leader of a group of its own, so that its children die with it."""
    return subprocess.Popen(
        [sys.executable, "-m", "covertool", *words],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )


@pytest.mark.slow
@pytest.mark.parametrize("verb", VERBS)
def test_kill_9_leaves_the_old_file_or_the_new_one(verb: str, tmp_path: Path) -> None:
    output = tmp_path / "out.gpkg"
    words = [*VERBS[verb], "-o", str(output)]
    started = time.perf_counter()
    assert start(words).wait() == 0
    whole_run_s = time.perf_counter() - started
    layers = pyogrio.list_layers(output).tolist()
    chance = random.Random(verb)
    output.write_bytes(old := b"the file that was there before")
    killed = 0
    for moment in range(MOMENTS):
        process = start(words)
        time.sleep(chance.uniform(0.3, 1.05) * whole_run_s)
        os.killpg(process.pid, signal.SIGKILL)
        killed += process.wait() == -signal.SIGKILL
        if output.read_bytes() != old:
            assert pyogrio.list_layers(output).tolist() == layers, f"broken at moment {moment}"
            output.write_bytes(old)
    assert killed >= MOMENTS // 4
    assert start(words).wait() == 0
    assert pyogrio.list_layers(output).tolist() == layers
    assert [path.name for path in tmp_path.iterdir()] == ["out.gpkg"]

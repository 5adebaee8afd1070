"""A long `covertool extract` is killed; taken up again it gives what an unbroken one does."""

import os
import signal
import time
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import rasterio
from rasterio.transform import Affine

from covertool.extract.windows import CORE_PX
from covertool.gis.sample import sample_folder
from tests.running import finished, start

WINDOWS = 3


@pytest.fixture
def long_image(tmp_path: Path) -> Path:
    """Return an image of three windows: the sample's orthophoto mirrored below itself."""
    with rasterio.open(sample_folder() / "orthophoto.tif") as photo:
        values = photo.read()[:, :, :512]
    strip = np.concatenate([values, values[:, ::-1], values], axis=1)[:, : WINDOWS * CORE_PX - 9]
    path = tmp_path / "long.tif"
    with rasterio.open(
        path, "w", driver="GTiff", width=strip.shape[2], height=strip.shape[1], count=3,
        dtype="uint8", crs="EPSG:2157", transform=Affine(0.2, 0, 693_380, 0, -0.2, 737_460),
    ) as out:  # fmt: skip
        out.write(strip)
    return path


@pytest.mark.slow
def test_a_killed_run_goes_on_where_it_was_and_gives_the_same(
    long_image: Path, tmp_path: Path
) -> None:
    ledger = tmp_path / "windows"
    words = ("extract", long_image, "--json")
    broken = start(*words, "-o", tmp_path / "resumed.gpkg", "--resume", ledger)
    until = time.monotonic() + 300
    while not list(ledger.glob("*.piece")) and time.monotonic() < until:
        time.sleep(0.02)
    os.killpg(broken.pid, signal.SIGKILL)
    assert broken.wait() == -signal.SIGKILL
    kept = {path: path.stat().st_mtime_ns for path in ledger.glob("*.piece")}
    assert 1 <= len(kept) < WINDOWS
    assert not (tmp_path / "resumed.gpkg").exists()
    resumed = finished(
        start(*words, "-o", tmp_path / "resumed.gpkg", "--resume", ledger, "--workers", 2)
    )
    assert len(list(ledger.glob("*.piece"))) == WINDOWS
    assert {path: path.stat().st_mtime_ns for path in kept} == kept
    unbroken = finished(start(*words, "-o", tmp_path / "unbroken.gpkg"))
    assert resumed["vehicles"] == unbroken["vehicles"]
    frames = [
        gpd.read_file(tmp_path / f"{name}.gpkg", layer="vehicles")
        for name in ("resumed", "unbroken")
    ]
    assert len(frames[0]) > 50
    assert frames[0].equals(frames[1])

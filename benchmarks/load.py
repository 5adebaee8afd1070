"""Large input through the command line: how long each takes, and the memory of all its processes.

python -m benchmarks.load [--quick]

Everything here is made up: one million parked cars, an image of 20,000 x 20,000 pixels, a feed of
250 MB and 5,000 moving cars. Memory is the largest sum of the resident memory of a command and its
workers, looked at every 50 ms.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import psutil
import pyarrow as pa
import pyarrow.parquet as pq
import rasterio
from rasterio.windows import Window

from benchmarks.rows import Row, main
from benchmarks.scale import found_country
from covertool.gis.sample import sample_folder

SPEED_MPS = 8.0
ON_STREETS_OF_M = 100.0


@dataclass(frozen=True)
class Spent:
    """What a command took: seconds by the clock, and the peak memory of all its processes."""

    seconds: float
    peak_mb: float


def command(*words: object) -> Spent:
    """Run a verb of covertool to its end; raise SystemExit with its words when it fails."""
    begun = time.perf_counter()
    with tempfile.TemporaryFile("w+") as told:
        child = psutil.Popen(
            [sys.executable, "-m", "covertool", *map(str, words)],
            stdout=subprocess.DEVNULL, stderr=told,
        )  # fmt: skip
        peak = 0
        while child.poll() is None:
            peak = max(peak, _resident(child))
            time.sleep(0.05)
        if child.returncode:
            told.seek(0)
            raise SystemExit(f"covertool {words[0]} failed: {told.read()[-500:]}")
    return Spent(time.perf_counter() - begun, peak / 2**20)


def _resident(child: psutil.Process) -> int:
    total = 0
    try:
        for process in [child, *child.children(recursive=True)]:
            total += process.memory_info().rss
    except psutil.NoSuchProcess:
        return 0
    return total


def mirrored(path: Path, side: int) -> None:
    """Write the sample study's orthophoto, mirrored again and again, as a large GeoTIFF."""
    with rasterio.open(sample_folder() / "orthophoto.tif") as photo:
        once = photo.read()
        profile = photo.profile | {"width": side, "height": side, "tiled": True, "BIGTIFF": "YES"}
    row = np.concatenate([once, once[:, :, ::-1]], axis=2)
    block = np.concatenate([row, row[:, ::-1]], axis=1)
    with rasterio.open(path, "w", **profile) as large:
        for top in range(0, side, block.shape[1]):
            for left in range(0, side, block.shape[2]):
                high, wide = min(block.shape[1], side - top), min(block.shape[2], side - left)
                large.write(block[:, :high, :wide], window=Window(left, top, wide, high))


def feed(path: Path, megabytes: int) -> int:
    """Write a DATEX II publication of about that size; return its measurement sites."""
    words = ("freeFlow", "heavy", "congested", "impossible")
    site = (
        '<siteMeasurements><measurementSiteReference id="{place}"/>'
        "<measurementTimeDefault>2014-06-16T11:59:00Z</measurementTimeDefault>"
        "<measuredValue><measuredValue><basicData><trafficStatus><trafficStatusValue>{word}"
        "</trafficStatusValue></trafficStatus></basicData></measuredValue></measuredValue>"
        "</siteMeasurements>"
    )
    sites = megabytes * 1_000_000 // len(site.format(place="site 1000000", word="congested"))
    with path.open("w", encoding="utf-8") as out:
        out.write(
            '<d2LogicalModel xmlns="http://datex2.eu/schema/2/2_0" '
            'xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"><payloadPublication>'
            "<publicationTime>2014-06-16T12:00:00Z</publicationTime>"
        )
        for number in range(sites):
            out.write(site.format(place=f"site {number}", word=words[number % 4]))
        out.write("</payloadPublication></d2LogicalModel>")
    return sites


def traffic(path: Path, cars: int, seconds: int, side_m: float) -> None:
    """Write a trace of cars that drive to and fro along the streets of benchmarks.scale."""
    rng = np.random.default_rng(3)
    streets = np.arange(ON_STREETS_OF_M / 2, side_m, ON_STREETS_OF_M)
    across, flat = rng.choice(streets, cars), rng.random(cars) < 0.5
    begin, onward = rng.uniform(0, side_m, cars), rng.random(cars) < 0.5
    columns: dict[str, list[np.ndarray]] = {}
    for second in range(seconds):
        gone = begin + np.where(onward, 1, -1) * SPEED_MPS * second
        along = np.abs((gone + side_m) % (2 * side_m) - side_m)
        ahead = onward ^ ((gone + side_m) % (2 * side_m) < side_m)
        step = {
            "timestep_time": np.full(cars, float(second)),
            "vehicle_id": np.char.add("car ", np.arange(cars).astype(str)),
            "vehicle_x": 600_000 + np.where(flat, along, across),
            "vehicle_y": 700_000 + np.where(flat, across, along),
            "vehicle_angle": np.where(flat, 90.0, 0.0) + np.where(ahead, 0.0, 180.0),
            "vehicle_speed": np.full(cars, SPEED_MPS),
        }
        for name, values in step.items():
            columns.setdefault(name, []).append(values)
    pq.write_table(pa.table({k: np.concatenate(v) for k, v in columns.items()}), path)


def rows(quick: bool) -> Iterator[Row]:
    """Yield seconds and memory of each load."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        anchors = 50_000 if quick else 1_000_000
        country = found_country(anchors, folder)
        yield from _spent(
            f"coverage of {anchors:,} anchors at 15 m, in tiles",
            command("coverage", "--anchors", country.cars, "--transit", country.roads,
                    "--radius", 15, "--tile", 5000), 1024,
        )  # fmt: skip
        side = 2_000 if quick else 20_000
        mirrored(folder / "large.tif", side)
        yield from _spent(
            f"extract --no-tta from {side:,} x {side:,} pixels, two workers",
            command(
                "extract",
                folder / "large.tif",
                "-o",
                folder / "cars.gpkg",
                "--workers",
                2,
                "--no-tta",
            ),
            1500,
        )
        megabytes = 10 if quick else 250
        sites = feed(folder / "feed.xml", megabytes)
        yield from _spent(
            f"congestion import of a feed of {megabytes} MB, {sites:,} sites",
            command("congestion", "import", "--format", "datex2", folder / "feed.xml",
                    "-o", folder / "observations.parquet"), 512,
        )  # fmt: skip
        moving, seconds = (200, 10) if quick else (5_000, 120)
        few = found_country(moving * 10, folder).cars
        side_m = 1000 * np.sqrt(moving * 10 / 1500)
        traffic(folder / "trace.parquet", moving, seconds, float(side_m))
        yield from _spent(
            f"simulate {moving:,} moving cars for {seconds} s among {moving * 10:,} anchors, "
            "GCPSO and EKF, 2 runs",
            command("simulate", "--fcd", folder / "trace.parquet", "--anchors", few, "--preset",
                    "paper", "--no-bound", "--runs", 2, "--crs", "EPSG:2157"), 1024,
        )  # fmt: skip


def _spent(work: str, found: Spent, most_mb: float) -> Iterator[Row]:
    yield Row(work, "the clock", (found.seconds,), "s", higher=False)
    yield Row(work, "memory of all its processes", (found.peak_mb,), "MB", False, most_mb)


if __name__ == "__main__":
    main(rows, __doc__)

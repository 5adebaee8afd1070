"""Growth of time and memory from 100,000 to 5 million anchors, in tiles read from GeoParquet.

python -m benchmarks.scale [--quick]
"""

from __future__ import annotations

import multiprocessing
import resource
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
import shapely
from pyproj import CRS

from benchmarks.rows import Row, main
from covertool.coverage.tiled import tiled_levels
from covertool.coverage.tiles import TileJob, plan_job
from covertool.gis.parquet import write_anchors
from covertool.gis.sources import open_anchors, open_transit, write_transit
from covertool.model import Anchors, TransitArea

ITM = CRS(2157)
STREETS_APART_M = 100.0
ANCHORS_PER_KM2 = 1500.0
HALF_STREET_M = 3.5
VILLAGE = 5_000


@dataclass(frozen=True)
class Country:
    """How many anchors there are, and the files of them and of the streets."""

    anchors: int
    cars: Path
    roads: Path


def found_country(anchors: int, folder: Path) -> Country:
    """Write a grid of streets and anchors along them, at one density whatever the number."""
    side = 1000 * np.sqrt(anchors / ANCHORS_PER_KM2)
    rng = np.random.default_rng(anchors)
    lines = np.arange(STREETS_APART_M / 2, side, STREETS_APART_M)
    along, across = rng.uniform(0, side, anchors), rng.normal(0, 5, anchors)
    street, flat = rng.choice(lines, anchors) + across, rng.random(anchors) < 0.5
    x, y = np.where(flat, along, street), np.where(flat, street, along)
    cars, roads = folder / f"cars_{anchors}.parquet", folder / f"roads_{anchors}.parquet"
    write_anchors(cars, Anchors.from_points(600_000 + x, 700_000 + y, ITM))
    write_transit(roads, TransitArea(shapely.MultiPolygon(list(_towns(lines))), ITM))
    return Country(anchors, cars, roads)


def _towns(lines: np.ndarray) -> Iterator[shapely.Polygon]:
    """Yield the streets in squares of 20 x 20 blocks, half a metre apart along their borders."""
    firsts = range(0, len(lines) - 1, 20)
    spans = [(first, min(first + 20, len(lines) - 1)) for first in firsts]
    for column in spans:
        for row in spans:
            (x0, x1), (y0, y1) = (_border(lines, *span) for span in (column, row))
            left, low = (lines[first:last] + HALF_STREET_M for first, last in (column, row))
            right, high = (lines[first + 1 : last + 1] - HALF_STREET_M
                           for first, last in (column, row))  # fmt: skip
            corners = np.meshgrid(left, low), np.meshgrid(right, high)
            blocks = shapely.box(*(part.ravel() for pair in corners for part in pair))
            town = shapely.Polygon(
                shapely.box(x0, y0, x1, y1).exterior, [block.exterior for block in blocks]
            )
            yield shapely.transform(town, lambda xy: xy + np.array([600_000.0, 700_000.0]))


def _border(lines: np.ndarray, first: int, last: int) -> tuple[float, float]:
    begin = lines[first] - (HALF_STREET_M if first == 0 else 0)
    end = lines[last] + (HALF_STREET_M if last == len(lines) - 1 else -0.5)
    return float(begin), float(end)


def job_of(country: Country, radius_m: float) -> TileJob:
    """Return the job whose tiles cover a country."""
    transit = open_transit(str(country.roads), None, None)
    source = open_anchors((str(country.cars),), None, transit.crs)
    return plan_job(source, transit, [radius_m], anchors_count=country.anchors)


def measure(country: Country, village: Country, radius_m: float, answer: Connection) -> None:
    """Run all tiles in this fresh process; send CPU seconds and the peak memory in MB.

    Seconds of the processor, not of the clock: other work on the machine then changes them less.
    A village loads the libraries and the compiled loops. Were it the first tile of the country
    itself, a town of one tile would be measured the second time it is run, and no other would.
    """
    job_of(village, radius_m)(0)
    job = job_of(country, radius_m)
    begun = time.process_time()
    report = tiled_levels(job)
    seconds = time.process_time() - begun
    assert sum(report.results[0].fractions) > 0.999
    answer.send((seconds, peak_mb()))


def peak_mb() -> float:
    """Return the peak memory of this process alone, in MB.

    On Linux ``ru_maxrss`` of a spawned process also counts the parent from before the spawn, and
    the parent has just made the whole country.
    """
    status = Path("/proc/self/status")
    lines = status.read_text().splitlines() if status.exists() else []
    for line in lines:
        if line.startswith("VmHWM:"):
            return float(line.split()[1]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def rows(quick: bool) -> Iterator[Row]:
    """Yield growth exponents, and the peak memory of the largest country over the smallest's."""
    sizes = [20_000, 100_000] if quick else [100_000, 500_000, 1_000_000, 5_000_000]
    with tempfile.TemporaryDirectory() as folder:
        village, *countries = (found_country(size, Path(folder)) for size in (VILLAGE, *sizes))
        for radius_m in (15.0,) if quick else (15.0, 100.0):
            turns = [
                [_measured(country, village, radius_m) for country in countries]
                for _ in range(1 if quick else 3)
            ]
            times = np.array([[found[0] for found in turn] for turn in turns])
            peaks = np.array([[found[1] for found in turn] for turn in turns])
            slopes = np.polyfit(np.log(sizes), np.log(times).T, 1)[0]
            work = f"tiles from GeoParquet, {radius_m:g} m, {sizes[0]:,} to {sizes[-1]:,} anchors"
            yield Row(
                f"{work}: growth of time", "itself", tuple(slopes.tolist()), "exponent", False, 1.05
            )
            memory = tuple((peaks[:, -1] / peaks[:, 0]).tolist())
            yield Row(f"{work}: peak memory, last over first", "itself", memory, "x", False)
            last = tuple(peaks[:, -1].tolist())
            yield Row(f"{work}: peak memory of the last", "", last, "MB", False, 1024)
            spent = tuple(times[:, -1].tolist())
            yield Row(f"{work}: processor time of the last", "", spent, "s", False)


def _measured(country: Country, village: Country, radius_m: float) -> tuple[float, float]:
    """Return the median of CPU seconds and of peak MB; short runs vary more, so they are more."""
    runs = [_run(country, village, radius_m) for _ in range(5 if country.anchors < 10**6 else 1)]
    seconds, memory = np.median(runs, axis=0)
    return float(seconds), float(memory)


def _run(country: Country, village: Country, radius_m: float) -> tuple[float, float]:
    context = multiprocessing.get_context("spawn")
    receive, send = context.Pipe(duplex=False)
    worker = context.Process(target=measure, args=(country, village, radius_m, send))
    worker.start()
    send.close()  # else a worker that dies would be waited for
    found: tuple[float, float] = receive.recv()
    worker.join()
    return found


if __name__ == "__main__":
    main(rows, __doc__)

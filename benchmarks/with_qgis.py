"""The areas of levels beside buffer, union and intersection in QGIS, where QGIS is installed.

The case is small, for QGIS is slow; its time is taken inside QGIS and leaves out its start.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import geopandas as gpd
import numpy as np

from benchmarks.coverage import engine, town
from benchmarks.rows import Row, main, seconds

PYTHON = "/usr/bin/python3"  # Debian's, which has QGIS beside it
RADIUS_M = 15.0


def rows(quick: bool) -> Iterator[Row]:
    """Yield the ratio, and how far the areas of both differ."""
    if not _has_qgis():
        print("QGIS is not installed beside /usr/bin/python3", file=sys.stderr)
        return
    anchors, transit = town(100 if quick else 1000)
    engine(anchors, transit, RADIUS_M)
    with tempfile.TemporaryDirectory() as folder:
        cars, roads = Path(folder) / "cars.fgb", Path(folder) / "roads.fgb"
        points = gpd.points_from_xy(anchors.x_m, anchors.y_m)
        gpd.GeoDataFrame(geometry=points, crs=anchors.crs).to_file(cars)
        gpd.GeoDataFrame(geometry=[transit.polygons], crs=transit.crs).to_file(roads)
        ratios = []
        for _ in range(1 if quick else 3):
            for made in Path(folder).glob("*.gpkg"):
                made.unlink()
            told = _in_qgis(cars, roads)
            ours = min(seconds(lambda: engine(anchors, transit, RADIUS_M)) for _ in range(3))
            ratios.append(told["seconds"] / ours)
    exact = np.array(engine(anchors, transit, RADIUS_M).areas_m2[1:])
    off = float(np.abs(exact - told["areas_m2"]).max() / transit.polygons.area)
    work = f"areas of {len(anchors.x_m)} discs, {RADIUS_M:g} m"
    beside = "QGIS: buffer, union, intersection"
    yield Row(work, beside, tuple(ratios))
    yield Row(f"{work}: greatest difference of a level's share", beside, (off,), "of 1", False)


def _has_qgis() -> bool:
    if not Path(PYTHON).exists():
        return False
    return subprocess.run([PYTHON, "-c", "import qgis.core"], capture_output=True).returncode == 0


def _in_qgis(cars: Path, roads: Path) -> dict[str, object]:
    plain = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "PROJ", "GDAL"))}
    script = str(Path(__file__).with_name("qgis_peer.py"))
    done = subprocess.run(
        [PYTHON, script, str(cars), str(roads), str(RADIUS_M)],
        env=plain | {"QT_QPA_PLATFORM": "offscreen"}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode:
        raise SystemExit(f"QGIS failed:\n{done.stderr}")
    return json.loads(done.stdout.strip().splitlines()[-1])


if __name__ == "__main__":
    main(rows, __doc__)

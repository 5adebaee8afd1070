"""Small towns made here, and what the tests of SUMO share."""

import importlib.util
import os
import subprocess
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import shapely

from covertool.traffic.sumo import find_sumo

# Importing sumo would point this process's PROJ at SUMO's database, which is too old for rasterio.
SPEC = importlib.util.find_spec("sumo")
needs_sumo = pytest.mark.skipif(SPEC is None, reason="SUMO is not installed")
SHARED = Path(__file__).parents[2] / "../shared/data/osm"


ORIGIN_M = np.array([693000.0, 737000.0])


def ladder(columns: int = 4, block_m: float = 200.0) -> gpd.GeoDataFrame:
    """Return two long through roads joined by rungs, in Irish Transverse Mercator."""
    width_m = block_m * (columns - 1)
    lines = [[(0, 0), (width_m, 0)], [(0, block_m), (width_m, block_m)]]
    lines += [[(k * block_m, 0), (k * block_m, block_m)] for k in range(columns)]
    moved = [shapely.LineString(np.array(line) + ORIGIN_M) for line in lines]
    kinds = ["main", "regional", *["collector"] * (columns - 1), "residential"]
    names = [f"Street {k}" for k in range(len(lines))]
    return gpd.GeoDataFrame(
        {"name": names, "kind": kinds, "width_m": 7.0}, geometry=moved, crs="EPSG:2157"
    )


def tool(name: str, folder: Path, *arguments: str) -> None:
    """Run one of SUMO's programs as SUMO's own user would."""
    sumo = find_sumo()
    command = [sumo.program(name), *arguments]
    subprocess.run(command, cwd=folder, env=dict(sumo.environment), check=True, capture_output=True)


def children() -> list[int]:
    """Return the process ids of our own children."""
    found: list[int] = []
    for task in Path(f"/proc/{os.getpid()}/task").iterdir():
        found += [int(pid) for pid in (task / "children").read_text().split()]
    return found

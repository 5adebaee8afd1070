"""The trace of the town run, for those who have no SUMO: the tool's own traffic, written down."""

from __future__ import annotations

import tempfile
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd

from covertool.gis.records import write_records
from covertool.traffic.demand import town_demand
from covertool.traffic.mobility import TIMEOUT_S
from covertool.traffic.network import network_from_streets
from covertool.traffic.run import run_sumo

TRAFFIC_SEED = 1


def write_trace(path: Path, streets: gpd.GeoDataFrame) -> None:
    """Write the town run of traffic seed 1 with SUMO's column names, in the study's CRS.

    It is what `covertool simulate` drives by default, so that both give the same places.
    """
    with tempfile.TemporaryDirectory() as folder:
        network = network_from_streets(streets, folder)
        demand = town_demand(network, seed=TRAFFIC_SEED)
        run = run_sumo(
            network, demand, Path(folder), seed=TRAFFIC_SEED, step_s=1.0, anchors=None,
            anchors_as="points", timeout_s=TIMEOUT_S,
        )  # fmt: skip
    if run.teleported or run.collided:
        raise RuntimeError("SUMO teleported cars or let them collide: choose another traffic seed")
    rows = run.rows
    x, y = network.projection.to_crs(rows.x, rows.y)
    frame = pd.DataFrame(
        {
            "timestep_time": rows.time_s.astype(np.float32),
            "vehicle_id": pd.Categorical(rows.vehicle),
            # SUMO writes centimetres; so do we, which keeps the file small.
            "vehicle_x": np.round(x, 2),
            "vehicle_y": np.round(y, 2),
            "vehicle_angle": np.round(rows.angle, 2).astype(np.float32),
            "vehicle_speed": np.round(rows.speed, 2).astype(np.float32),
        }
    ).sort_values(["vehicle_id", "timestep_time"], ignore_index=True)
    write_records(path, [frame], overwrite=True)

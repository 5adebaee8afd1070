"""A small made-up town as a study, with every layer and table that the report shows."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import geopandas as gpd
import pandas as pd
import pytest
import shapely

from covertool.gis.write import write_layers

EVIL = "<script>window.hacked = true</script>"
X, Y = 693_000.0, 737_000.0
SHARES = {15.0: (0.4, 0.3, 0.2, 0.1), 100.0: (0.05, 0.15, 0.25, 0.55)}
AREA_M2 = 40_000.0


def _box(x0: float, y0: float, x1: float, y1: float) -> shapely.Polygon:
    return shapely.box(X + x0, Y + y0, X + x1, Y + y1)


def _layer(geometry: list[Any], **columns: Any) -> gpd.GeoDataFrame:
    return gpd.GeoDataFrame(columns, geometry=geometry, crs=2157)


def town_layers() -> dict[str, gpd.GeoDataFrame]:
    """A road of 400 m by 100 m; Levels 1 to 3 are bands of it, from west to east."""
    layers = {
        "buildings": _layer(
            [_box(150, 120, 250, 180), _box(80, 120, 120, 180)],
            kind=["hall", "house"], height_m=[12.5, 7.0],
        ),
        "transit": _layer([_box(0, 0, 400, 100)], id=["road"], area_m2=[AREA_M2]),
        "zones": _layer([_box(0, 0, 200, 100), _box(200, 0, 400, 100)], zone=["West", EVIL]),
        "segments": _layer(
            [shapely.LineString([(X, Y + 50), (X + 400, Y + 50)])],
            segment_id=["s1"], name=[EVIL], length_m=[400.0],
        ),
        "congestion": _layer(
            [shapely.LineString([(X, Y + 20), (X + 400, Y + 20)])],
            segment_id=["s1"], status=["slow"], kind=["occupied"], queue_m=[80.0],
            length_m=[400.0], day=["2014-06-16"], window=["evening"],
        ),
        "trajectories": _layer(
            [shapely.LineString([(X, Y + 80), (X + 400, Y + 80)])],
            vehicle=["car 7"], mean_error_m=[3.25],
        ),
        "anchors": _layer(
            [shapely.Point(X + 390, Y + 90), shapely.Point(X + 395, Y + 10)],
            id=["parked 1", "queued 1"], radius_m=[15.0, 15.0], origin=["parked", "queue"],
        ),
    }  # fmt: skip
    for level, x in ((1, 0), (2, 100), (3, 200)):
        layers[f"coverage_level_{level}"] = _layer(
            [_box(x, 0, x + 100, 100), _box(x, 0, x + 50, 100)],
            level=[level, level], radius_m=[15.0, 100.0], device_class=[None, None],
            area_m2=[10_000.0, 5_000.0],
        )  # fmt: skip
    return layers


def _long(rows: list[dict[str, Any]], value: str = "fraction") -> pd.DataFrame:
    """Return each row once for each level."""
    return pd.DataFrame(
        [
            {**{key: v for key, v in row.items() if key != "shares"}, "level": level, value: share}
            for row in rows
            for level, share in enumerate(row["shares"])
        ]
    )


def town_tables() -> dict[str, pd.DataFrame]:
    summary = _long([{"radius_m": r, "device_class": None, "shares": s} for r, s in SHARES.items()])
    summary["area_m2"] = summary["fraction"] * AREA_M2
    curve = _long([{"radius_m": r, "shares": s} for r, s in SHARES.items()])
    shares = {0.1: (0.9, 0.06, 0.03, 0.01), 1.0: SHARES[15.0]}
    penetration = _long(
        [
            {"share": p, "radius_m": 15.0, "device_class": None, "shares": s}
            for p, s in shares.items()
        ],
        "expected",
    )
    zones = _long(
        [
            {"zone": name, "radius_m": 15.0, "transit_area_m2": 20_000.0, "shares": SHARES[15.0]}
            for name in ("West", EVIL)
        ]
    )
    cell = {"filled_percent": 3.5, "days": 1, "observed_fraction": 1.0}
    occupancy = pd.DataFrame(
        [
            {"day": "Monday", "window": "lunch", "percent": 22.64, **cell},
            {"day": "Monday", "window": "evening", "percent": None, **cell},
        ]
    )
    means = pd.DataFrame(
        [{"group": "weekday", "window": "lunch", "percent": 22.64, "filled_percent": 3.5}]
    )
    return {
        "coverage_summary": summary,
        "coverage_curve": curve,
        "coverage_penetration": penetration,
        "coverage_zones": zones,
        "occupancy": occupancy,
        "occupancy_means": means,
        "positioning": _positioning(),
        "improvements": _improvements(),
        "parked_met": pd.DataFrame(
            [{"vehicle": EVIL, "scenario": 0, "met_per_km": 12.1, "percent": 31.0}]
        ),
    }


def _positioning() -> pd.DataFrame:
    errors = {"sd_error_m": 2.0, "rmse_m": 7.0, "median_error_m": 6.0, "p95_error_m": 12.0}
    ranging = {"estimator": "ekf", "preset": "paper", "sigma_range_m": 0.2, "radius_m": 15.0}
    alone = dict.fromkeys(ranging)
    return pd.DataFrame(
        [
            {"arm": "gps", **alone, "mean_error_m": 7.52, "bound_rmse_m": None},
            {"arm": "traditional", **ranging, "mean_error_m": 6.88, "bound_rmse_m": 2.5},
            {"arm": "proposed", **ranging, "mean_error_m": 6.45, "bound_rmse_m": 2.25},
        ]
    ).assign(vehicle="all", **errors)


def _improvements() -> pd.DataFrame:
    case = {"estimator": "ekf", "preset": "paper", "sigma_range_m": 0.2, "radius_m": 15.0}
    return pd.DataFrame(
        [{**case, "vehicle": "all", "percent": 6.25, "ci95_low": 5.5, "ci95_high": 7.0}]
    )


@pytest.fixture(scope="session")
def make_study() -> Callable[..., Path]:
    """Return a function that writes the town, or what is named of it, as a GeoPackage."""

    def make(path: Path, *names: str, metadata: dict[str, str] | None = None) -> Path:
        parts: dict[str, Any] = {**town_layers(), **town_tables()}
        chosen = {name: parts[name] for name in names} if names else parts
        told = {"title": "Made-up town", "synthetic": "yes"} if metadata is None else metadata
        write_layers(path, chosen, metadata=told)
        return path

    return make

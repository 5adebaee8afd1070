"""Traces in SUMO's column names (FCD): CSV, XML and Parquet become true positions of cars."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from covertool.errors import ColumnError, GeometryError
from covertool.model import Floats, Objects, Trace
from covertool.model.tables import by_car
from covertool.traffic.fcd import FcdRows, read_rows
from covertool.traffic.projection import Projection

CAR_LENGTH_M = 5.0
"""Length of a passenger car where SUMO's vehicle types name none."""
_AHEAD_M = 1.0
_STEP_TOLERANCE_S = 1e-6
_FARTHEST_M = 1e9  # no projected system of the Earth has coordinates beyond


def read_fcd(
    path: str | Path,
    *,
    projection: Projection | None = None,
    length_m: float | Mapping[str, float] = CAR_LENGTH_M,
    horizon_s: float | None = None,
) -> Trace:
    """Return the trace of a file with SUMO's floating car data.

    SUMO gives the middle of the front bumper and the heading; the centre of the car is half a
    length behind. Persons, containers and rows without a position are left out.

    Parameters
    ----------
    path : CSV, XML (also gzipped) or Parquet with SUMO's names: time, id, x, y, angle, speed
    projection : how x and y become metres; taken as metres when None
    length_m : length of all cars, or of each by id; ids that are not named take 5 m
    horizon_s : rows from this time on are left out

    Raises
    ------
    ColumnError
        When a column is missing or holds what is no number.
    GeometryError
        When the file holds no car.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "fcd.csv"
    ...     _ = path.write_text("time;id;x;y;angle;speed\\n0;a;100;50;90;10\\n")
    ...     trace = read_fcd(path)
    >>> print(float(trace.x_m[0]), float(trace.y_m[0]), round(float(trace.vx[0]), 3))
    97.5 50.0 10.0
    """
    rows = read_rows(path)
    if horizon_s is not None:
        rows = rows.take(rows.time_s < horizon_s)
    if not len(rows):
        raise GeometryError(
            "the trace holds no vehicle", str(path), "record it while cars drive, from --begin on"
        )
    return trace_of(rows, str(path), projection=projection, length_m=length_m)


def trace_of(
    rows: FcdRows,
    where: str,
    *,
    projection: Projection | None = None,
    length_m: float | Mapping[str, float] = CAR_LENGTH_M,
) -> Trace:
    """Return rows of floating car data as a trace of the cars' centres.

    Parameters
    ----------
    rows : as SUMO writes them
    where : the file, for messages
    projection, length_m : as in `read_fcd`

    Raises
    ------
    ColumnError, GeometryError
        When a car stands twice at one time, a place lies beyond the coordinate system, or the times
        are no whole steps apart.
    """
    _refuse_twice(rows, where)
    east, north = np.sin(np.radians(rows.angle)), np.cos(np.radians(rows.angle))
    half_m = _lengths_m(rows.vehicle, length_m) / 2
    x, y = rows.x, rows.y
    if projection is not None and projection.source.is_geographic:
        x, y = projection.to_crs(x, y)
        projection = None
    x, y = x - east * half_m, y - north * half_m
    if projection is not None:
        ahead = projection.to_crs(x + east * _AHEAD_M, y + north * _AHEAD_M)
        x, y = projection.to_crs(x, y)
        # The grid of the working CRS may be turned against that of the net.
        east, north = _unit(ahead[0] - x, ahead[1] - y)
    _require_places(x, y, where)
    return Trace(
        time_s=rows.time_s,
        vehicle=rows.vehicle,
        x_m=x,
        y_m=y,
        vx=rows.speed * east,
        vy=rows.speed * north,
        step_s=_step_s(rows.time_s, where),
    )


def _lengths_m(vehicle: Objects, length_m: float | Mapping[str, float]) -> Floats:
    if not isinstance(length_m, Mapping):
        return np.full(vehicle.size, float(length_m))
    return np.array([length_m.get(name, CAR_LENGTH_M) for name in vehicle], dtype=float)


def _unit(dx: Floats, dy: Floats) -> tuple[Floats, Floats]:
    size = np.hypot(dx, dy)
    return dx / size, dy / size


def _require_places(x: Floats, y: Floats, where: str) -> None:
    if not ((np.abs(x) < _FARTHEST_M) & (np.abs(y) < _FARTHEST_M)).all():
        raise GeometryError(
            "some positions do not lie within the coordinate system",
            where,
            "check --net-crs or --crs: the coordinates are of another system",
        )


def _refuse_twice(rows: FcdRows, where: str) -> None:
    order = by_car(rows.vehicle, rows.time_s)
    time, name = rows.time_s[order], rows.vehicle[order]
    same = (np.diff(time) == 0) & (name[1:] == name[:-1])
    if same.any():
        row = int(np.flatnonzero(same)[0])
        raise GeometryError(
            f"vehicle {name[row]} stands twice at {time[row]:g} s",
            where,
            "give one recording at a time; name the cars of each apart",
        )


def _step_s(time_s: Floats, where: str) -> float:
    """Return the time between two steps, of which every gap must be a multiple."""
    times = np.unique(time_s)
    if times.size == 1:
        return 1.0
    gaps = np.diff(times)
    step = float(gaps.min())
    parts = gaps / step
    if np.abs(parts - np.round(parts)).max() * step > max(_STEP_TOLERANCE_S, 0.005 * step):
        raise ColumnError(
            f"the times are not whole steps of {step:g} s apart",
            where,
            "record with one step length (--step-length), all cars at the same moments",
        )
    return round(step, 9)

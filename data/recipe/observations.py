"""A synthetic week of congestion observations on the main streets."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone

import numpy as np
import pandas as pd

from data.recipe.parameters import stream

_MONDAY = datetime(2014, 6, 16, tzinfo=timezone(timedelta(hours=1)))
_EVERY_MINUTES = 30
_HOURS = (7, 21)
_BANDS = ((0.75, "free"), (0.25, "slow"), (0.10, "very_slow"), (-1.0, "stationary"))
_PEAKS = ((8.5, 1.0, 0.9), (13.0, 1.0, 0.8), (17.5, 1.4, 1.0), (19.5, 0.9, 0.85))
"""Hour, width in hours and strength of each rush."""


def observe(segments: pd.DataFrame) -> pd.DataFrame:
    """Return one row for each segment and half hour of a week: speed and status.

    The demand of the hour, of the day and of the segment make its speed relative to free flow;
    the status follows from it by the bands 0.75, 0.25 and 0.10.
    """
    rng = stream("observations")
    proneness = rng.normal(0.0, 0.75, len(segments))
    rows = []
    for day in range(7):
        busy = 1.0 if day < 5 else 0.72
        mood = rng.normal(0.0, 0.12)
        for minutes in range(_HOURS[0] * 60, _HOURS[1] * 60 + 1, _EVERY_MINUTES):
            when = _MONDAY + timedelta(days=day, minutes=minutes)
            load = busy * _demand(minutes / 60.0) + mood
            strain = 2.1 * load + proneness + rng.normal(0.0, 0.35, len(segments)) - 2.9
            relative = 1.0 / (1.0 + np.exp(2.2 * strain))
            speeds = segments["free_flow_kmh"].to_numpy() * np.clip(relative, 0.02, 0.99)
            rows += [
                (when.isoformat(), name, round(float(speed), 1), _status(float(share)))
                for name, speed, share in zip(segments["segment_id"], speeds, relative, strict=True)
            ]
    return pd.DataFrame(rows, columns=["time", "segment_id", "speed_kmh", "status"])


def _demand(hour: float) -> float:
    return max(peak * float(np.exp(-(((hour - at) / width) ** 2))) for at, width, peak in _PEAKS)


def _status(relative: float) -> str:
    return next(word for least, word in _BANDS if relative >= least)

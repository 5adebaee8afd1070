"""Polylines as (N, 2) arrays: smoothing, resampling, and the frame at a distance along them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Points = npt.NDArray[np.float64]


def smooth(corners: Points, rounds: int = 3) -> Points:
    """Round the corners of a polyline (Chaikin's corner cutting); the ends stay."""
    points = np.asarray(corners, dtype=float)
    for _ in range(rounds):
        first, second = points[:-1], points[1:]
        cut = np.stack([0.75 * first + 0.25 * second, 0.25 * first + 0.75 * second], axis=1)
        points = np.vstack([points[:1], cut.reshape(-1, 2)[1:-1], points[-1:]])
    return points


def distances(points: Points) -> npt.NDArray[np.float64]:
    """Return the distance of each vertex from the start, along the line, in metres."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])


def length_m(points: Points) -> float:
    """Return the length of a polyline."""
    return float(distances(points)[-1])


def resample(points: Points, step_m: float) -> Points:
    """Return the polyline with vertices at equal steps, about ``step_m`` apart."""
    along = distances(points)
    count = max(round(along[-1] / step_m), 1)
    at = np.linspace(0.0, along[-1], count + 1)
    return np.column_stack([np.interp(at, along, points[:, k]) for k in (0, 1)])


def frame(points: Points, at_m: float) -> tuple[Points, Points]:
    """Return the place at a distance along the line and the unit vector along it."""
    along = distances(points)
    place = np.array([np.interp(at_m, along, points[:, k]) for k in (0, 1)])
    row = int(np.clip(np.searchsorted(along, at_m, side="right") - 1, 0, len(points) - 2))
    step = points[row + 1] - points[row]
    return place, step / np.hypot(*step)


def left_of(direction: Points) -> Points:
    """Return the unit vector to the left of a direction."""
    return np.array([-direction[1], direction[0]])


def heading_deg(direction: Points) -> float:
    """Return the heading of a direction, clockwise from grid north, 0 to 360."""
    return float(np.degrees(np.arctan2(direction[0], direction[1])) % 360.0)


def rectangle(centre: Points, along: Points, length_m: float, width_m: float) -> Points:
    """Return the four corners of a rectangle that lies along a direction."""
    a, b = along * length_m / 2, left_of(along) * width_m / 2
    return np.array([centre + a + b, centre + a - b, centre - a - b, centre - a + b])

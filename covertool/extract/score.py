"""Detections held against labels: precision, recall, F1, counts, centres, angles, parked or not."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from covertool.errors import FileError
from covertool.model import Floats, Integers, Objects, Vehicles

TOLERANCE_M = 1.5
"""A detection matches a label when their centres are no further apart."""

IGNORE_RIM_M = 0.5
BORDER_M = 0.8
_CARS = ("obb", "aabb", "point")


@dataclass(frozen=True)
class Labels:
    """Cars labelled in an image, in its pixels, and circles that count neither way.

    Attributes
    ----------
    x_px, y_px : (N,) centres
    heading_deg : (N,) clockwise from the image's up, 0-180; NaN where the label has no angle
    parked : (N,) object array of True, False or None
    ignore_x_px, ignore_y_px, ignore_radius_px : (M,) circles
    """

    x_px: Floats
    y_px: Floats
    heading_deg: Floats
    parked: Objects
    ignore_x_px: Floats
    ignore_y_px: Floats
    ignore_radius_px: Floats

    @classmethod
    def from_geojson(cls, content: bytes, where: str) -> Labels:
        """Return the labels of a FeatureCollection in pixel coordinates.

        Raises
        ------
        FileError
            When the content is no such collection.
        """
        try:
            features = json.loads(content)["features"]
            cars = [f for f in features if f["properties"]["kind"] in _CARS]
            circles = [f["properties"] for f in features if f["properties"]["kind"] == "ignore"]
            return cls(
                x_px=_column(cars, "cx"),
                y_px=_column(cars, "cy"),
                heading_deg=np.array([_heading(car) for car in cars], dtype=float),
                parked=_flags(cars),
                ignore_x_px=np.array([float(c["cx"]) for c in circles]),
                ignore_y_px=np.array([float(c["cy"]) for c in circles]),
                ignore_radius_px=np.array([float(c["radius_px"]) for c in circles]),
            )
        except (ValueError, KeyError, TypeError) as error:
            raise FileError(
                f"the labels cannot be read ({type(error).__name__}: {error})",
                where,
                "give a GeoJSON in pixel coordinates with kind, cx and cy (radius_px for ignore)",
            ) from None


@dataclass(frozen=True)
class Score:
    """How detections compare with labels.

    Attributes
    ----------
    true_positives, false_positives, false_negatives : counts
    count_error : detections over labels, less 1
    median_centre_error_m : of matched cars; NaN without any
    median_angle_error_deg : of matched cars whose label has an angle; NaN without any
    parked_precision, parked_recall : among matched cars labelled parked or not; None without any
    """

    true_positives: int
    false_positives: int
    false_negatives: int
    median_centre_error_m: float
    median_angle_error_deg: float
    parked_precision: float | None
    parked_recall: float | None
    tolerance_m: float = TOLERANCE_M

    @property
    def precision(self) -> float:
        """Return the share of detections that are cars."""
        return _share(self.true_positives, self.true_positives + self.false_positives)

    @property
    def recall(self) -> float:
        """Return the share of cars that were detected."""
        return _share(self.true_positives, self.true_positives + self.false_negatives)

    @property
    def f1(self) -> float:
        """Return the harmonic mean of precision and recall."""
        missed = self.false_positives + self.false_negatives
        return _share(2 * self.true_positives, 2 * self.true_positives + missed)

    @property
    def count_error(self) -> float:
        """Return by which share the detections are more (or fewer) than the labels."""
        return _share(
            self.false_positives - self.false_negatives, self.true_positives + self.false_negatives
        )

    def to_json(self) -> dict[str, Any]:
        """Return the figures by the names that `covertool extract --json` promises."""
        return {
            "precision": self.precision,
            "recall": self.recall,
            "f1": self.f1,
            "count_error": self.count_error,
            "tolerance_m": self.tolerance_m,
            "parked_precision": self.parked_precision,
            "parked_recall": self.parked_recall,
            "median_centre_error_m": self.median_centre_error_m,
            "median_angle_error_deg": self.median_angle_error_deg,
            "true_positives": self.true_positives,
            "false_positives": self.false_positives,
            "false_negatives": self.false_negatives,
        }


def score(
    vehicles: Vehicles, labels: Labels, gsd_m: tuple[float, float], size_px: tuple[int, int]
) -> Score:
    """Return how the vehicles of one image compare with its labels.

    Best scores first, each detection takes the nearest free label within 1.5 m. An unmatched
    detection inside an ignore circle (and 0.5 m around it) or within 0.8 m of the image's border
    counts neither way.

    Parameters
    ----------
    vehicles : of this image only
    labels : of this image
    gsd_m : ground size of a pixel along x and y
    size_px : width and height of the image
    """
    x, y = vehicles.image_x_px * gsd_m[0], vehicles.image_y_px * gsd_m[1]
    label_x, label_y = labels.x_px * gsd_m[0], labels.y_px * gsd_m[1]
    match = _match(x, y, vehicles.score, label_x, label_y)
    hit = match >= 0
    found = match[hit]
    excused = _excused(x, y, labels, gsd_m, size_px)
    distance = np.hypot(x[hit] - label_x[found], y[hit] - label_y[found])
    # The image is taken as north up, so that its up is the heading's grid north.
    turn = np.abs(vehicles.heading_deg[hit] - labels.heading_deg[found]) % 180
    turn = np.minimum(turn, 180 - turn)
    parked = _parked_shares(vehicles.parked[hit], labels.parked[found])
    return Score(
        true_positives=int(hit.sum()),
        false_positives=int((~hit & ~excused).sum()),
        false_negatives=int(len(label_x) - hit.sum()),
        median_centre_error_m=_median(distance),
        median_angle_error_deg=_median(turn[np.isfinite(turn)]),
        parked_precision=parked[0],
        parked_recall=parked[1],
    )


def _match(x: Floats, y: Floats, rank: Floats, to_x: Floats, to_y: Floats) -> Integers:
    """Return for each detection the label that it takes, or -1."""
    match = np.full(x.size, -1, dtype=np.int64)
    free = np.ones(to_x.size, dtype=bool)
    for i in np.argsort(-rank, kind="stable"):
        away = np.where(free, np.hypot(to_x - x[i], to_y - y[i]), np.inf)
        if away.size and away.min() <= TOLERANCE_M:
            match[i] = int(away.argmin())
            free[match[i]] = False
    return match


def _excused(
    x: Floats, y: Floats, labels: Labels, gsd_m: tuple[float, float], size_px: tuple[int, int]
) -> npt.NDArray[np.bool_]:
    width_m, height_m = size_px[0] * gsd_m[0], size_px[1] * gsd_m[1]
    rim = np.minimum.reduce([x, y, width_m - x, height_m - y]) < BORDER_M
    away = np.hypot(
        x[:, None] - labels.ignore_x_px * gsd_m[0], y[:, None] - labels.ignore_y_px * gsd_m[1]
    )
    reach = labels.ignore_radius_px * math.sqrt(gsd_m[0] * gsd_m[1]) + IGNORE_RIM_M
    excused: npt.NDArray[np.bool_] = rim | (away <= reach).any(axis=1)
    return excused


def _parked_shares(said: Objects, true: Objects) -> tuple[float | None, float | None]:
    """Return precision and recall of the parked flag where both the car and the label have one."""
    pairs = [(s, t) for s, t in zip(said, true, strict=True) if s is not None and t is not None]
    if not pairs:
        return None, None
    both = sum(1 for s, t in pairs if s and t)
    claimed, real = sum(bool(s) for s, _ in pairs), sum(bool(t) for _, t in pairs)
    return (both / claimed if claimed else None), (both / real if real else None)


def _heading(feature: dict[str, Any]) -> float:
    """Return the direction of the longest side of an oriented label, else NaN."""
    if feature["properties"]["kind"] != "obb":
        return math.nan
    ring = shapely.get_coordinates(shapely.from_geojson(json.dumps(feature["geometry"])))
    sides = np.diff(ring, axis=0)
    longest = sides[np.argmax(np.hypot(*sides.T))]
    return math.degrees(math.atan2(longest[0], -longest[1])) % 180


def _column(features: list[dict[str, Any]], key: str) -> Floats:
    return np.array([float(feature["properties"][key]) for feature in features], dtype=float)


def _flags(features: list[dict[str, Any]]) -> Objects:
    flags = np.full(len(features), None, dtype=object)
    flags[:] = [feature["properties"].get("parked") for feature in features]
    return flags


def _median(values: Floats) -> float:
    return float(np.median(values)) if values.size else math.nan


def _share(part: float, whole: float) -> float:
    return part / whole if whole else math.nan

"""The data dictionary: what each column of a study's layers and tables means, with its unit."""

from __future__ import annotations

from collections.abc import Mapping

from covertool.model.sheets import Heading

_WORDS: Mapping[str, tuple[str, str, int | None]] = {
    # name: (meaning, unit, decimals to show)
    "id": ("name of the row, unique in its layer", "", None),
    "x_m": ("easting of the centre", "m", 2),
    "y_m": ("northing of the centre", "m", 2),
    "radius_m": ("radius of the disc that a stationary car reaches", "m", None),
    "device_class": ("FCC class of the DSRC device: A 15, B 100, C 400, D 1000 m", "", None),
    "sigma_m": ("standard deviation of the anchor's own position", "m", 2),
    "origin": ("why the car is an anchor: parked, queue, rsu", "", None),
    "anchors": ("anchors that the figures count", "", None),
    "level": ("stationary cars heard: 1 one, 2 two, 3 three or more, 0 none", "", None),
    "area_m2": ("area", "m2", 0),
    "transit_area_m2": ("area where cars drive", "m2", 0),
    "fraction": ("share of the transit area", "1", 4),
    "slope_per_m": ("change of that share with the radius", "1/m", 5),
    "share": ("share of the cars that carry a device", "1", 2),
    "expected": ("expected share of the transit area", "1", 4),
    "se": ("standard error of that share", "1", 4),
    "zone": ("name of the zone", "", None),
    "heading_deg": (
        "heading, clockwise from grid north; below 180 if the front is unknown",
        "°",
        1,
    ),
    "length_m": ("length", "m", 2),
    "width_m": ("width", "m", 2),
    "score": ("certainty of the detector, 0 to 1", "1", 2),
    "site": ("where the car stands: on_street, lot, off_street, carriageway", "", None),
    "parked": ("whether the car is parked; empty when not known", "", None),
    "image": ("photograph that shows the car", "", None),
    "image_x_px": ("column of the centre in the photograph", "px", 1),
    "image_y_px": ("row of the centre in the photograph", "px", 1),
    "segment_id": ("name of the monitored street segment", "", None),
    "lanes": ("lanes in this direction", "", None),
    "free_flow_kmh": ("speed when nothing is in the way", "km/h", 1),
    "speed_kmh": ("observed speed", "km/h", 1),
    "day": ("day of the week", "", None),
    "window": ("time of the day looked at", "", None),
    "group": ("days that a mean is over", "", None),
    "count": ("values that a mean is over", "", None),
    "text": ("the mean rounded half up", "", None),
    "percent": ("flagged length: street length whose traffic is slow or stands", "%", 2),
    "filled_percent": ("street length that queued cars themselves fill", "%", 2),
    "days": ("days observed", "", None),
    "observed_fraction": ("share of the length of which anything is known", "1", 3),
    "ci95_low": ("lower end of the 95 % confidence interval", "as the value", 2),
    "ci95_high": ("upper end of the 95 % confidence interval", "as the value", 2),
    "arm": (
        "traditional: moving cars only; proposed: parked cars too; gps; gps_odometry",
        "",
        None,
    ),
    "estimator": ("how a car computes its place: gcpso, ekf, second_order", "", None),
    "preset": ("paper: as printed; best: tuned by theory", "", None),
    "sigma_range_m": ("standard deviation of a measured distance", "m", None),
    "vehicle": ("car, or all of them", "", None),
    "samples": ("cars times steps times runs behind the figures", "", None),
    "diverged": ("cars whose estimate ran away, counted once a run", "", None),
    "mean_error_m": ("mean position error", "m", 2),
    "sd_error_m": ("standard deviation of the position error", "m", 2),
    "rmse_m": ("root mean square position error", "m", 2),
    "median_error_m": ("median position error", "m", 2),
    "p95_error_m": ("95th percentile of the position error", "m", 2),
    "bound_rmse_m": ("smallest root mean square error that is possible (PCRB)", "m", 2),
    "nees": ("normalised squared error; 2 for an honest filter", "1", 2),
    "rmse_over_bound": ("root mean square error over its bound", "1", 2),
    "scenario": ("number of the traffic and parked layout", "", None),
    "met": ("parked cars that came within reach on the way", "", None),
    "path_km": ("length of the way", "km", 2),
    "met_per_km": ("parked cars met by kilometre", "1/km", 2),
    "name": ("name", "", None),
    "kind": ("kind", "", None),
    "height_m": ("height", "m", 1),
}
COLUMNS = tuple(_WORDS)
"""Every column that covertool writes of its own."""

_IN_TABLE: Mapping[tuple[str, str], str] = {
    ("improvements", "percent"): "mean position error that parked cars take off",
    ("parked_met", "percent"): "mean position error that parked cars take off",
}
_LABELS = {"filled_percent": "filled length (%)", "text": "rounded"}
_PERCENT_LABELS = {"improvements": "improvement (%)", "parked_met": "improvement (%)"}
_DIGITS_BY_ENDING = {"_m": 2, "_m2": 0, "_percent": 2, "_fraction": 4, "_s": 1, "_deg": 1}


def meaning(column: str, table: str = "") -> tuple[str, str]:
    """Return what a column of a table means and its unit; both empty for one of the user's own.

    >>> meaning("area_m2")
    ('area', 'm2')
    """
    if column not in _WORDS:
        return "", ""
    words, unit, _ = _WORDS[column]
    return _IN_TABLE.get((table, column), words), unit


def heading(column: str, table: str = "") -> Heading:
    """Return how a column of a table is headed: its name in words, and its unit.

    >>> heading("mean_error_m").label
    'mean error (m)'
    """
    unit = _WORDS[column][1] if column in _WORDS else ""
    if column == "percent":
        return Heading(column, _PERCENT_LABELS.get(table, "flagged length (%)"), 2)
    return Heading(column, _LABELS.get(column, _label(column, unit)), _digits(column))


def _label(column: str, unit: str) -> str:
    words = column
    if unit in ("m", "m2", "px"):
        words = column.removesuffix(f"_{unit}")
    words = words.removesuffix("_deg").removesuffix("_kmh").removesuffix("_per_m").replace("_", " ")
    return f"{words} ({unit})" if unit not in ("", "1", "as the value") else words


def _digits(column: str) -> int | None:
    if column in _WORDS:
        return _WORDS[column][2]
    return next((n for end, n in _DIGITS_BY_ENDING.items() if column.endswith(end)), None)

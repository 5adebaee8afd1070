"""The tracks of moving cars on the map, in classes of their mean error."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from covertool.model import Floats
from covertool.report.page import theme
from covertool.report.page.maplayer import MapLayer, shapes_of
from covertool.report.page.popups import Columns, metres, plain, texts
from covertool.report.page.study import ReportStudy

if TYPE_CHECKING:
    import geopandas as gpd

_TRACK_COLUMNS: Columns = {
    "vehicle": ("Car", str),
    "mean_error_m": ("Mean error", metres),
    "traditional_m": ("Without parked cars", metres),
    "percent": ("Taken off", lambda v: f"{v:.1f} %"),
    "met": ("Parked cars met", plain),
    "met_per_km": ("Met per km", plain),
    "estimator": ("Estimator", str),
    "radius_m": ("Zone", metres),
    "sigma_range_m": ("Range noise", metres),
}


def track_layers(frame: gpd.GeoDataFrame, _: ReportStudy) -> list[MapLayer]:
    """Return one layer for each class of mean error, the largest error on top."""
    errors = np.full(len(frame), np.nan)
    if "mean_error_m" in frame:
        errors = frame["mean_error_m"].to_numpy(dtype=float, na_value=np.nan)
    classes = [("tracks", "Tracks of cars, error not known", theme.MUTED, np.isnan(errors))]
    edges = _round_edges(errors)
    # The smallest errors have the last colour, however many classes there are.
    for i, (low, high) in enumerate(pairwise(edges)):
        label = f"Track, mean error {low:g} to {high:g} m"
        inside = (errors >= low) & (errors < high)
        classes.append((f"tracks-{i}", label, theme.ERRORS[len(theme.ERRORS) - 1 - i], inside))
    return [
        MapLayer(key, label, "line", shapes_of(frame[rows]), texts(frame[rows], _TRACK_COLUMNS),
                 colour, shown=False, width=1.8)
        for key, label, colour, rows in classes
        if rows.any()
    ]  # fmt: skip


def _round_edges(errors: Floats) -> list[float]:
    """Return round edges of up to five classes that hold all the errors.

    >>> _round_edges(np.array([0.4, 9.9]))
    [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]
    """
    top = float(np.nanmax(errors, initial=0.0))
    most = len(theme.ERRORS)
    step = next((s for s in (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0) if s * most > top), top)
    count = min(int(top // step) + 1, most)
    edges = [step * i for i in range(count + 1)]
    return [*edges[:-1], float(np.nextafter(top, np.inf))] if edges[-1] <= top else edges

"""The ways of cars as lines, with what parked cars saved each of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import shapely
from pyproj import CRS

from covertool.model import CarErrors, Trace, TransitArea
from covertool.model.tables import by_car
from covertool.traffic.encounters import Encounters

if TYPE_CHECKING:
    import geopandas as gpd


DRIVEN_M = 10.0
"""How far around the cars' places they are taken to drive, where no transit area is known."""


def trajectories(
    trace: Trace, crs: CRS, met: Encounters, errors: Sequence[CarErrors]
) -> gpd.GeoDataFrame:
    """Return one line a car: its way, the parked cars that it met, and its mean errors.

    ``mean_error_m`` is of the first case with parked cars, else of the first case at all;
    ``traditional_m`` and ``percent`` are of the same estimator without parked cars. A car with
    one position only is drawn as a line of no length.

    Parameters
    ----------
    trace : positions of the cars' centres
    crs : its CRS
    met : the parked cars that each car met
    errors : mean errors of each car, case by case
    """
    import geopandas as gpd

    order = by_car(trace.vehicle, trace.time_s)
    names, first, count = np.unique(
        trace.vehicle[order].astype(str), return_index=True, return_counts=True
    )
    xy = np.stack([trace.x_m[order], trace.y_m[order]], axis=1)
    time_s = trace.time_s[order]
    lines = [
        shapely.LineString(xy[start:stop] if size > 1 else xy[[start, start]])
        for start, stop, size in zip(first, first + count, count, strict=True)
    ]
    columns: dict[str, object] = {
        "vehicle": names,
        "start_s": time_s[first],
        "end_s": time_s[first + count - 1],
        "path_km": met.path_km,
        "met": met.met,
        "met_per_km": met.met_per_km,
    }
    return gpd.GeoDataFrame({**columns, **_errors(errors)}, geometry=lines, crs=crs)


def driven_area(trace: Trace, crs: CRS, *, around_m: float = DRIVEN_M) -> TransitArea:
    """Return the area around the places of cars, which stands for a transit area not known.

    Parameters
    ----------
    trace : positions of the cars' centres
    crs : its CRS
    around_m : how far around each place

    Examples
    --------
    >>> zero = np.zeros(1)
    >>> trace = Trace(zero, np.array(["a"], dtype=object), zero, zero, zero, zero)
    >>> round(driven_area(trace, CRS(2157)).area_m2)
    306
    """
    places = shapely.points(trace.x_m, trace.y_m)
    driven = shapely.union_all(shapely.buffer(places, around_m, quad_segs=4))
    return TransitArea(shapely.MultiPolygon(list(shapely.get_parts(driven))), crs)


def _errors(errors: Sequence[CarErrors]) -> dict[str, object]:
    """Return the columns of the first case with parked cars, and of its like without."""
    if not errors:
        return {}
    chosen = next((each for each in errors if each.arm == "proposed"), errors[0])
    like = (chosen.estimator, chosen.sigma_range_m, chosen.radius_m)
    columns: dict[str, object] = {
        "arm": chosen.arm,
        "estimator": chosen.estimator,
        "sigma_range_m": chosen.sigma_range_m,
        "radius_m": chosen.radius_m,
        "mean_error_m": chosen.mean_error_m,
    }
    for each in errors:
        same = (each.estimator, each.sigma_range_m, each.radius_m) == like
        if chosen.arm == "proposed" and each.arm == "traditional" and same:
            with np.errstate(invalid="ignore", divide="ignore"):
                percent = 100 * (1 - chosen.mean_error_m / each.mean_error_m)
            columns |= {"traditional_m": each.mean_error_m, "percent": percent}
    return columns

"""How far each car drove, and how many parked cars it met on its way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from covertool.model import Anchors, Floats, Integers, Objects, Trace
from covertool.model.tables import Table, by_car


@dataclass(frozen=True)
class Encounters(Table):
    """The ways of cars and the parked cars that they met, one row a car, in the order of the ids.

    Attributes
    ----------
    vehicle : (N,) object array of str
    path_km : (N,) way from step to step in kilometres
    met : (N,) different anchors within the zone at one step or more
    radius_m : the zone
    """

    vehicle: Objects
    path_km: Floats
    met: Integers
    radius_m: float

    _not_columns = ("radius_m",)

    @property
    def met_per_km(self) -> Floats:
        """Anchors met per kilometre; NaN for a car that never moved."""
        with np.errstate(divide="ignore", invalid="ignore"):
            density: Floats = np.where(self.path_km > 0, self.met / self.path_km, np.nan)
        return density

    def longest(self, count: int) -> tuple[str, ...]:
        """Return the ids of the cars with the longest ways, the longest first; ties by id."""
        order = np.lexsort((self.vehicle.astype(str), -self.path_km))
        return tuple(str(name) for name in self.vehicle[order[:count]])

    def row(self, vehicle: str) -> int:
        """Return the row of a car."""
        return int(np.flatnonzero(self.vehicle == vehicle)[0])


def encounters(trace: Trace, anchors: Anchors, radius_m: float) -> Encounters:
    """Return the way of each car and the anchors that were ever within its zone.

    The paper's Table VIII: parked cars experienced, travelled path, and their ratio.

    Parameters
    ----------
    trace : positions of the cars' centres
    anchors : parked cars, in the CRS of the trace
    radius_m : communication zone in metres

    Examples
    --------
    >>> from pyproj import CRS
    >>> name, y = np.array(["a", "a"], dtype=object), np.zeros(2)
    >>> trace = Trace(np.array([0.0, 1.0]), name, np.array([0.0, 500.0]), y, y, y)
    >>> parked = Anchors.from_points([3.0, 250.0, 503.0], [4.0, 0.0, 0.0], CRS("EPSG:2157"))
    >>> met = encounters(trace, parked, 15.0)
    >>> print(float(met.path_km[0]), int(met.met[0]), float(met.met_per_km[0]))
    0.5 2 4.0
    """
    from scipy.spatial import cKDTree

    order = by_car(trace.vehicle, trace.time_s)
    names, car = np.unique(trace.vehicle[order].astype(str), return_inverse=True)
    xy = np.stack([trace.x_m[order], trace.y_m[order]], axis=1)
    ways_m = np.hypot(*np.diff(xy, axis=0).T)
    same = car[1:] == car[:-1]
    path_m = np.bincount(car[1:][same], ways_m[same], minlength=names.size)
    met = np.zeros(names.size, np.int64)
    if len(anchors):
        parked = cKDTree(np.stack([anchors.x_m, anchors.y_m], axis=1))
        near = parked.query_ball_point(xy, radius_m)
        counts = np.array([len(found) for found in near])
        anchor = np.fromiter((k for found in near for k in found), np.int64, int(counts.sum()))
        pairs = np.unique(np.stack([np.repeat(car, counts), anchor], axis=1), axis=0)
        met = np.bincount(pairs[:, 0], minlength=names.size)
    return Encounters(names.astype(object), path_m / 1000.0, met, radius_m)


def anchors_on_way(anchors: Anchors, trace: Trace, distance_m: float) -> Anchors:
    """Return the anchors within a distance of the ways of cars, from step to step."""
    import shapely

    order = by_car(trace.vehicle, trace.time_s)
    car = trace.vehicle[order]
    xy = np.stack([trace.x_m[order], trace.y_m[order]], axis=1)
    last = np.append(car[1:] != car[:-1], True)
    onward = np.where(last[:, None], xy, np.roll(xy, -1, axis=0))
    ways: Objects = np.asarray(shapely.linestrings(np.stack([xy, onward], axis=1)), dtype=object)
    places = shapely.points(anchors.x_m, anchors.y_m)
    near = shapely.STRtree(ways).query(places, predicate="dwithin", distance=distance_m)[0]
    return anchors.take(np.unique(near))

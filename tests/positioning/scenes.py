"""Traces and shortcuts that several tests of this room use."""

import numpy as np
from pyproj import CRS

from covertool.model import Anchors, Trace
from covertool.positioning.filtering import Filtering, Site
from covertool.positioning.hearing import steps_of
from covertool.positioning.options import PositioningOptions
from covertool.positioning.ranging import RangeModel


def straight(cars=1, steps=50, speed=5.0, spacing_m=1000.0):
    """Cars side by side, far apart, that drive east at a constant speed."""
    time = np.repeat(np.arange(steps, dtype=float), cars)
    name = np.tile(np.array([f"{i:04d}" for i in range(cars)], dtype=object), steps)
    lane = np.tile(np.arange(cars) * spacing_m, steps)
    still = np.zeros(time.size)
    return Trace(time, name, speed * time, lane, still + speed, still)


def nowhere():
    return Anchors.from_points([], [], CRS("EPSG:2157"))


def filtering(trace, estimator, *, anchors=(), radius_m=None, sigma_m=0.2, runs=4, **options):
    """One estimator on one trace, for runs 0, 1, ..."""
    position = np.reshape(np.asarray(anchors, dtype=float), (-1, 2))
    site = Site(position, np.zeros(len(position)))
    given = PositioningOptions(**options)
    model = RangeModel(sigma_m, given.range_growth, given.nlos_share, given.nlos_mean_m)
    return Filtering(steps_of(trace), site, estimator, given, radius_m, model, (1, 0), 0, runs)

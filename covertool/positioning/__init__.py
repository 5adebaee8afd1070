"""Trace and anchors to position errors."""

from covertool.positioning.bound import crlb_m, pdop
from covertool.positioning.cases import ARMS, ESTIMATORS, Scenario
from covertool.positioning.estimators import Estimator, Measurements, State
from covertool.positioning.experiment import position_errors
from covertool.positioning.options import PositioningOptions, rssi_growth
from covertool.positioning.tracks import position_tracks

__all__ = [
    "ARMS",
    "ESTIMATORS",
    "Estimator",
    "Measurements",
    "PositioningOptions",
    "Scenario",
    "State",
    "crlb_m",
    "pdop",
    "position_errors",
    "position_tracks",
    "rssi_growth",
]

"""What every estimator takes and returns, so that any cooperative algorithm can take part.

Section IV-E of the paper says that any algorithm gains from parked cars. A class that follows
:class:`Estimator` is named ``module:Name`` and runs beside the built-in ones.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np

from covertool.errors import OptionError
from covertool.model import Floats
from covertool.positioning.noise import Indices


@dataclass(frozen=True)
class State:
    """Estimates of all cars in all runs; rows are cars within runs (run 0 first).

    ``position`` is (rows, 2) in metres; ``covariance`` is (rows, 3): xx, xy, yy in square metres.
    """

    position: Floats
    covariance: Floats


@dataclass(frozen=True)
class Measurements:
    """What the cars of all runs measure and hear at one step; rows as in :class:`State`.

    Attributes
    ----------
    step_s : seconds since the last step
    key, first_run, runs, time : address of the chance of this step (see ``noise``)
    car : (cars,) number of each car, the same in every run; rows = runs * cars
    velocity : (rows, 2) measured velocity in m/s
    gps : (rows, 2) GPS fix in metres, with ``gps_variance_m2`` per axis for a filter
    count : (rows,) neighbours heard; 0 for an isolated car. Like ``neighbour`` the same in every
        run of a block
    neighbour : (rows, most) place of a moving neighbour among the cars, an anchor's code from
        ``noise.ANCHOR_BIT``, or -1; best first
    range_m : (rows, most) measured range, with ``range_variance_m2`` (rows, most)
    x, y : (rows, most) position that the neighbour shares, in metres
    shared : (rows, most, 3) covariance of that position: xx, xy, yy
    """

    step_s: float
    key: tuple[int, int]
    first_run: int
    runs: int
    time: int
    car: Indices
    velocity: Floats
    gps: Floats
    gps_variance_m2: float
    count: Indices
    neighbour: Indices
    range_m: Floats
    range_variance_m2: Floats
    x: Floats
    y: Floats
    shared: Floats


@runtime_checkable
class Estimator(Protocol):
    """A cooperative positioning algorithm: state and measurements to the next state.

    ``uses_gps`` says that ``update`` fuses the GPS fix of every step by itself. Else an isolated
    car's prediction is kept, and its GPS fix is taken from time to time. ``gives_covariance`` says
    that the covariance is meant as one, so that NEES can judge it.
    """

    name: str
    uses_gps: bool
    gives_covariance: bool

    def start(self, gps: Floats, variance_m2: float) -> State:
        """Return the state of cars that appear, before their first update."""
        ...

    def predict(self, state: State, velocity: Floats, step_s: float) -> State:
        """Return the state one step later, before anything is measured there."""
        ...

    def update(self, predicted: State, heard: Measurements) -> State:
        """Return the state after the measurements."""
        ...


def isotropic(rows: int, variance_m2: float) -> Floats:
    """Return (rows, 3) covariances with the same variance along both axes."""
    covariance = np.zeros((rows, 3))
    covariance[:, 0] = covariance[:, 2] = variance_m2
    return covariance


def load_estimator(name: str) -> Estimator:
    """Return a user's estimator named ``module:Name``: a class without arguments, or an instance.

    Raises
    ------
    OptionError
        When there is no such thing, or it lacks a part of :class:`Estimator`.

    Examples
    --------
    >>> load_estimator("covertool.positioning.linear:GpsOdometry").name
    'gps_odometry'
    """
    module, _, attribute = name.partition(":")
    mend = "name it as module:Name, with the module on PYTHONPATH"
    try:
        found: Any = getattr(importlib.import_module(module), attribute)
        estimator = found() if isinstance(found, type) else found
    except (ImportError, AttributeError, TypeError, ValueError) as error:
        raise OptionError(
            f"the estimator cannot be loaded ({error})", f"estimator {name}", mend
        ) from error
    if not isinstance(estimator, Estimator):
        raise OptionError(
            "it is not an estimator",
            f"estimator {name}",
            "give it name, uses_gps, gives_covariance, start, predict and update",
        )
    return estimator

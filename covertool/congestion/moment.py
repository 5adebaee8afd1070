"""The network at one moment: the status of each piece of street, and the cars that queue."""

from __future__ import annotations

from datetime import date
from typing import NamedTuple

from covertool.congestion.clock import local_days, window_instant
from covertool.congestion.options import OccupancyOptions
from covertool.congestion.queues import QueueOptions, queue_anchors
from covertool.congestion.states import SegmentStates
from covertool.congestion.streets import Streets
from covertool.errors import OptionError
from covertool.model import Anchors, Floats, Objects, Observations


class Moment(NamedTuple):
    """The network at one window of one local day.

    Attributes
    ----------
    status : (N,) status of each piece
    queue_m : (N,) its measured queue in metres, NaN for none
    day, window : which they are
    """

    status: Objects
    queue_m: Floats
    day: date
    window: str


class QueuedCars(NamedTuple):
    """The cars that queue at one window of one local day (synthetic).

    Attributes
    ----------
    anchors : (N,) the cars
    segment_id : (N,) the segment on which each stands
    day, window : which they are
    """

    anchors: Anchors
    segment_id: Objects
    day: date
    window: str


def states_at(
    observations: Observations,
    network: Streets,
    options: OccupancyOptions,
    *,
    day: date | None = None,
    window: str | None = None,
) -> Moment:
    """Return the status and measured queue of each piece at one window of one local day.

    Parameters
    ----------
    day, window : the first day observed and the last window of the options, where None

    Raises
    ------
    OptionError
        When nothing was observed on that day, or there is no such window.
    """
    days = local_days(observations.time, options.tz)
    chosen_day = day or days[0]
    chosen_window = window or list(options.windows)[-1]
    if chosen_day not in days:
        raise OptionError(
            f"nothing was observed on {chosen_day}",
            "--day",
            f"choose from {days[0]} to {days[-1]}",
        )
    if chosen_window not in options.windows:
        raise OptionError(
            f"there is no window {chosen_window!r}",
            "--window",
            f"use {', '.join(options.windows)}, or add it with --at NAME=HH:MM",
        )
    moment = window_instant(chosen_day, options.windows[chosen_window], options.tz)
    if moment is None:
        raise OptionError(
            f"the clocks skip that time on {chosen_day}", "--at", "choose another day or window"
        )
    states = SegmentStates(observations, network, options)
    status, queue_m = states.at(moment)
    of = states.segment_of
    return Moment(status[of], queue_m[of], chosen_day, chosen_window)


def queues_at(
    observations: Observations,
    network: Streets,
    options: OccupancyOptions,
    queues: QueueOptions | None = None,
    *,
    day: date | None = None,
    window: str | None = None,
) -> QueuedCars:
    """Return the queued cars at one window of one local day; see `states_at` and `queue_anchors`.

    Parameters
    ----------
    queues : how queues are laid out
    day, window : as in `states_at`
    """
    moment = states_at(observations, network, options, day=day, window=window)
    cars, segment_id = queue_anchors(network, moment.status, moment.queue_m, queues)
    return QueuedCars(cars, segment_id, moment.day, moment.window)

"""The network at one moment: the status of each piece of street."""

from __future__ import annotations

from datetime import date

import numpy as np

from covertool.congestion.clock import local_days, window_instant
from covertool.congestion.nearest import Timeline
from covertool.congestion.occupancy import OccupancyOptions, states
from covertool.congestion.streets import Streets
from covertool.errors import OptionError
from covertool.model import Floats, Objects, Observations


def states_at(
    observations: Observations,
    network: Streets,
    options: OccupancyOptions,
    *,
    day: date | None = None,
    window: str | None = None,
) -> tuple[Objects, Floats, date, str]:
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
    ids, piece_of = np.unique(network.segment_id.astype(str), return_inverse=True)
    timeline = Timeline(observations, ids.astype(object))
    rows = timeline.nearest(moment, np.timedelta64(options.tolerance))
    status, queue_m = states(timeline, rows, absent_is_free=options.absent_is_free)
    return status[piece_of], queue_m[piece_of], chosen_day, chosen_window

"""The state of each segment of a network at any moment, as it was observed."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from covertool.congestion.nearest import Timeline
from covertool.congestion.options import OccupancyOptions
from covertool.congestion.status import UNKNOWN
from covertool.congestion.streets import Streets
from covertool.model import Floats, Objects, Observations


class SegmentStates:
    """Observations of a network, asked for the state of its segments at a moment.

    Parameters
    ----------
    observations : Observations
    network : Streets
        Its pieces; several may be of one segment.
    options : OccupancyOptions
        How far an observation may lie, and what a segment is that is not mentioned.

    Attributes
    ----------
    segment_of : (N,) number of the segment of each piece, 0 to S - 1
    """

    def __init__(
        self, observations: Observations, network: Streets, options: OccupancyOptions
    ) -> None:
        ids, segment_of = np.unique(network.segment_id.astype(str), return_inverse=True)
        self.segment_of: npt.NDArray[np.intp] = segment_of
        self._timeline = Timeline(observations, ids.astype(object))
        self._tolerance = np.timedelta64(options.tolerance)
        self._absent_is_free = options.absent_is_free

    def at(self, moment: np.datetime64) -> tuple[Objects, Floats]:
        """Return each segment's status and measured queue; where nothing was seen it is unknown.

        Where a segment that is not mentioned is free, it is so only as long as the feed said
        anything at all.

        Returns
        -------
        status : (S,) words of the status scale
        queue_m : (S,) metres, NaN for none
        """
        rows = self._timeline.nearest(moment, self._tolerance)
        seen = rows >= 0
        absent = "free" if self._absent_is_free and seen.any() else UNKNOWN
        status: Objects = np.full(rows.size, absent, dtype=object)
        queue_m = np.full(rows.size, np.nan)
        status[seen] = self._timeline.status[rows[seen]]
        queue_m[seen] = self._timeline.queue_m[rows[seen]]
        return status, queue_m

    def summed(self, of_pieces: Floats) -> Floats:
        """Return (S,) sums over the pieces of each segment."""
        return np.bincount(self.segment_of, weights=of_pieces).astype(float)

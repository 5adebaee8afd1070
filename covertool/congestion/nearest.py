"""The nearest observation of each segment to a moment."""

from __future__ import annotations

import logging

import numpy as np

from covertool.congestion.status import SEVERITY
from covertool.errors import ColumnError
from covertool.model import Floats, Integers, Objects, Observations

_LOG = logging.getLogger(__name__)

_MICROSECOND = np.timedelta64(1, "us")


class Timeline:
    """Observations of known segments in the order of time, asked for the nearest to a moment.

    Parameters
    ----------
    observations : Observations
    segment_ids : (S,) object array of distinct str
        The segments of the network; observations of others are reported and left out.
    """

    def __init__(self, observations: Observations, segment_ids: Objects) -> None:
        codes = _codes(observations.segment_id, segment_ids)
        _report_strangers(observations, codes)
        known = codes >= 0
        order = np.argsort(observations.time[known], kind="stable")
        kept = observations.take(np.flatnonzero(known)[order])
        self.segments = segment_ids.size
        self.status: Objects = kept.status
        self.queue_m: Floats = kept.queue_m
        self._code = codes[known][order]
        self._rank = np.array([SEVERITY[word] for word in kept.status.tolist()], dtype=np.int64)
        self._start = kept.time.astype(np.int64)
        end = np.where(np.isnat(kept.until), kept.time, kept.until)
        self._end = np.maximum(end.astype(np.int64), self._start)
        self._longest = int(np.max(self._end - self._start, initial=0))

    def nearest(self, moment: np.datetime64, tolerance: np.timedelta64) -> Integers:
        """Return for each segment the row of its nearest observation, -1 where there is none.

        An interval that holds the moment is at distance zero. Of two at one distance the earlier
        is taken, of two at one time the worse status.
        """
        at = int(moment.astype("datetime64[us]").astype(np.int64))
        reach = int(tolerance / _MICROSECOND)
        first = np.searchsorted(self._start, at - reach - self._longest, side="left")
        last = np.searchsorted(self._start, at + reach, side="right")
        rows = np.arange(first, last)
        before, after = at - self._end[rows], self._start[rows] - at
        distance = np.maximum(np.maximum(before, after), 0)
        rows, distance = rows[distance <= reach], distance[distance <= reach]
        order = np.lexsort((-self._rank[rows], self._start[rows], distance, self._code[rows]))
        rows = rows[order]
        segments, place = np.unique(self._code[rows], return_index=True)
        found = np.full(self.segments, -1, dtype=np.int64)
        found[segments] = rows[place]
        return found


def _codes(ids: Objects, segment_ids: Objects) -> Integers:
    index = {segment: code for code, segment in enumerate(segment_ids.tolist())}
    return np.array([index.get(segment, -1) for segment in ids.tolist()], dtype=np.int64)


def _report_strangers(observations: Observations, codes: Integers) -> None:
    """Warn of observations of unknown segments; refuse when there are no others."""
    strange = codes < 0
    if not strange.any():
        return
    example = observations.segment_id[int(np.argmax(strange))]
    if strange.all():
        raise ColumnError(
            f"no observation belongs to a segment of the network (the first is of {example!r})",
            "column segment_id of the observations and of the segments",
            "give the network that the observations refer to with --segments",
        )
    _LOG.warning(
        "%d observations are of segments that the network does not hold, such as %s",
        int(strange.sum()),
        example,
    )

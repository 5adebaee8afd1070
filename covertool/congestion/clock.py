"""Wall time and instants: naive times, the October fold, the March gap."""

from __future__ import annotations

from datetime import UTC, date, datetime, time, timedelta
from typing import Literal
from zoneinfo import ZoneInfo

import numpy as np
import numpy.typing as npt

from covertool.errors import ColumnError, OptionError

Instants = npt.NDArray[np.datetime64]
_EARLIEST, _LATEST = 1900, 2200

Fold = Literal["earlier", "later"] | None
"""Which of two instants a wall time in the autumn's repeated hour means; None refuses it."""


def zone(name: str) -> ZoneInfo:
    """Return the time zone of a name.

    Raises
    ------
    OptionError
        When the zone is not known.

    Examples
    --------
    >>> zone("Europe/Dublin").key
    'Europe/Dublin'
    """
    try:
        return ZoneInfo(name)
    except (KeyError, ValueError, OSError):
        raise OptionError(
            f"there is no time zone {name!r}", "--tz", "use an IANA name such as Europe/Dublin"
        ) from None


def instant(moment: datetime, tz: ZoneInfo | None, fold: Fold, where: str) -> datetime:
    """Return a moment in UTC; a naive one is wall time in ``tz``.

    Parameters
    ----------
    moment : aware or naive
    tz : zone of naive moments; None when there is none
    fold : which of two instants a naive moment in the repeated hour means
    where : the file and column, for messages

    Raises
    ------
    ColumnError
        When the moment is naive and there is no zone; when it falls into the repeated hour of
        autumn and no fold is chosen; when the clocks skip it in spring.

    Examples
    --------
    >>> instant(datetime(2014, 6, 16, 13), zone("Europe/Dublin"), None, "x").isoformat()
    '2014-06-16T12:00:00+00:00'
    """
    if not _EARLIEST <= moment.year <= _LATEST:
        raise ColumnError(
            f"the year of {moment.isoformat()} cannot be right",
            where,
            f"write times between {_EARLIEST} and {_LATEST}",
        )
    if moment.tzinfo is not None:
        return moment.astimezone(UTC)
    if tz is None:
        raise ColumnError(
            f"the time {moment.isoformat()} has no UTC offset",
            where,
            "say in which zone it was written, such as --tz Europe/Dublin",
        )
    early, late = (moment.replace(tzinfo=tz, fold=f).astimezone(UTC) for f in (0, 1))
    if early == late:
        return early
    if early.astimezone(tz).replace(tzinfo=None) != moment:
        raise ColumnError(
            f"the time {moment.isoformat()} does not exist in {tz.key}: the clocks skip it",
            where,
            "write times with their UTC offset",
        )
    if fold is None:
        raise ColumnError(
            f"the time {moment.isoformat()} happens twice in {tz.key}",
            where,
            "write times with their UTC offset, or choose with --fold earlier|later",
        )
    return early if fold == "earlier" else late


def parse_instant(text: str, tz: ZoneInfo | None, fold: Fold, where: str) -> datetime:
    """Return an ISO 8601 text as a moment in UTC; the parameters are those of `instant`.

    Raises
    ------
    ColumnError
        When the text is no time, or as in `instant`.

    Examples
    --------
    >>> parse_instant("2026-07-24T08:04:50+02:00", None, None, "x").isoformat()
    '2026-07-24T06:04:50+00:00'
    """
    try:
        moment = datetime.fromisoformat(text.strip())
    except ValueError:
        raise ColumnError(
            f"{text!r} is not a time", where, "write ISO 8601, such as 2014-06-16T13:00:00+01:00"
        ) from None
    return instant(moment, tz, fold, where)


def window_instant(day: date, at: time, tz: ZoneInfo) -> np.datetime64 | None:
    """Return when the clock shows a time on a day; None when the clocks skip it.

    In the repeated hour of autumn it is the first of the two.

    Examples
    --------
    >>> window_instant(date(2014, 12, 1), time(13), zone("Europe/Dublin"))
    np.datetime64('2014-12-01T13:00:00.000000')
    >>> window_instant(date(2015, 3, 29), time(1, 30), zone("Europe/Dublin")) is None
    True
    """
    wall = datetime.combine(day, at)
    moment = wall.replace(tzinfo=tz, fold=0).astimezone(UTC)
    if moment.astimezone(tz).replace(tzinfo=None) != wall:
        return None
    return to_numpy(moment)


def local_days(instants: Instants, tz: ZoneInfo) -> list[date]:
    """Return the sorted local dates on which any of the instants (UTC) falls.

    Examples
    --------
    >>> local_days(np.array(["2014-06-16T23:30"], dtype="datetime64[us]"), zone("Europe/Dublin"))
    [datetime.date(2014, 6, 17)]
    """
    # A local date never spans part of an hour only, except by quarter hours: so those suffice.
    quarters = np.unique(instants.astype("datetime64[m]").astype(np.int64) // 15)
    epoch = datetime(1970, 1, 1, tzinfo=UTC)
    return sorted(
        {(epoch + timedelta(minutes=15 * int(q))).astimezone(tz).date() for q in quarters}
    )


def to_numpy(moment: datetime) -> np.datetime64:
    """Return an aware moment as a numpy instant in UTC, in microseconds."""
    return np.datetime64(moment.astimezone(UTC).replace(tzinfo=None), "us")

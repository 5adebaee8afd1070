"""The options that the congestion verbs share, and what their texts mean."""

from __future__ import annotations

import re
from datetime import date, time, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from covertool.congestion.clock import Fold
    from covertool.congestion.status import Profile

ObservationFile = Annotated[
    Path | None,
    typer.Argument(metavar="OBS", help="Observations (.parquet, .csv); else the sample study's."),
]
Segments = Annotated[
    str | None,
    typer.Option("--segments", metavar="FILE[:LAYER]", help="Directed street segments."),
]
Aoi = Annotated[
    str | None,
    typer.Option("--aoi", metavar="FILE[:LAYER]", help="Count only street length inside."),
]
At = Annotated[
    list[str] | None,
    typer.Option("--at", metavar="NAME=HH:MM", help="A window by local wall time (repeatable)."),
]
Tz = Annotated[
    str | None,
    typer.Option("--tz", metavar="ZONE", help="Local time zone, such as Europe/Dublin."),
]
FoldChoice = Annotated[
    str | None,
    typer.Option("--fold", metavar="earlier|later", help="Naive times in the repeated hour."),
]
Tolerance = Annotated[
    str,
    typer.Option("--tolerance", metavar="TIME", help="How far an observation may lie: 90s, 10min."),
]
Occupied = Annotated[
    str,
    typer.Option("--occupied", metavar="STATUSES", help="Statuses that count as occupied."),
]
MeanOf = Annotated[
    str, typer.Option("--mean-of", metavar="cells|days", help="Average cells, or dates.")
]
Weight = Annotated[
    str,
    typer.Option("--weight", metavar="directed|undirected|lane", help="What length counts."),
]
MinCoverage = Annotated[
    float, typer.Option("--min-coverage", metavar="SHARE", help="Blank cells known to less.")
]
Holidays = Annotated[
    str | None,
    typer.Option("--holidays", metavar="COUNTRY", help="Keep public holidays apart (ISO code)."),
]
AbsentIsFree = Annotated[
    bool, typer.Option("--absent-is-free", help="Segments a living feed leaves out are free.")
]
ProfileName = Annotated[
    str | None,
    typer.Option("--profile", metavar="NAME|FILE", help="Status profile, or a TOML file."),
]
Day = Annotated[
    str | None, typer.Option("--day", metavar="YYYY-MM-DD", help="The local day; else the first.")
]
Window = Annotated[
    str | None, typer.Option("--window", metavar="NAME", help="The window; else the last.")
]

OCCUPIED = "slow,very_slow,stationary"
TOLERANCE = "10min"

_LENGTH_OF_TIME = re.compile(r"(\d+(?:\.\d+)?)\s*(s|min|h)")
_UNITS = {"s": timedelta(seconds=1), "min": timedelta(minutes=1), "h": timedelta(hours=1)}


def profile_of(name: str | None) -> Profile | None:
    """Return the status profile of a name or a TOML file; None for none."""
    if name is None:
        return None
    from covertool.congestion.status import parse_profile, profile_named
    from covertool.gis.streams import open_stream

    if not name.lower().endswith(".toml"):
        return profile_named(name)
    with open_stream(name, max_bytes=2**20) as stream:
        return parse_profile(stream.read(2**20).decode("utf-8", errors="replace"), name)


def fold_choice(text: str | None) -> Fold:
    """Return the fold that an option names."""
    folds: dict[str | None, Fold] = {None: None, "earlier": "earlier", "later": "later"}
    if text not in folds:
        raise typer.BadParameter("use earlier or later", param_hint="--fold")
    return folds[text]


def duration(text: str) -> timedelta:
    """Return a length of time such as 90s, 10min or 1h.

    >>> duration("10min")
    datetime.timedelta(seconds=600)
    """
    match = _LENGTH_OF_TIME.fullmatch(text.strip())
    if match is None:
        raise typer.BadParameter("write 90s, 10min or 1h", param_hint="--tolerance")
    return float(match[1]) * _UNITS[match[2]]


def day_of(text: str | None) -> date | None:
    """Return the day that an option names."""
    try:
        return None if text is None else date.fromisoformat(text)
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not YYYY-MM-DD", param_hint="--day") from None


def window_of(text: str) -> tuple[str, time]:
    """Return the name and the wall time of a window.

    >>> window_of("lunch=13:00")
    ('lunch', datetime.time(13, 0))
    """
    name, equals, clock = text.partition("=")
    try:
        if not (name and equals):
            raise ValueError
        return name.strip(), time.fromisoformat(clock.strip())
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not NAME=HH:MM", param_hint="--at") from None


def words_of(text: str) -> tuple[str, ...]:
    """Return the words of a list with commas.

    >>> words_of("slow, stationary")
    ('slow', 'stationary')
    """
    return tuple(word.strip() for word in text.split(",") if word.strip())

"""The options that the congestion verbs share, and the case they describe."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import date, time, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from covertool.cli.console import say

if TYPE_CHECKING:
    from covertool.congestion.occupancy import OccupancyOptions
    from covertool.model import Observations

SAMPLE_TZ = "Europe/Dublin"

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

OCCUPIED = "slow,very_slow,stationary"
TOLERANCE = "10min"


@dataclass(frozen=True)
class Case:
    """Observations, network and counting options, read and ready."""

    observations: Observations
    segments: Any
    aoi: Any
    options: OccupancyOptions
    files: tuple[Path, ...]


def read_case(
    observations: Path | None,
    segments: str | None,
    *,
    aoi: str | None,
    at: list[str] | None,
    tz: str | None,
    fold: str | None,
    tolerance: str,
    occupied: str,
    mean_of: str = "cells",
    min_coverage: float = 0.8,
    holidays: str | None = None,
    absent_is_free: bool = False,
    profile: str | None = None,
) -> Case:
    """Return what the options name; with no observations the sample study's."""
    from covertool.congestion.clock import local_days, zone
    from covertool.congestion.freeflow import with_free_flow
    from covertool.congestion.occupancy import RUSH_HOURS, OccupancyOptions
    from covertool.congestion.publicholidays import public_holidays
    from covertool.congestion.streets import id_column
    from covertool.errors import told_of
    from covertool.gis.guard import layer_spec
    from covertool.gis.read import read_polygons
    from covertool.gis.segments import read_segments

    observations, segments, tz = _chosen(observations, segments, tz)
    where = zone(tz)
    with told_of(observations):
        seen = read_observations(observations, tz=tz, fold=fold, profile=profile)
    with told_of(segments):
        network = read_segments(segments)
        id_column(network)
    seen = with_free_flow(seen, network, profile_of(profile))
    years = {day.year for day in local_days(seen.time, where)}
    options = OccupancyOptions(
        tz=where,
        windows=dict(_window(text) for text in at) if at else dict(RUSH_HOURS),
        tolerance=duration(tolerance),
        occupied=tuple(word.strip() for word in occupied.split(",") if word.strip()),
        mean_of=mean_of,  # type: ignore[arg-type]
        min_coverage=min_coverage,
        holidays=public_holidays(holidays, years) if holidays else (),
        absent_is_free=absent_is_free,
    )
    area = None if aoi is None else read_polygons(aoi, dst_crs=network.crs).union_all()
    named: list[str | Path] = [observations, segments, *([] if aoi is None else [aoi])]
    return Case(seen, network, area, options, tuple(layer_spec(spec)[0] for spec in named))


def _chosen(
    observations: Path | None, segments: str | None, tz: str | None
) -> tuple[Path, str, str]:
    """Return the files and the zone, those of the sample study where nothing is named."""
    if observations is None:
        from covertool.gis.sample import SAMPLE_STUDY, sample_folder

        folder = sample_folder()
        found = [folder / name for name in ("observations.parquet", "observations.csv")]
        observations = next((path for path in found if path.is_file()), found[-1])
        say(f"no observations were named: using the synthetic sample study {observations}")
        return observations, segments or str(folder / SAMPLE_STUDY), tz or SAMPLE_TZ
    if segments is None:
        raise typer.BadParameter("name the street network", param_hint="--segments")
    if tz is None:
        raise typer.BadParameter("name the local time zone", param_hint="--tz")
    return observations, segments, tz


def read_observations(
    path: Path, *, tz: str | None = None, fold: str | None = None, profile: str | None = None
) -> Observations:
    """Return the observations of a Parquet or CSV file."""
    from covertool.congestion.clock import zone
    from covertool.congestion.feeds.protocol import FeedOptions, feed
    from covertool.errors import FileError
    from covertool.gis.streams import open_stream
    from covertool.model import Observations

    kind = {".parquet": "parquet", ".csv": "csv", ".gz": "csv"}.get(path.suffix.lower())
    if kind is None:
        raise FileError(
            f"observations are read from .parquet and .csv, not {path.suffix or 'this'!r}",
            str(path),
            f"covertool congestion import --format ... {path.name} -o obs.parquet",
        )
    options = FeedOptions(
        where=str(path),
        tz=zone(tz) if tz else None,
        fold=fold_choice(fold),
        profile=profile_of(profile),
    )
    with open_stream(path) as stream:
        return Observations.concatenate(list(feed(kind).read(stream, options)))


def profile_of(name: str | None) -> Any:
    """Return the status profile of a name or a TOML file; None for none."""
    if name is None:
        return None
    from covertool.congestion.status import parse_profile, profile_named
    from covertool.gis.streams import open_stream

    if not name.lower().endswith(".toml"):
        return profile_named(name)
    with open_stream(name, max_bytes=2**20) as stream:
        return parse_profile(stream.read(2**20).decode("utf-8", errors="replace"), name)


def fold_choice(text: str | None) -> Any:
    """Return the fold that an option names."""
    if text not in (None, "earlier", "later"):
        raise typer.BadParameter("use earlier or later", param_hint="--fold")
    return text


def duration(text: str) -> timedelta:
    """Return a length of time such as 90s, 10min or 1h."""
    match = re.fullmatch(r"(\d+(?:\.\d+)?)\s*(s|min|h)", text.strip())
    if match is None:
        raise typer.BadParameter("write 90s, 10min or 1h", param_hint="--tolerance")
    return (
        float(match[1])
        * {
            "s": timedelta(seconds=1),
            "min": timedelta(minutes=1),
            "h": timedelta(hours=1),
        }[match[2]]
    )


def day_of(text: str | None) -> date | None:
    """Return the day that an option names."""
    try:
        return None if text is None else date.fromisoformat(text)
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not YYYY-MM-DD", param_hint="--day") from None


def _window(text: str) -> tuple[str, time]:
    name, equals, clock = text.partition("=")
    try:
        if not (name and equals):
            raise ValueError
        return name.strip(), time.fromisoformat(clock.strip())
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not NAME=HH:MM", param_hint="--at") from None

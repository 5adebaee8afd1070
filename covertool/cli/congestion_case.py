"""What the congestion verbs are about: observations, a street network, and how to count."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING
from zoneinfo import ZoneInfo

import typer

from covertool.cli import congestion_options as own
from covertool.cli.console import say

if TYPE_CHECKING:
    import geopandas as gpd
    import shapely

    from covertool.congestion.moment import QueuedCars
    from covertool.congestion.options import OccupancyOptions
    from covertool.congestion.queues import QueueOptions
    from covertool.congestion.streets import Streets
    from covertool.model import Observations, OccupancyTable

SAMPLE_TZ = "Europe/Dublin"


@dataclass(frozen=True)
class Asked:
    """What the command line says; without observations it is about the sample study."""

    observations: Path | None = None
    segments: str | None = None
    aoi: str | None = None
    at: list[str] | None = None
    tz: str | None = None
    fold: str | None = None
    tolerance: str = own.TOLERANCE
    absent_is_free: bool = False
    profile: str | None = None
    occupied: str = own.OCCUPIED
    mean_of: str = "cells"
    min_coverage: float = 0.8
    holidays: str | None = None


@dataclass(frozen=True)
class Case:
    """Observations, segments and counting options, read and ready."""

    observations: Observations
    segments: gpd.GeoDataFrame
    aoi: shapely.Geometry | None
    options: OccupancyOptions
    files: tuple[Path, ...]

    def network(self, weight: str = "directed") -> Streets:
        """Return the pieces of street whose length counts."""
        from covertool.congestion.streets import streets

        return streets(self.segments, weight=weight, aoi=self.aoi)  # type: ignore[arg-type]

    def table(self, network: Streets) -> OccupancyTable:
        """Return the occupancy table."""
        from covertool.congestion.occupancy import days_of, table_of_days

        return table_of_days(days_of(self.observations, network, self.options), self.options)

    def queued_cars(
        self, queues: QueueOptions, day: date | None = None, window: str | None = None
    ) -> QueuedCars:
        """Return the cars that queue at one window of one day."""
        from covertool.congestion.moment import queues_at

        network = self.network()
        return queues_at(self.observations, network, self.options, queues, day=day, window=window)


def read_case(asked: Asked) -> Case:
    """Return what the options name; with no observations the sample study's."""
    from covertool.congestion.clock import local_days, zone
    from covertool.congestion.freeflow import with_free_flow
    from covertool.congestion.streets import id_column
    from covertool.errors import told_of
    from covertool.gis.guard import layer_spec
    from covertool.gis.read import read_polygons
    from covertool.gis.segments import read_segments

    observations, segments, tz = _chosen(asked)
    where = zone(tz)
    with told_of(observations):
        seen = read_observations(observations, tz=where, fold=asked.fold, profile=asked.profile)
    with told_of(segments):
        lines = read_segments(segments)
        id_column(lines)
    seen = with_free_flow(seen, lines, own.profile_of(asked.profile))
    options = _counting(asked, where, {day.year for day in local_days(seen.time, where)})
    area = None if asked.aoi is None else read_polygons(asked.aoi, dst_crs=lines.crs).union_all()
    named: list[str | Path] = [observations, segments, *([asked.aoi] if asked.aoi else [])]
    return Case(seen, lines, area, options, tuple(layer_spec(spec)[0] for spec in named))


def _chosen(asked: Asked) -> tuple[Path, str, str]:
    """Return the files and the zone, those of the sample study where nothing is named."""
    if asked.observations is None:
        from covertool.gis.sample import SAMPLE_STUDY, sample_folder

        folder = sample_folder()
        found = [folder / name for name in ("observations.parquet", "observations.csv")]
        observations = next((path for path in found if path.is_file()), found[-1])
        say(f"no observations were named: using the synthetic sample study {observations}")
        return observations, asked.segments or str(folder / SAMPLE_STUDY), asked.tz or SAMPLE_TZ
    if asked.segments is None:
        raise typer.BadParameter("name the street network", param_hint="--segments")
    if asked.tz is None:
        raise typer.BadParameter("name the local time zone", param_hint="--tz")
    return asked.observations, asked.segments, asked.tz


def _counting(asked: Asked, tz: ZoneInfo, years: set[int]) -> OccupancyOptions:
    """Return how the case is counted; holidays are those of the years that were observed."""
    from covertool.congestion.options import RUSH_HOURS, OccupancyOptions
    from covertool.congestion.publicholidays import public_holidays

    return OccupancyOptions(
        tz=tz,
        windows=dict(map(own.window_of, asked.at)) if asked.at else dict(RUSH_HOURS),
        tolerance=own.duration(asked.tolerance),
        occupied=own.words_of(asked.occupied),
        mean_of=asked.mean_of,  # type: ignore[arg-type]
        min_coverage=asked.min_coverage,
        holidays=public_holidays(asked.holidays, years) if asked.holidays else (),
        absent_is_free=asked.absent_is_free,
    )


def read_observations(
    path: Path, *, tz: ZoneInfo, fold: str | None = None, profile: str | None = None
) -> Observations:
    """Return the observations of a Parquet or CSV file."""
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
        where=str(path), tz=tz, fold=own.fold_choice(fold), profile=own.profile_of(profile)
    )
    with open_stream(path) as stream:
        return Observations.concatenate(list(feed(kind).read(stream, options)))

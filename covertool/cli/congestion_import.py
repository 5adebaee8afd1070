"""`covertool congestion import`: real traffic feeds into one table of observations."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from covertool.cli import congestion_options as own
from covertool.cli import options
from covertool.cli.congestion import congestion_app
from covertool.cli.console import print_json, say
from covertool.cli.whence import whence

if TYPE_CHECKING:
    from covertool.congestion.feeds.protocol import FeedOptions
    from covertool.model import Observations

Sources = Annotated[
    list[Path], typer.Argument(metavar="IN...", help="The feed's files; .gz is unpacked.")
]
FeedFormat = Annotated[
    str,
    typer.Option("--format", metavar="datex2|waze|tomtom|sumo|trips|csv|parquet", help="Feed."),
]
Sites = Annotated[
    Path | None,
    typer.Option("--sites", metavar="FILE", help="Site table, or the TRIPS routes file."),
]
Moment = Annotated[
    str | None,
    typer.Option("--time", metavar="ISO8601", help="Time of a feed without; SUMO's second 0."),
]
SpeedUnit = Annotated[
    str | None, typer.Option("--speed-unit", metavar="m/s|km/h|mph", help="Unit of speeds.")
]
FreeSpeed = Annotated[
    float | None,
    typer.Option("--free-speed", metavar="SPEED", help="Free-flow speed where there is none."),
]
AllowPartial = Annotated[
    bool, typer.Option("--allow-partial", help="Keep what was read of a truncated feed.")
]


@congestion_app.command("import")
def import_feed(
    sources: Sources,
    feed_format: FeedFormat,
    output: options.OutputFile,
    sites: Sites = None,
    segments: own.Segments = None,
    profile: own.ProfileName = None,
    tz: own.Tz = None,
    fold: own.FoldChoice = None,
    time: Moment = None,
    speed_unit: SpeedUnit = None,
    free_speed: FreeSpeed = None,
    allow_partial: AllowPartial = False,
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
) -> None:
    """Turn a traffic feed into a table of observations.

    \b
    Examples:
      covertool congestion import --format waze jams/*.json --segments net.gpkg -o obs.parquet
      covertool congestion import --format datex2 feed.xml.gz --sites sites.xml -o obs.parquet
      covertool congestion import --format tomtom flow.json --time 2026-07-24T08:00Z -o obs.csv
      covertool congestion import --format trips routes.csv -o network.gpkg

    \b
    With --segments the lines that a feed draws are matched to the segments along which they run.
    With --format trips a network file goes to a GIS file, as a layer segments or junctions.
    """
    feed_options = _options(
        str(sources[0]),
        profile=profile,
        tz=tz,
        fold=fold,
        time=time,
        speed_unit=speed_unit,
        free_speed=free_speed,
        allow_partial=allow_partial,
    )
    statuses: dict[str, int] = {}
    if feed_format == "trips" and _is_network(sources[0]):
        if len(sources) > 1:
            raise typer.BadParameter("import one network file at a time", param_hint="IN")
        rows = _network(sources[0], output, feed_options, overwrite)
    else:
        feed_options = _with_sites(feed_options, sites, feed_format)
        rows, statuses = _observations(
            sources, feed_format, output, feed_options, segments, overwrite
        )
    if as_json:
        files = [*sources, *([sites] if sites is not None else [])]
        provenance = whence(files).to_json()
        print_json(
            "congestion import", {"rows": rows, "statuses": statuses, "provenance": provenance}
        )
        return
    counts = ", ".join(f"{count} {status}" for status, count in statuses.items())
    say(f"wrote {rows} rows to {output}" + (f": {counts}" if counts else ""))


def _options(
    where: str,
    *,
    profile: str | None,
    tz: str | None,
    fold: str | None,
    time: str | None,
    speed_unit: str | None,
    free_speed: float | None,
    allow_partial: bool,
) -> FeedOptions:
    """Return what the options say that the feed does not."""
    from covertool.congestion.clock import parse_instant, zone
    from covertool.congestion.feeds.protocol import SPEED_UNITS, FeedOptions

    where_clock = zone(tz) if tz else None
    chosen_fold = own.fold_choice(fold)
    moment: datetime | None = None
    if time is not None:
        moment = parse_instant(time, where_clock, chosen_fold, "--time")
    unit = SPEED_UNITS.get(speed_unit or "km/h", 1.0)
    return FeedOptions(
        where=where,
        profile=own.profile_of(profile),
        tz=where_clock,
        fold=chosen_fold,
        time=moment,
        speed_unit=speed_unit,
        free_speed_mps=float("nan") if free_speed is None else free_speed * unit,
        allow_partial=allow_partial,
    )


def _with_sites(feed_options: FeedOptions, sites: Path | None, feed_format: str) -> FeedOptions:
    """Return the options with the places of a site table, or of TRIPS' routes."""
    from dataclasses import replace

    from covertool.gis.streams import open_stream

    if sites is None:
        return feed_options
    table_options = replace(feed_options, where=str(sites))
    with open_stream(sites) as stream:
        if feed_format == "trips":
            from covertool.congestion.feeds import trips

            return replace(feed_options, sites=trips.sites(trips.network(stream, table_options)))
        from covertool.congestion.feeds.sites import read_sites

        return replace(feed_options, sites=read_sites(stream, table_options))


def _is_network(source: Path) -> bool:
    """Return whether a TRIPS file is of the network itself, not of travel times on it."""
    from covertool.congestion.feeds.trips import TRAVEL_TIME

    return TRAVEL_TIME not in _columns(source)


def _columns(source: Path) -> list[str]:
    """Return the names in the first line of a table."""
    from covertool.gis.streams import open_stream

    with open_stream(source) as stream:
        first_line = stream.read(4096).partition(b"\n")[0]
    return [name.strip() for name in first_line.decode("utf-8-sig", "replace").split(",")]


def _network(source: Path, output: Path, feed_options: FeedOptions, overwrite: bool) -> int:
    """Write the network of a TRIPS file as a layer, and return the number of its rows."""
    from covertool.congestion.feeds import trips
    from covertool.gis.streams import open_stream
    from covertool.gis.write import write_layers

    layer = trips.layer_of(_columns(source))
    with open_stream(source) as stream:
        frame = trips.NETWORK[layer](stream, feed_options)
    metadata = whence([source]).to_metadata()
    write_layers(output, {layer: frame}, overwrite=overwrite, metadata=metadata)
    return len(frame)


def _observations(
    sources: list[Path],
    feed_format: str,
    output: Path,
    feed_options: FeedOptions,
    segments: str | None,
    overwrite: bool,
) -> tuple[int, dict[str, int]]:
    """Write the observations of a feed; return how many, and how many of each status."""
    from collections import Counter
    from collections.abc import Iterator
    from dataclasses import replace

    from covertool.congestion.feeds.protocol import feed
    from covertool.gis.observations import write_observations
    from covertool.gis.streams import open_stream

    join = _matcher(segments)
    statuses: Counter[str] = Counter()

    def batches() -> Iterator[Observations]:
        for source in sources:
            told = replace(feed_options, where=str(source))
            with open_stream(source) as stream:
                for batch in feed(feed_format).read(stream, told):
                    joined = join(batch)
                    statuses.update(joined.status.tolist())
                    yield joined

    rows = write_observations(output, batches(), overwrite=overwrite)
    return rows, dict(sorted(statuses.items()))


def _matcher(segments: str | None) -> Any:
    """Return what joins a batch to the network, or leaves it as it is."""
    if segments is None:
        return lambda batch: batch
    from covertool.congestion.matching import match_lines
    from covertool.congestion.streets import streets
    from covertool.gis.segments import read_segments

    network = streets(read_segments(segments))
    return lambda batch: match_lines(batch, network)

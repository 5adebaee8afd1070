"""Dublin City Council's TRIPS: its network of links, and travel times on them."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, BinaryIO

import numpy as np
import shapely
from pyproj import CRS

from covertool import crs
from covertool.congestion.clock import Instants, to_numpy
from covertool.congestion.feeds.columns import instants
from covertool.congestion.feeds.protocol import FeedOptions, Site
from covertool.congestion.status import status_of_speed
from covertool.errors import ColumnError, FileError, OptionError
from covertool.model import Floats, Objects, Observations

if TYPE_CHECKING:
    import geopandas as gpd
    import pandas as pd

_LOG = logging.getLogger(__name__)

IRISH_GRID = CRS.from_epsg(29903)
"""TM75 / Irish Grid, in which the network is published."""
TRAVEL_TIME = "STT"
"""The column of smoothed travel times, in seconds."""


def read(stream: BinaryIO, options: FeedOptions) -> Iterator[Observations]:
    """Yield the travel times of the links as observations.

    The speed of a link is its length (``options.sites``, from the network file) over the smoothed
    travel time STT in seconds; over ``options.free_speed_mps`` it gives the status. Times are in
    a column ``Time`` or ``Timestamp``, naive ones in local time, or all of ``options.time``.
    """
    import pandas as pd

    frame = _table(stream, options, ("TCS1", "TCS2"))
    if TRAVEL_TIME not in frame:
        raise ColumnError(
            f"there is no travel time {TRAVEL_TIME} (found: {', '.join(frame.columns)})",
            options.where,
            "give the travel times file of TRIPS",
        )
    if not options.free_speed_mps > 0:
        raise OptionError(
            "TRIPS gives travel times and no free-flow speed",
            options.where,
            "add --free-speed 50 --speed-unit km/h",
        )
    ids = _link_ids(frame)
    seconds = pd.to_numeric(frame[TRAVEL_TIME], errors="coerce").to_numpy(dtype=float)
    speed = np.where(seconds > 0, _lengths(ids, options.sites) / seconds, np.nan)
    relative = speed / options.free_speed_mps
    yield Observations.from_columns(
        ids,
        _times(frame, options),
        status_of_speed(relative, options.speed_profile),
        relative_speed=relative,
        speed_mps=speed,
    )


def network(stream: BinaryIO, options: FeedOptions) -> gpd.GeoDataFrame:
    """Return the links of the routes file as directed segments in Irish Transverse Mercator.

    A link that several routes share comes once. Links without coordinates are left out and
    counted. The id is ``trips_FROM_TO`` with the numbers of the two traffic signal sites.
    """
    import geopandas as gpd

    frame = _table(stream, options, ("TCS1", "TCS2", "WKT"))
    frame["segment_id"] = _link_ids(frame)
    # The file writes a comma inside a field as the word.
    wkt = frame["WKT"].fillna("").str.replace(" comma ", ", ", regex=False)
    lines = shapely.from_wkt(wkt.to_numpy(dtype=object), on_invalid="ignore")
    usable = shapely.is_valid(lines) & (shapely.length(lines) > 0)
    if not usable.all():
        _LOG.warning("%s: %d links without a line left out", options.where, int((~usable).sum()))
    frame, lines = frame[usable], lines[usable]
    fresh = ~frame["segment_id"].duplicated().to_numpy()
    moved = crs.transform_geometries(lines[fresh], IRISH_GRID, crs.IRISH_TM)
    columns = {"segment_id": frame["segment_id"][fresh].to_numpy(), "lanes": 1}
    return gpd.GeoDataFrame(columns, geometry=moved, crs=crs.IRISH_TM)


def junctions(stream: BinaryIO, options: FeedOptions) -> gpd.GeoDataFrame:
    """Return the traffic signal sites as points in Irish Transverse Mercator.

    Sites without coordinates are left out and counted.
    """
    import geopandas as gpd
    import pandas as pd

    frame = _table(stream, options, ("SiteID", "X", "Y"))
    x, y = (pd.to_numeric(frame[axis], errors="coerce").to_numpy(dtype=float) for axis in "XY")
    usable = (x > 0) & (y > 0)
    if not usable.all():
        _LOG.warning(
            "%s: %d sites without coordinates left out", options.where, int((~usable).sum())
        )
    moved = crs.transform(x[usable], y[usable], IRISH_GRID, crs.IRISH_TM)
    return gpd.GeoDataFrame(
        {
            "id": frame["SiteID"][usable].astype(str).to_numpy(),
            "name": frame.get("Location", frame["SiteID"])[usable].str.strip().to_numpy(),
        },
        geometry=shapely.points(*moved),
        crs=crs.IRISH_TM,
    )


NETWORK: Mapping[str, Callable[[BinaryIO, FeedOptions], gpd.GeoDataFrame]] = {
    "segments": network,
    "junctions": junctions,
}
"""What reads each layer of the network."""


def layer_of(columns: Sequence[str]) -> str:
    """Return which layer of the network a file with these columns holds.

    >>> layer_of(["SiteID", "X", "Y"]), layer_of(["TCS1", "TCS2", "WKT"])
    ('junctions', 'segments')
    """
    return "junctions" if "SiteID" in columns else "segments"


def sites(segments: gpd.GeoDataFrame) -> dict[str, Site]:
    """Return the links of a network as places with their length."""
    lengths = segments.geometry.length.to_numpy(dtype=float)
    return {
        str(segment): Site(str(segment), length_m=float(length))
        for segment, length in zip(segments["segment_id"], lengths, strict=True)
    }


def _table(stream: BinaryIO, options: FeedOptions, needed: tuple[str, ...]) -> pd.DataFrame:
    """Return a TRIPS file as text, with the columns that are needed."""
    import pandas as pd

    try:
        frame = pd.read_csv(stream, skipinitialspace=True, encoding="utf-8-sig", dtype=str)
    except (pd.errors.ParserError, pd.errors.EmptyDataError, UnicodeDecodeError) as fault:
        raise FileError(
            f"the table cannot be read: {fault}", options.where, "give a TRIPS file as published"
        ) from None
    missing = [name for name in needed if name not in frame]
    if missing:
        raise ColumnError(
            f"there is no column {' nor '.join(missing)} (found: {', '.join(map(str, frame))})",
            options.where,
            "give the TRIPS file as it is published",
        )
    return frame


def _link_ids(frame: pd.DataFrame) -> Objects:
    pairs = zip(frame["TCS1"], frame["TCS2"], strict=True)
    return np.array([f"trips_{a}_{b}" for a, b in pairs], dtype=object)


def _lengths(ids: Objects, places: Mapping[str, Site]) -> Floats:
    lengths = np.array([places[i].length_m if i in places else np.nan for i in ids.tolist()])
    lost = int((~np.isfinite(lengths)).sum())
    if lost:
        _LOG.warning("%d travel times are on links of unknown length and stay unknown", lost)
    return lengths


def _times(frame: pd.DataFrame, options: FeedOptions) -> Instants:
    named = next((c for c in frame.columns if str(c).lower() in ("time", "timestamp")), None)
    if named is not None:
        return instants(frame[named], options)
    if options.time is None:
        raise ColumnError("the table has no column Time", options.where, "add --time")
    return np.full(len(frame), to_numpy(options.time))

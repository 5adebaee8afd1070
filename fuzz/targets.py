"""What is fuzzed: each target takes any bytes, and only a CovertoolError may come of them."""

from __future__ import annotations

import contextlib
import io
import tempfile
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

from covertool.cli.run import verbs
from covertool.congestion.clock import zone
from covertool.congestion.feeds.protocol import FeedOptions, feed
from covertool.errors import CovertoolError
from covertool.gis.osm import read_roads
from covertool.gis.read import read_anchors, read_transit
from covertool.gis.sample import SAMPLE_STUDY, sample_folder
from covertool.plan import read_plan
from covertool.traffic.network import Network, read_network
from covertool.traffic.routes import read_routes
from covertool.traffic.trace import read_fcd

Target = Callable[[bytes], None]

CORPUS = Path(__file__).parent / "corpus"
"""A folder for each target, of small inputs that reach far into its reader."""

FEEDS = ("csv", "waze", "tomtom", "sumo", "datex2", "trips")
_FOLDER = tempfile.TemporaryDirectory(prefix="covertool-fuzz-")


def _feed(name: str) -> Target:
    options = FeedOptions(
        tz=zone("Europe/Dublin"), time=datetime(2014, 6, 16, tzinfo=UTC), free_speed_mps=13.9
    )

    def target(content: bytes) -> None:
        with contextlib.suppress(CovertoolError):
            for _ in feed(name).read(io.BytesIO(content), options):
                pass

    return target


def _file(name: str, read: Callable[[Path], object]) -> Target:
    """Return a target whose reader is given the bytes as a file of that name."""
    path = Path(_FOLDER.name) / name

    def target(content: bytes) -> None:
        path.write_bytes(content)
        with contextlib.suppress(CovertoolError):
            read(path)

    return target


def _net(path: Path) -> Network:
    return read_network(path, net_crs="EPSG:2157")


def _routes() -> Target:
    network = _net(CORPUS / "net" / "streets.net.xml")
    return _file("cars.rou.xml", lambda path: read_routes([path], network))


def _plan() -> Target:
    declared, sample = verbs(), sample_folder() / SAMPLE_STUDY
    return _file("plan.toml", lambda path: read_plan(path, declared, sample))


TARGETS: dict[str, Target] = {
    **{f"feed-{name}": _feed(name) for name in FEEDS},
    "plan": _plan(),
    "points": _file("points.csv", lambda path: read_anchors(path, crs="EPSG:2157")),
    "geojson": _file("area.geojson", read_transit),
    "osm": _file("town.osm", read_roads),
    "net": _file("town.net.xml", _net),
    "net-gz": _file("town.net.xml.gz", _net),
    "routes": _routes(),
    "fcd-csv": _file("fcd.csv", read_fcd),
    "fcd-xml": _file("fcd.xml", read_fcd),
}
"""Targets by name."""

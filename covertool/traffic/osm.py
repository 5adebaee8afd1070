"""OSM extracts become SUMO nets, by netconvert."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
from pyproj import CRS

from covertool.errors import FileError, OptionError
from covertool.gis.osm import read_roads
from covertool.traffic.driving_side import SIDES, side_of_roads
from covertool.traffic.edges import Network
from covertool.traffic.graph import largest_component
from covertool.traffic.netconvert import netconvert, projection_text

_LOG = logging.getLogger(__name__)
_OPTIONS = (
    "--keep-edges.by-vclass=passenger",
    "--remove-edges.isolated",
    "--geometry.remove",
    "--roundabouts.guess",
    "--junctions.join",
    "--tls.guess",
    "--tls.guess-signals",
    "--tls.discard-simple",
    "--tls.join",
    "--output.street-names",
    "--no-turnarounds.except-deadend",
)


def network_from_osm(
    path: str | Path, folder: str | Path, *, driving_side: str | None = None
) -> Network:
    """Return the network that netconvert makes of an OSM extract, written into ``folder``.

    Traffic lights are guessed, and only the largest strongly connected part is kept: there every
    street can be reached from every other.

    Parameters
    ----------
    path : .osm or .osm.gz
    folder : an existing folder; the net is ``osm.net.xml`` in it
    driving_side : left, right, or None to read it from the roads

    Raises
    ------
    FileError
        When the extract is absent, cut off, or a PBF, which netconvert cannot read.
    MissingExtraError
        When SUMO is not installed.
    """
    if str(path).lower().endswith(".pbf"):
        raise FileError(
            "netconvert reads OSM as XML only, not as PBF",
            str(path),
            f"convert it first: osmium cat {path} -o {Path(path).name.split('.')[0]}.osm.gz",
        )
    roads = read_roads(path)  # refuses what is cut off, which netconvert would take for a town
    side = _checked(driving_side) or side_of_roads(roads, str(path))
    projection = projection_text(CRS.from_user_input(roads.crs))
    raw = Path(folder).resolve() / "raw.net.xml"
    options = [f"--osm-files={Path(path).resolve()}", f"--proj={projection}", *_OPTIONS]
    if side == "left":
        options.append("--lefthand")
    network = netconvert(options, raw, str(path))
    return _connected(network, raw.with_name("osm.net.xml"), str(path))


def _checked(side: str | None) -> str | None:
    if side is not None and side not in SIDES:
        raise OptionError(
            f"cars cannot drive on the side {side!r}", "--driving-side", f"use {' or '.join(SIDES)}"
        )
    return side


def _connected(network: Network, net: Path, where: str) -> Network:
    """Return the largest strongly connected part of a network, as a net of its own."""
    kept = largest_component(network)
    length_m = {name: edge.length_m for name, edge in network.edges.items()}
    lost = 1 - np.sum([length_m[name] for name in kept]) / np.sum(list(length_m.values()))
    if lost > 0.1:
        _LOG.warning(
            "%s: %.0f %% of the street length is left out, for cars could not drive "
            "there and back (one-way streets cut off by the edge of the extract)",
            where, 100 * lost,
        )  # fmt: skip
    chosen = net.with_name("kept.edges.txt")
    chosen.write_text("".join(f"edge:{name}\n" for name in kept), encoding="utf-8")
    return netconvert(
        [
            f"--sumo-net-file={network.path}",
            f"--keep-edges.input-file={chosen}",
            *(["--lefthand"] if network.left_hand else []),
        ],
        net,
        where,
    )

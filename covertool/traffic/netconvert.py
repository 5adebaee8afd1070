"""netconvert: one run of it, judged by the net that it leaves."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pyproj import CRS

from covertool.errors import ComputationError
from covertool.traffic.child import run_program
from covertool.traffic.disk import refuse_full_disk
from covertool.traffic.edges import Network
from covertool.traffic.netfile import read_network
from covertool.traffic.sumo import find_sumo

TIMEOUT_S = 1800.0


def netconvert(arguments: Sequence[str], net: Path, where: str) -> Network:
    """Run netconvert so that it writes ``net``, and return the network.

    Raises
    ------
    ComputationError
        When it fails or ends early.
    """
    finished = run_program(
        find_sumo(), "netconvert", [*arguments, "-o", net.name], net.parent, timeout_s=TIMEOUT_S
    )
    refuse_full_disk(net.parent, f"the net {net}")
    if finished.code != 0 or not net.is_file():
        raise ComputationError(
            f"netconvert {finished.ending}: {finished.first_error or finished.last_lines}",
            where,
            "mend the input as the message says, or build the net by hand and name it with --net",
        )
    return read_network(net)


def projection_text(crs: CRS) -> str:
    """Return how to name a CRS to SUMO: by its code, which keeps the datum, else by PROJ string."""
    code = crs.to_authority(min_confidence=100)
    return ":".join(code) if code is not None else crs.to_proj4()

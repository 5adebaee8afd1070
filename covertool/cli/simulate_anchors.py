"""The parked cars of `covertool simulate`: which files, which of them along the streets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from covertool.cli.console import say

if TYPE_CHECKING:
    from pyproj import CRS

    from covertool.cli.simulate_asked import Asked
    from covertool.model import Anchors
    from covertool.traffic.demand import Demand
    from covertool.traffic.network import Network


def along(asked: Asked, anchors: Anchors, network: Network, demands: Sequence[Demand]) -> Anchors:
    """Return the anchors along the street circuit, or those in the net for a user's routes."""
    from covertool.errors import GeometryError
    from covertool.traffic.vicinity import anchors_along, require_inside

    try:
        edges = dict.fromkeys(edge for demand in demands for edge in demand.circuit)
        if not edges:
            require_inside(anchors, network)
            return anchors
        return anchors_along(anchors, network, edges, distance_m=along_m(asked))
    except GeometryError:
        if asked.allow_unheard and len(anchors):
            return anchors
        raise


def along_m(asked: Asked) -> float:
    """Return how near to the street circuit anchors must stand, in metres."""
    from covertool.traffic.vicinity import ALONG_M

    return ALONG_M if asked.along_m is None else asked.along_m


def read_parked(asked: Asked, dst_crs: CRS) -> tuple[Anchors, list[Path]]:
    """Return the parked cars, and on request the queued ones, in the CRS of the traffic."""
    from covertool.gis.guard import layer_spec
    from covertool.gis.read import read_anchors
    from covertool.model import Anchors

    specs: Sequence[str] = asked.anchors or [f"{asked.study}:anchors"]
    crs = asked.crs if asked.anchors else None
    anchors = Anchors.concatenate([read_anchors(spec, crs=crs, dst_crs=dst_crs) for spec in specs])
    files = list(dict.fromkeys(layer_spec(spec)[0] for spec in specs))
    queued = anchors.origin == "queue"
    if not asked.queue_anchors:
        if queued.any():
            say(f"left out {int(queued.sum())} queued cars; --queue-anchors takes them")
        return anchors.take(~queued), files
    if not queued.any():
        anchors = Anchors.concatenate([anchors, _queued(asked, dst_crs)])
    return anchors, files


def _queued(asked: Asked, dst_crs: CRS) -> Anchors:
    """Return the queued cars of the sample study's congestion; another study brings its own."""
    from covertool import crs as crs_door
    from covertool.cli import congestion_case
    from covertool.congestion.queues import QueueOptions
    from covertool.errors import ColumnError
    from covertool.gis.sample import SAMPLE_STUDY, sample_folder

    if asked.study != sample_folder() / SAMPLE_STUDY:
        raise ColumnError(
            "none of the anchors is of origin queue",
            ", ".join(asked.anchors) or str(asked.study),
            "covertool anchors queue OBSERVATIONS --segments FILE --into STUDY.gpkg",
        )
    queued = congestion_case.read_case(congestion_case.Asked()).queued_cars(QueueOptions())
    cars = queued.anchors
    say(f"{len(cars)} queued cars on {queued.day}, {queued.window} (synthetic)")
    x_m, y_m = crs_door.transform(cars.x_m, cars.y_m, cars.crs, dst_crs)
    return replace(cars, x_m=x_m, y_m=y_m, crs=dst_crs)

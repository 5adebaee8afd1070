"""What `covertool simulate` is about: the traffic, and the parked cars along its streets."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from covertool.cli.console import progress, say
from covertool.cli.simulate_anchors import along, along_m, read_parked
from covertool.cli.simulate_asked import Asked

if TYPE_CHECKING:
    import geopandas as gpd

    from covertool.model import Anchors
    from covertool.traffic.demand import Demand
    from covertool.traffic.mobility import Mobility
    from covertool.traffic.network import Network


@dataclass(frozen=True)
class Case:
    """Traffic and parked cars, read and ready.

    ``source`` says what the streets are; ``synthetic`` that they are of the sample study.
    """

    mobilities: tuple[Mobility, ...]
    anchors: Anchors
    kind: str
    source: str
    synthetic: bool
    files: tuple[Path, ...]
    study: Path | None


def read_case(asked: Asked) -> Case:
    """Return the traffic that was asked for, driven by SUMO or read, and its parked cars."""
    from covertool.errors import MissingExtraError
    from covertool.traffic.sumo import find_sumo

    if asked.of_sample:
        from covertool.gis.sample import SAMPLE_STUDY, sample_folder

        study = sample_folder() / SAMPLE_STUDY
        say(f"no study was named: using the synthetic sample study {study}")
        asked = replace(asked, study=study)
        try:
            find_sumo()
        except MissingExtraError:
            return _shipped(asked)
        return _driven(asked, synthetic=True)
    if asked.fcd is not None:
        return _recorded(asked)
    find_sumo()
    return _driven(asked)


def _shipped(asked: Asked) -> Case:
    """Return the trace that ships with the sample study, where SUMO is not installed."""
    from covertool.gis.sample import SAMPLE_TRACE, sample_folder

    wants = asked.kind != "town" or asked.traffic_seeds != (1,) or asked.anchors_as != "points"
    if wants or asked.horizon_s is not None:
        from covertool.errors import MissingExtraError

        raise MissingExtraError(
            "SUMO is not installed, and the shipped trace holds one town run only",
            "--scenario, --traffic-seed, --horizon, --routes, --anchors-as",
            "pip install 'covertool[simulate]', or leave these options out",
        )
    path = sample_folder() / SAMPLE_TRACE
    say(
        f"SUMO is not installed: using the trace shipped with the sample study ({path.name}); "
        "pip install 'covertool[simulate]' drives it anew"
    )
    given = replace(asked, fcd=path, crs="EPSG:2157", along_m=along_m(asked))
    return replace(_recorded(given), kind="town", synthetic=True)


def _recorded(asked: Asked) -> Case:
    """Return the traffic of an existing trace."""
    from covertool.traffic.encounters import anchors_on_way
    from covertool.traffic.mobility import recorded
    from covertool.traffic.network import read_network

    assert asked.fcd is not None
    network = read_network(asked.net, net_crs=asked.net_crs) if asked.net else None
    crs = None if network else asked.crs or asked.net_crs
    mobility = recorded(asked.fcd, network=network, crs=crs, horizon_s=asked.horizon_s)
    anchors, files = read_parked(asked, mobility.crs)
    if asked.along_m is not None:
        anchors = anchors_on_way(anchors, mobility.trace, asked.along_m)
    read = [asked.fcd, *([asked.net] if asked.net else []), *files]
    return Case((mobility,), anchors, "recorded", str(asked.fcd), False, tuple(read), asked.study)


def _driven(asked: Asked, *, synthetic: bool = False) -> Case:
    """Return the traffic that SUMO drives, once for each seed."""
    from covertool.traffic.mobility import drive

    with tempfile.TemporaryDirectory(prefix="covertool-") as folder:
        network, source = _network(asked, Path(folder))
        anchors, files = read_parked(asked, network.crs)
        demands = [_demand(asked, network, seed) for seed in asked.traffic_seeds]
        anchors = along(asked, anchors, network, demands)
        mobilities = []
        for seed, demand in zip(asked.traffic_seeds, demands, strict=True):
            with progress("SUMO drives", round(demand.horizon_s)) as advance:
                mobilities.append(
                    drive(
                        network,
                        demand,
                        seed=seed,
                        anchors=anchors,
                        anchors_as=asked.anchors_as,
                        timeout_s=asked.timeout_s,
                        on_time=_steps(advance),
                    )
                )
    read = (source, *asked.routes, *files)
    return Case(tuple(mobilities), anchors, asked.kind, str(source), synthetic, read, asked.study)


def _steps(advance: Callable[[float], object]) -> Callable[[float], object]:
    """Return a function that turns the simulated time so far into steps of a bar."""
    last = [0.0]

    def tell(time_s: float) -> None:
        advance(time_s - last[0])
        last[0] = time_s

    return tell


def _network(asked: Asked, folder: Path) -> tuple[Network, Path]:
    """Return the streets, and the file that they come from."""
    from covertool.traffic.network import network_from_osm, network_from_streets, read_network

    if asked.net is not None:
        return read_network(asked.net, net_crs=asked.net_crs), asked.net
    if asked.osm is not None:
        return network_from_osm(asked.osm, folder, driving_side=asked.driving_side), asked.osm
    assert asked.study is not None
    return network_from_streets(_streets(asked.study), folder), asked.study


def _streets(study: Path) -> gpd.GeoDataFrame:
    """Return the centre lines of a study's streets."""
    from covertool.errors import FileError
    from covertool.gis.study import read_layers

    found = read_layers(study, ["streets"])
    if not found:
        raise FileError(
            "the study has no layer streets to drive on",
            str(study),
            "add --osm FILE or --net FILE for the same place",
        )
    return found["streets"]


def _demand(asked: Asked, network: Network, seed: int) -> Demand:
    from covertool.traffic import demand

    if asked.routes:
        horizon_s = asked.horizon_s or demand.TOWN_HORIZON_S
        return demand.user_routes(list(asked.routes), network, horizon_s=horizon_s)
    if asked.kind == "campus":
        horizon_s = asked.horizon_s or demand.CAMPUS_HORIZON_S
        return demand.campus_demand(network, seed=seed, horizon_s=horizon_s)
    horizon_s = asked.horizon_s or demand.TOWN_HORIZON_S
    return demand.town_demand(network, seed=seed, horizon_s=horizon_s)

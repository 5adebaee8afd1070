"""One run of SUMO: its input files, its command, and every check of what it left behind."""

from __future__ import annotations

import logging
import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from covertool.errors import ComputationError, CovertoolError, FileError, GeometryError
from covertool.gis.streams import open_stream
from covertool.model import Anchors
from covertool.traffic.child import Finished, run_program
from covertool.traffic.demand import Demand, Trip, require_seed
from covertool.traffic.disk import refuse_full_disk, write_xml
from covertool.traffic.edges import Network
from covertool.traffic.fcd import FcdRows, read_rows
from covertool.traffic.parked import anchor_points, parked_cars, parked_type
from covertool.traffic.sumo import find_sumo
from covertool.traffic.trace import CAR_LENGTH_M
from covertool.traffic.xml import elements

_LOG = logging.getLogger(__name__)
EDGE_DATA_S = 60.0
"""Length of the intervals of the edgeData."""
_TAIL_BYTES = 4096
_TELEPORTED = re.compile(r"^Warning: Teleporting vehicle '(.+?)';", re.MULTILINE)
_UNKNOWN_EDGE = re.compile(r"[Ee]dge '(.+?)'.*(?:is not known|unknown)")
_NO_WAY = re.compile(r"no valid route|No connection between edge|is not connected")
_COMMENT = re.compile(rb"<!--.*?-->\s*", re.DOTALL)


@dataclass(frozen=True)
class SumoRun:
    """What a run of SUMO left behind, checked.

    Attributes
    ----------
    rows : floating car data of all vehicles
    edge_data : SUMO's edgeData, without the comment that holds the time of writing
    version, seconds : of SUMO, and how long it ran
    end_s, running : at the end of the simulation
    loaded, inserted : vehicles that were due, and those that found room to enter
    teleports, collisions : how many SUMO counted
    teleported, collided : the vehicles that it names
    """

    rows: FcdRows
    edge_data: bytes
    version: str
    seconds: float
    end_s: float
    loaded: int
    inserted: int
    running: int
    teleports: int
    collisions: int
    teleported: frozenset[str]
    collided: frozenset[str]


def run_sumo(
    network: Network,
    demand: Demand,
    folder: Path,
    *,
    seed: int,
    step_s: float,
    anchors: Anchors | None,
    anchors_as: str,
    timeout_s: float,
    on_time: Callable[[float], object] | None = None,
) -> SumoRun:
    """Run SUMO on a demand in an empty folder and return what it left, once all of it is checked.

    Parameters
    ----------
    folder : where its files lie, with room for the trace
    network, demand, seed, step_s, anchors, anchors_as, timeout_s, on_time : as in
        :func:`covertool.traffic.mobility.drive`

    Raises
    ------
    MissingExtraError
        When SUMO is not installed or too old.
    ComputationError
        When it crashes, is stopped early, or runs out of time.
    FileError
        When the disk is full.
    GeometryError
        When SUMO refuses the routes, or no vehicle enters.
    """
    require_seed(seed)
    sumo = find_sumo()
    files = _Files(folder)
    files.write(network, demand, anchors, anchors_as)
    arguments = files.arguments(network, demand, seed, step_s)
    poll = None if on_time is None else lambda: on_time(files.reached_s() - demand.begin_s)
    started = time.monotonic()
    finished = run_program(sumo, "sumo", arguments, folder, timeout_s=timeout_s, on_poll=poll)
    seconds = time.monotonic() - started
    if finished.code != 0:
        raise _failed(finished, str(network.path))
    refuse_full_disk(folder, "the trace")
    return files.result(demand, step_s, sumo.version, seconds, finished)


class _Files:
    """The files of one run in its folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._routes = [folder / "trips.rou.xml"]
        self._additional = folder / "run.add.xml"
        self._fcd = folder / "fcd.csv"
        self._edges = folder / "edges.xml"
        self._statistics = folder / "statistics.xml"
        self._collisions = folder / "collisions.xml"

    def write(
        self, network: Network, demand: Demand, anchors: Anchors | None, anchors_as: str
    ) -> None:
        """Write what SUMO reads beside the net: vehicles, what to measure, and the anchors."""
        rows = [f'<edgeData id="covertool" file="{self._edges.name}" freq="{EDGE_DATA_S:g}"/>']
        kinds, cars = [_car_type()], [_vehicle(trip) for trip in demand.trips]
        if anchors is not None and anchors_as == "parked":
            areas, parked = parked_cars(anchors, network, demand.begin_s)
            rows += areas
            kinds.append(parked_type())
            cars = parked + cars
        elif anchors is not None:
            rows += anchor_points(anchors, network)
        write_xml(self._additional, "additional", rows)
        write_xml(self._routes[0], "routes", kinds + cars)
        if demand.user is not None:
            self._routes += demand.user.files

    def arguments(self, network: Network, demand: Demand, seed: int, step_s: float) -> list[str]:
        """Return the options of the command."""
        attributes = "x,y,angle,speed,lane" + (",type" if demand.user is not None else "")
        return [
            f"--net-file={network.path.resolve()}",
            f"--route-files={','.join(map(str, self._routes))}",
            f"--additional-files={self._additional}",
            f"--begin={demand.begin_s:g}",
            f"--end={demand.begin_s + demand.horizon_s:g}",
            f"--step-length={step_s:g}",
            f"--seed={seed}",
            f"--fcd-output={self._fcd}",
            f"--fcd-output.attributes={attributes}",
            f"--statistic-output={self._statistics}",
            f"--collision-output={self._collisions}",
            "--collision.action=warn",
            "--no-step-log",
            "--duration-log.disable",
        ]

    def reached_s(self) -> float:
        """Return the time of the last whole row of the trace so far."""
        try:
            with self._fcd.open("rb") as file:
                file.seek(max(0, self._fcd.stat().st_size - _TAIL_BYTES))
                lines = file.read().split(b"\n")
            return float(lines[-2].split(b";")[0])
        except (OSError, IndexError, ValueError):
            return 0.0

    def result(
        self, demand: Demand, step_s: float, version: str, seconds: float, finished: Finished
    ) -> SumoRun:
        """Return the run once its files prove that it came to its end."""
        told = _statistics(self._statistics)
        end_s = demand.begin_s + demand.horizon_s
        if told["end"] < end_s - step_s / 2:
            raise ComputationError(
                f"SUMO was stopped at {told['end']:g} s of {end_s:g} s, though its exit code is 0",
                self._statistics.name,
                "run it again and let it come to its end",
            )
        if not told["inserted"]:
            raise GeometryError(
                "no vehicles entered the net",
                f"{told['waiting']:g} waiting, {demand.begin_s:g} to {end_s:g} s",
                "let some depart within the horizon",
            )
        rows = read_rows(self._fcd)
        _require_last(rows, told, end_s, step_s)
        edge_data = _whole(self._edges, b"</meandata>")
        return SumoRun(
            rows=rows,
            edge_data=_COMMENT.sub(b"", edge_data, count=1),
            version=version,
            seconds=seconds,
            end_s=told["end"],
            # SUMO's own "loaded" also counts cars that are due after the end.
            loaded=int(told["waiting"] + told["inserted"]),
            inserted=int(told["inserted"]),
            running=int(told["running"]),
            teleports=int(told["teleports"]),
            collisions=int(told["collisions"]),
            teleported=frozenset(_TELEPORTED.findall(finished.messages)),
            collided=_collided(self._collisions),
        )


def _car_type() -> str:
    return f'<vType id="car" vClass="passenger" length="{CAR_LENGTH_M:g}"/>'


def _vehicle(trip: Trip) -> str:
    if trip.place is None:
        start = 'departLane="best" departPos="base"'
    else:
        start = f'departLane="{trip.place[0]}" departPos="{trip.place[1]:.2f}"'
    return (
        f'<vehicle id={quoteattr(trip.vehicle)} type="car" depart="{trip.depart_s:.2f}" {start} '
        f'departSpeed="max"><route edges={quoteattr(" ".join(trip.edges))}/></vehicle>'
    )


def _statistics(path: Path) -> dict[str, float]:
    """Return the numbers by which a run is judged."""
    found: dict[str, float] = {}
    wanted = {
        "performance": {"end": "end"},
        "vehicles": {"waiting": "waiting", "inserted": "inserted", "running": "running"},
        "teleports": {"total": "teleports"},
        "safety": {"collisions": "collisions"},
    }
    _whole(path, b"</statistics>")
    with open_stream(path) as stream:
        for element in elements(stream, wanted, path.name):
            for attribute, name in wanted[element.tag].items():
                found[name] = float(element.get(attribute, "nan"))
    return found


def _whole(path: Path, ending: bytes) -> bytes:
    """Return a file's bytes, which end as they must; else the disk was full or SUMO was killed."""
    content = path.read_bytes() if path.is_file() else b""
    if not content.rstrip().endswith(ending):
        raise FileError(
            f"SUMO left {path.name} {'cut off' if content else 'empty'}, though its exit code is 0",
            str(path.parent),
            "free some disk space (or set TMPDIR to a larger disk) and run it again",
        )
    return content


def _require_last(rows: FcdRows, told: dict[str, float], end_s: float, step_s: float) -> None:
    """Refuse a trace that ends early or lacks cars: what a disk that was full for a while does."""
    last_s = float(rows.time_s.max()) if len(rows) else -np.inf
    cars = len(set(rows.vehicle.tolist()))
    early = told["running"] > 0 and last_s < end_s - 1.5 * step_s
    if early or cars < told["inserted"]:
        raise FileError(
            f"the trace ends at {last_s:g} s of {end_s:g} s with {cars} of "
            f"{told['inserted']:g} vehicles, though SUMO's exit code is 0",
            "fcd.csv",
            "free some disk space (or set TMPDIR to a larger disk) and run it again",
        )


def _collided(path: Path) -> frozenset[str]:
    _whole(path, b">")
    found: set[str] = set()
    with open_stream(path) as stream:
        for element in elements(stream, {"collision"}, path.name):
            found.update(element.get(role, "") for role in ("collider", "victim"))
    return frozenset(found)


def _failed(finished: Finished, where: str) -> CovertoolError:
    """Return the error that tells why SUMO ended with a fault."""
    told = finished.first_error
    unknown, no_way = _UNKNOWN_EDGE.search(told), _NO_WAY.search(finished.messages)
    if unknown is not None:
        return GeometryError(
            f"the routes name the edge {unknown[1]}, which the net lacks",
            where,
            "route on this net",
        )
    if no_way is not None:
        return GeometryError(
            f"a route cannot be driven, for the streets are only weakly connected: {told}",
            where,
            "choose places that can be reached from each other, or mend the net's one-way streets",
        )
    if finished.ending.endswith("SIGXFSZ"):
        return FileError(
            "the trace grew beyond the largest file that is allowed here",
            where,
            "raise the limit (ulimit -f), or simulate fewer cars or a shorter horizon",
        )
    _LOG.warning("the last lines of SUMO's messages:\n%s", finished.last_lines)
    return ComputationError(
        f"SUMO {finished.ending}: {told or 'it told no reason'}",
        where,
        "see its last lines above; if it was killed, look whether the memory sufficed",
    )

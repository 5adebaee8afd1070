"""What the command line of `covertool simulate` says of traffic and parked cars."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import typer

SCENARIOS = ("campus", "town")


@dataclass(frozen=True)
class Asked:
    """What the command line says of traffic and parked cars."""

    study: Path | None
    anchors: tuple[str, ...]
    crs: str | None
    net: Path | None
    osm: Path | None
    fcd: Path | None
    net_crs: str | None
    driving_side: str | None
    scenario: str | None
    routes: tuple[Path, ...]
    horizon_s: float | None
    traffic_seeds: tuple[int, ...]
    anchors_as: str
    timeout_s: float
    along_m: float | None
    allow_unheard: bool
    queue_anchors: bool

    @property
    def of_sample(self) -> bool:
        """Whether nothing was named, so that it is about the sample study."""
        return self.study is None and not (self.net or self.osm or self.fcd)

    @property
    def kind(self) -> str:
        """Return campus, town, routes or recorded."""
        if self.fcd is not None:
            return "recorded"
        return "routes" if self.routes else self.scenario or "town"


def check(asked: Asked) -> None:
    """Refuse options that do not go together, before anything is read."""
    if (asked.net or asked.fcd) and asked.osm:
        raise typer.BadParameter("use --osm without --net and --fcd", param_hint="--osm")
    if (asked.net or asked.osm or asked.fcd) and not (asked.anchors or asked.study):
        raise typer.BadParameter(
            "name the parked cars: add --anchors FILE[:LAYER], or a study", param_hint="--anchors"
        )
    if asked.scenario not in (None, *SCENARIOS):
        raise typer.BadParameter("use campus or town", param_hint="--scenario")
    if asked.driving_side not in (None, "left", "right"):
        raise typer.BadParameter("use left or right", param_hint="--driving-side")
    if asked.anchors_as not in ("points", "parked"):
        raise typer.BadParameter("use points or parked", param_hint="--anchors-as")
    for given, name in ((asked.scenario, "--scenario"), (asked.routes, "--routes")):
        if given and asked.fcd:
            raise typer.BadParameter("a recorded trace has its own cars", param_hint=name)
    if asked.routes and asked.along_m is not None:
        raise typer.BadParameter("your own routes have no circuit", param_hint="--along")
    if asked.scenario and asked.routes:
        raise typer.BadParameter("use --scenario or --routes", param_hint="--routes")

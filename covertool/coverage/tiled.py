"""What tiles add up to: the findings of the whole, whoever computed the tiles.

Sums run over the tiles in their order, so that they do not depend on who was done first.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from covertool.coverage.curve import CoverageCurve, curve_of
from covertool.coverage.penetration import PenetrationPoint, joined, points_of
from covertool.coverage.radii import Radius
from covertool.coverage.tiles import TileFindings, TileJob, ZonePart
from covertool.coverage.zones import ZoneCoverage, require_area
from covertool.model import CoverageReport, RadiusCoverage
from covertool.spread import Ledger, spread_in_order


@dataclass(frozen=True)
class TiledCoverage:
    """The findings of a run in tiles; what was not wished for is empty."""

    report: CoverageReport
    curve: CoverageCurve | None
    penetration: tuple[PenetrationPoint, ...]
    zones: tuple[ZoneCoverage, ...]


def tiled_coverage(
    job: TileJob,
    *,
    shares: Sequence[float] = (),
    workers: int = 1,
    scheduler: str | None = None,
    ledger: Ledger | None = None,
    on_done: Callable[[int], object] | None = None,
) -> TiledCoverage:
    """Return what the same inputs give in memory, computed tile by tile.

    Regions are left in the ledger, where `tile_regions` finds them: a country's do not fit in
    memory.

    Parameters
    ----------
    job : the tiles and what to find in them
    shares : of equipped cars; the job must have measured depths
    workers, scheduler, ledger, on_done : see `covertool.spread.spread`

    Raises
    ------
    GeometryError
        When nothing of the transit area lies in the area of interest.
    """
    tiles = [
        replace(tile, regions={})
        for tile in spread_in_order(
            job,
            range(len(job.plan)),
            workers=workers,
            scheduler=scheduler,
            ledger=ledger,
            on_done=on_done,
        )
    ]
    total_m2 = math.fsum(tile.transit_area_m2 for tile in tiles)
    if job.wish.area_of_interest is not None:
        require_area(total_m2)
    report = _report(job, tiles, total_m2)
    together = [result for result in report.results if result.origin is None]
    named = dict(zip(job.radii, together, strict=True))
    return TiledCoverage(
        report,
        _curve(job, tiles, total_m2),
        tuple(_penetration(tiles, named, shares)) if shares else (),
        tuple(_zones(job, tiles)),
    )


def tiled_levels(
    job: TileJob,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    ledger: Ledger | None = None,
    on_done: Callable[[int], object] | None = None,
) -> CoverageReport:
    """Return the report that `coverage_levels` gives, computed tile by tile."""
    return tiled_coverage(
        job, workers=workers, scheduler=scheduler, ledger=ledger, on_done=on_done
    ).report


def tile_regions(job: TileJob, ledger: Ledger) -> Iterator[tuple[int, TileFindings]]:
    """Yield each tile with its findings, read from the ledger one at a time."""
    for tile in range(len(job.plan)):
        found, findings = ledger.recall(tile)
        yield tile, findings if found else job(tile)


def _report(job: TileJob, tiles: Sequence[TileFindings], total_m2: float) -> CoverageReport:
    """Return the levels of every radius and origin over all tiles."""
    counts: dict[str, int] = {}
    for tile in tiles:
        for origin, count in tile.anchors.items():
            counts[origin] = counts.get(origin, 0) + count
    present = sorted(origin for origin, count in counts.items() if count)
    groups = [None, *(present if len(present) > 1 else [])]
    anchors = sum(counts.values())
    results = tuple(
        _joined(
            radius,
            origin,
            anchors if origin is None else counts[origin],
            [tile.levels.get((radius, origin)) for tile in tiles],
            [tile.transit_area_m2 for tile in tiles],
        )
        for radius in job.radii
        for origin in groups
    )
    return CoverageReport(total_m2, anchors, results)


def _joined(
    radius: Radius,
    origin: str | None,
    anchors: int,
    found: Sequence[RadiusCoverage | None],
    areas_m2: Sequence[float],
) -> RadiusCoverage:
    """Return the sum of the tiles; one without such anchors adds only to Level 0."""
    parts = [
        part.areas_m2 if part is not None else (area, 0.0, 0.0, 0.0)
        for part, area in zip(found, areas_m2, strict=True)
    ]
    none, one, two, three = (math.fsum(part[level] for part in parts) for level in range(4))
    names = {
        (part.radius_m, part.device_class)
        for part in found
        if part is not None and (part.anchors or radius is not None)
    }
    radius_m, device_class = names.pop() if len(names) == 1 else (None, None)
    return RadiusCoverage(
        radius_m=radius_m,
        device_class=device_class,
        origin=origin,
        anchors=anchors,
        areas_m2=(none, one, two, three),
        closure_m=max((part.closure_m for part in found if part is not None), default=0.0),
    )


def _zones(job: TileJob, tiles: Sequence[TileFindings]) -> Iterator[ZoneCoverage]:
    """Yield the coverage of each zone at each radius over all tiles."""
    if job.wish.zones is None:
        return
    parts: dict[tuple[str, Radius], list[ZonePart]] = {}
    for tile in tiles:
        for key, part in tile.zones.items():
            parts.setdefault(key, []).append(part)
    for zone in job.wish.zones.read():
        for radius in job.radii:
            here = parts.get((zone, radius), [])
            coverage = _joined(
                radius,
                None,
                sum(part.anchors for part in here),
                [part.levels for part in here],
                [part.transit_area_m2 for part in here],
            )
            yield ZoneCoverage(zone, math.fsum(part.transit_area_m2 for part in here), coverage)


def _curve(job: TileJob, tiles: Sequence[TileFindings], total_m2: float) -> CoverageCurve | None:
    if not job.wish.curve_m:
        return None
    found = [tile.curve for tile in tiles if tile.curve is not None]
    nodes = np.zeros((len(job.wish.curve_m), 8))
    for node in range(len(nodes)):
        nodes[node, :7] = [math.fsum(part[node, i] for part in found) for i in range(7)]
        nodes[node, 7] = max((float(part[node, 7]) for part in found), default=0.0)
    return curve_of(np.array(job.wish.curve_m), nodes, total_m2)


def _penetration(
    tiles: Sequence[TileFindings], named: dict[Radius, RadiusCoverage], shares: Sequence[float]
) -> Iterator[PenetrationPoint]:
    for radius, result in named.items():
        measured = [tile for tile in tiles if radius in tile.depths]
        profile = joined(
            [tile.depths[radius] for tile in measured],
            [tile.transit_area_m2 for tile in measured],
        )
        yield from points_of(profile, shares, result.radius_m, result.device_class)

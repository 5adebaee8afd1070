"""`covertool coverage` in tiles: one process, several, or a dask cluster."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from covertool.cli.console import progress
from covertool.cli.coverage_findings import Findings
from covertool.cli.coverage_radii import asked_radii, default_radii

if TYPE_CHECKING:
    from covertool.cli.inputs import Inputs
    from covertool.coverage.tiles import TileJob


def run_tiles(
    inputs: Inputs,
    radius: list[str] | None,
    classes: list[str] | None,
    crs: str | None,
    dst_crs: str | None,
    *,
    workers: int,
    scheduler: str | None,
    tile_m: float | None,
    resume: Path | None,
) -> Findings:
    """Return the table of levels, computed in tiles."""
    from covertool.coverage.tiles import tiled_levels
    from covertool.spread import Ledger

    job = _job(inputs, radius, classes, crs, dst_crs, tile_m)
    ledger = Ledger(resume, _fingerprint(inputs, job)) if resume is not None else None
    with progress("tiles", len(job.plan)) as advance:
        report = tiled_levels(
            job, workers=workers, scheduler=scheduler, ledger=ledger, on_done=advance
        )
    if ledger is not None:
        ledger.clear(range(len(job.plan)))
    return Findings(report, job.transit.crs, job.transit.bounds)


def _job(
    inputs: Inputs,
    radius: list[str] | None,
    classes: list[str] | None,
    crs: str | None,
    dst_crs: str | None,
    tile_m: float | None,
) -> TileJob:
    from covertool.coverage.tiles import plan_job
    from covertool.gis.sources import open_anchors, open_transit, summary_of

    transit = open_transit(inputs.transit, crs, dst_crs)
    anchors = open_anchors(inputs.anchors, crs, transit.crs)
    summary = summary_of(anchors)
    radii = asked_radii(radius, classes) or default_radii(summary.all_own)
    return plan_job(
        anchors,
        transit,
        radii,
        anchors_count=summary.count,
        largest_own_m=summary.largest_own_m,
        tile_m=tile_m,
    )


def _fingerprint(inputs: Inputs, job: TileJob) -> str:
    """Return what decides the result of every tile: the files' content, the plan, the radii."""
    from covertool.gis.provenance import sha256, versions

    files = [sha256(path) for path in inputs.files()]
    return repr((files, job.plan, job.radii, job.transit.crs.to_wkt(), versions()))

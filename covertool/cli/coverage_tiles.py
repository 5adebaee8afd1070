"""`covertool coverage` in tiles: one process, several, or a dask cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from covertool.cli.console import progress
from covertool.cli.coverage_findings import Findings
from covertool.cli.coverage_radii import asked_radii, default_radii

if TYPE_CHECKING:
    from covertool.cli.inputs import Inputs
    from covertool.coverage.tiles import TileJob, Wish
    from covertool.spread import Ledger


@dataclass(frozen=True)
class Tiling:
    """How a run is cut in tiles and who computes them."""

    workers: int
    scheduler: str | None
    tile_m: float | None
    resume: Path | None


@dataclass(frozen=True)
class Asked:
    """What a run in tiles is to find, as the options say it."""

    radius: list[str] | None
    classes: list[str] | None
    by: str | None
    aoi: str | None
    curve: str | None
    shares: Sequence[float]
    regions: bool


def run_tiles(
    inputs: Inputs,
    asked: Asked,
    crs: str | None,
    dst_crs: str | None,
    tiling: Tiling,
    write: Callable[[Findings, dict[str, Any]], None],
) -> Findings:
    """Return what was found tile by tile; ``write`` is called with it and the level layers.

    The tiles that were finished are forgotten only when everything has been written.
    """
    from covertool.coverage.penetration import check_shares
    from covertool.coverage.tiled import tiled_coverage

    check_shares(asked.shares)
    job = _job(inputs, asked, crs, dst_crs, tiling.tile_m)
    with _ledger(inputs, job, tiling.resume) as ledger:
        with progress("tiles", len(job.plan)) as advance:
            found = tiled_coverage(
                job,
                shares=asked.shares,
                workers=tiling.workers,
                scheduler=tiling.scheduler,
                ledger=ledger,
                on_done=advance,
            )
        findings = Findings(
            found.report,
            job.transit.crs,
            job.transit.bounds,
            found.curve,
            found.penetration,
            found.zones,
        )
        write(findings, _layers(job, findings, ledger) if ledger and asked.regions else {})
        if ledger is not None:
            ledger.clear(range(len(job.plan)))
    return findings


def _layers(job: TileJob, findings: Findings, ledger: Ledger) -> dict[str, Any]:
    """Return the level layers in parts, one a tile, read from the ledger when they are written."""
    from covertool.coverage.layers import tile_layer, tile_sample
    from covertool.coverage.tiled import tile_regions
    from covertool.gis.columns import Parts
    from covertool.model import LEVELS

    report = findings.report

    def parts(level: int) -> Any:
        return tile_layer(level, job, report, tile_regions(job, ledger))

    return {
        f"coverage_level_{level}": Parts(tile_sample(level, job, report), partial(parts, level))
        for level in LEVELS[1:]
    }


@contextmanager
def _ledger(inputs: Inputs, job: TileJob, resume: Path | None) -> Iterator[Ledger | None]:
    """Yield the ledger of finished tiles: in a folder to keep, or one for this run's polygons."""
    import tempfile

    from covertool.spread import Ledger

    if resume is not None:
        yield Ledger(resume, _fingerprint(inputs, job))
    elif job.wish.regions:
        with tempfile.TemporaryDirectory(prefix="covertool-") as folder:
            yield Ledger(Path(folder) / "tiles", "this run")
    else:
        yield None


def _job(
    inputs: Inputs, asked: Asked, crs: str | None, dst_crs: str | None, tile_m: float | None
) -> TileJob:
    from covertool.coverage.tiles import plan_job
    from covertool.gis.sources import open_anchors, open_transit, summary_of

    named = asked_radii(asked.radius, asked.classes)
    transit = open_transit(inputs.transit, crs, dst_crs)
    anchors = open_anchors(inputs.anchors, crs, transit.crs)
    summary = summary_of(anchors)
    return plan_job(
        anchors,
        transit,
        named or default_radii(summary.all_own),
        anchors_count=summary.count,
        largest_own_m=summary.largest_own_m,
        tile_m=tile_m,
        wish=_wish(inputs, asked, transit.crs),
    )


def _wish(inputs: Inputs, asked: Asked, crs: Any) -> Wish:
    from covertool.coverage.curve import parse_radii
    from covertool.coverage.tiles import Wish
    from covertool.gis.zones import AreaOfInterest, ZonesOf

    return Wish(
        area_of_interest=AreaOfInterest(asked.aoi, crs) if asked.aoi is not None else None,
        zones=ZonesOf(asked.by, inputs.transit, crs) if asked.by is not None else None,
        curve_m=tuple(parse_radii(asked.curve).tolist()) if asked.curve is not None else (),
        depths=bool(asked.shares),
        regions=asked.regions,
    )


def _fingerprint(inputs: Inputs, job: TileJob) -> str:
    """Return what decides the result of every tile: the files' content, the plan, the wishes."""
    from covertool.gis.provenance import sha256, versions

    zones = [source.file() for source in (job.wish.area_of_interest, job.wish.zones) if source]  # type: ignore[attr-defined]
    files = [sha256(path) for path in (*inputs.files(), *zones)]
    return repr((files, job.plan, job.radii, job.wish, job.transit.crs.to_wkt(), versions()))

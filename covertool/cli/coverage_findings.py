"""What a run of `covertool coverage` is about and what it found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pyproj import CRS

    from covertool.coverage import CoverageCurve
    from covertool.coverage.penetration import PenetrationPoint
    from covertool.coverage.radii import Radius
    from covertool.coverage.zones import ZoneCoverage
    from covertool.model import Anchors, Bounds, CoverageReport, TransitArea


@dataclass(frozen=True)
class Town:
    """What a run in memory is about."""

    anchors: Anchors
    transit: TransitArea
    radii: tuple[Radius, ...]


@dataclass(frozen=True)
class RasterFindings:
    """Size of the level raster, and the fractions counted along the lines of its rows."""

    gsd_m: float
    width: int
    height: int
    fractions: tuple[float, ...]


@dataclass(frozen=True)
class Findings:
    """What one run found; what was not asked for is empty."""

    report: CoverageReport
    crs: CRS
    bounds: Bounds
    curve: CoverageCurve | None = None
    penetration: tuple[PenetrationPoint, ...] = ()
    zones: tuple[ZoneCoverage, ...] = ()
    raster: RasterFindings | None = None

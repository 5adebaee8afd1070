"""What a run found as tables without geometry, which a study holds beside its layers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from covertool.coverage.curve import CoverageCurve
from covertool.coverage.penetration import PenetrationPoint
from covertool.coverage.zones import ZoneCoverage
from covertool.model import LEVELS, CoverageReport

if TYPE_CHECKING:
    import pandas as pd


def finding_tables(
    report: CoverageReport,
    curve: CoverageCurve | None = None,
    penetration: Sequence[PenetrationPoint] = (),
    zones: Sequence[ZoneCoverage] = (),
) -> dict[str, pd.DataFrame]:
    """Return the tables ``coverage_summary``, and of the others those that hold something.

    Each has one row for each level of a radius (``coverage_summary``), of a node
    (``coverage_curve``), of a share (``coverage_penetration``) or of a zone (``coverage_zones``).
    """
    found = {"coverage_summary": report.to_frame()}
    if curve is not None:
        found["coverage_curve"] = curve.to_frame()
    if penetration:
        found["coverage_penetration"] = _penetration(penetration)
    if zones:
        found["coverage_zones"] = _zones(zones)
    return found


def _penetration(points: Sequence[PenetrationPoint]) -> pd.DataFrame:
    """Return one row for each share, radius and level."""
    import pandas as pd

    return pd.DataFrame(
        [
            {
                "share": point.share,
                "radius_m": point.radius_m,
                "device_class": point.device_class,
                "level": level,
                "expected": point.expected[level],
                "se": point.se[level],
            }
            for point in points
            for level in LEVELS
        ]
    )


def _zones(zones: Sequence[ZoneCoverage]) -> pd.DataFrame:
    """Return one row for each zone, radius and level."""
    import pandas as pd

    return pd.DataFrame(
        [
            {
                "zone": zone.zone,
                "radius_m": zone.coverage.radius_m,
                "device_class": zone.coverage.device_class,
                "transit_area_m2": zone.transit_area_m2,
                "anchors": zone.coverage.anchors,
                "level": level,
                "area_m2": zone.coverage.areas_m2[level],
                "fraction": zone.coverage.fractions[level],
            }
            for zone in zones
            for level in LEVELS
        ]
    )

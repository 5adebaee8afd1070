"""What the report is told about a study: its layers, tables and metadata, as they were read."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from covertool import crs as crs_door
from covertool.errors import CrsError
from covertool.gis.provenance import provenances
from covertool.report.findings import RUN_ID_DIGITS
from covertool.report.parts import PARTS, typed

if TYPE_CHECKING:
    import geopandas as gpd
    import pandas as pd
    from pyproj import CRS

LEVEL_LAYERS = {level: f"coverage_level_{level}" for level in (1, 2, 3)}
LAYERS = (
    "buildings",
    "transit",
    *LEVEL_LAYERS.values(),
    "zones",
    "segments",
    "congestion",
    "trajectories",
    "vehicles",
    "anchors",
)
"""The layers of a study that the report draws."""
TABLES: Mapping[str, tuple[str, ...]] = {
    "coverage_summary": ("radius_m", "level", "area_m2", "fraction"),
    "coverage_curve": ("radius_m", "level", "fraction"),
    "coverage_penetration": ("share", "radius_m", "level", "expected"),
    "coverage_zones": ("zone", "radius_m", "transit_area_m2", "level", "fraction"),
    "occupancy": ("day", "window", "percent", "filled_percent"),
    "occupancy_means": ("group", "window", "percent", "filled_percent"),
    "positioning": ("arm", "mean_error_m"),
    "improvements": ("percent",),
    "parked_met": ("vehicle", "scenario", "met_per_km", "percent"),
}
"""The tables of a study that the report prints, and the columns that it cannot do without."""

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class ReportStudy:
    """A study as the report needs it; what the study lacks is absent.

    Attributes
    ----------
    name : the file's name, as the user knows it
    sha256 : of the file; its first twelve digits are the run id
    layers : frames by layer name, of `LAYERS`
    tables : frames by table name, of the keys of `TABLES`
    metadata : the study's metadata table
    """

    name: str
    sha256: str
    layers: Mapping[str, gpd.GeoDataFrame]
    tables: Mapping[str, pd.DataFrame]
    metadata: Mapping[str, str]

    @property
    def run_id(self) -> str:
        """The first twelve digits of the study's SHA-256: the same study, the same id."""
        return self.sha256[:RUN_ID_DIGITS]

    @property
    def title(self) -> str:
        """The study's title, else its file name."""
        return self.metadata.get("title") or self.name

    @property
    def synthetic(self) -> str | None:
        """What the metadata says about invented data; None when it says nothing."""
        return self.metadata.get("synthetic")

    def table(self, name: str) -> pd.DataFrame | None:
        """Return a table that the study holds, with rows and the columns that it needs, or None."""
        frame = self.tables.get(name)
        if frame is None or frame.empty:
            return None
        lacking = [column for column in TABLES[name] if column not in frame]
        if lacking:
            _LOG.warning(
                "%s: the table %s lacks %s and is left out", self.name, name, ", ".join(lacking)
            )
            return None
        return frame

    def command(self, part: str) -> str:
        """Return the command that makes a part: one of `covertool.report.parts.PARTS`."""
        return self.named(PARTS[part].mend)

    def named(self, command: str) -> str:
        """Return a command about STUDY as it is typed for this study."""
        return typed(command, self.name)

    def provenance(self) -> list[dict[str, Any]]:
        """Return the provenance of each verb that wrote into the study, as far as readable."""
        told, _ = provenances(self.metadata)
        return [{"verb": verb, **content} for verb, content in told.items()]


def radius_name(radius_m: float | None, device_class: str | None = None) -> str:
    """Return how a radius is called on the page.

    >>> radius_name(15.0, "A")
    'class A, 15 m'
    """
    missing = radius_m is None or radius_m != radius_m
    size = "each car's own radius" if missing else f"{radius_m:g} m"
    return f"class {device_class}, {size}" if isinstance(device_class, str) else size


def radius_names(frame: pd.DataFrame) -> list[str]:
    """Return the name of each row's radius."""
    unnamed = [None] * len(frame)
    radii, classes = frame.get("radius_m", unnamed), frame.get("device_class", unnamed)
    return [radius_name(r, c) for r, c in zip(radii, classes, strict=True)]


def in_one_crs(layers: Mapping[str, gpd.GeoDataFrame]) -> tuple[dict[str, gpd.GeoDataFrame], CRS]:
    """Return the layers in one CRS in metres: the transit area's, or the one picked for it.

    Raises
    ------
    CrsError
        When a layer has no CRS or has no place on Earth while others have one.
    """
    first = layers.get("transit", next(iter(layers.values())))
    if first.crs is None:
        raise CrsError("a layer has no CRS", "the study", "assign one in QGIS, or with --crs")
    source = first.crs
    target = (
        source
        if crs_door.is_working(source)
        else crs_door.working_crs(source, tuple(first.total_bounds))
    )
    moved = {
        name: frame if frame.crs is None else crs_door.transform_frame(frame, target)
        for name, frame in layers.items()
    }
    return moved, target

"""The level layers of a study: one layer a level, one row for each radius asked for."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Protocol

import shapely
from pyproj import CRS

from covertool.coverage.radii import Radius, radii_of
from covertool.coverage.regions import level_regions
from covertool.coverage.tiles import TileFindings, TileJob
from covertool.model import LEVELS, Anchors, CoverageReport, TransitArea

if TYPE_CHECKING:
    import geopandas as gpd


class Named(Protocol):
    """Anything that knows what to call its radius."""

    @property
    def radius_m(self) -> float | None:
        """Metres, or None when several are mixed."""
        ...

    @property
    def device_class(self) -> str | None:
        """A-D, or None."""
        ...


def level_layers(
    anchors: Anchors, transit: TransitArea, radii: Sequence[Radius]
) -> dict[str, gpd.GeoDataFrame]:
    """Return layers ``coverage_level_1`` to ``_3`` with one row for each radius.

    Columns: ``level``, ``radius_m``, ``device_class``, ``area_m2`` and the geometry. A level that
    covers nothing at a radius has no row for it.
    """
    rows: dict[int, list[dict[str, object]]] = {level: [] for level in LEVELS[1:]}
    for radius in radii:
        named = radii_of(anchors, radius)
        for level, region in level_regions(anchors, transit, radius).items():
            if not region.is_empty:
                rows[level].append(_row(level, named, region))
    return {f"coverage_level_{level}": _frame(found, transit.crs) for level, found in rows.items()}


def tile_layer(
    level: int, job: TileJob, report: CoverageReport, findings: Iterable[tuple[int, TileFindings]]
) -> Iterator[gpd.GeoDataFrame]:
    """Yield one frame a tile: a row for each radius whose level is met there.

    Columns: those of `level_layers`, and ``tile``, its number along the rows from the lower left.
    """
    together = [result for result in report.results if result.origin is None]
    named = dict(zip(job.radii, together, strict=True))
    for tile, found in findings:
        rows = [
            {**_row(level, named[radius], region), "tile": tile}
            for (radius, of), region in found.regions.items()
            if of == level
        ]
        if rows:
            yield _frame(rows, job.transit.crs, "tile")


def tile_sample(level: int, job: TileJob, report: CoverageReport) -> gpd.GeoDataFrame:
    """Return a frame like those of `tile_layer` with a row for each radius and no geometry."""
    together = [result for result in report.results if result.origin is None]
    rows = [{**_row(level, named, shapely.MultiPolygon()), "tile": 0} for named in together]
    return _frame(rows, job.transit.crs, "tile")


def _row(level: int, named: Named, region: shapely.MultiPolygon) -> dict[str, object]:
    return {
        "level": level,
        "radius_m": named.radius_m,
        "device_class": named.device_class,
        "area_m2": region.area,
        "geometry": region,
    }


def _frame(rows: Sequence[dict[str, object]], crs: CRS, *more: str) -> gpd.GeoDataFrame:
    import geopandas as gpd

    columns = ["level", "radius_m", "device_class", "area_m2", *more, "geometry"]
    whole = dict.fromkeys(("level", *more), int)
    return gpd.GeoDataFrame(rows, columns=columns, geometry="geometry", crs=crs).astype(
        {"radius_m": float, "area_m2": float, **whole}
    )


def joined(layers: dict[str, gpd.GeoDataFrame]) -> gpd.GeoDataFrame:
    """Return the rows of all level layers as one layer, for formats that hold only one."""
    import pandas as pd

    return pd.concat(list(layers.values()), ignore_index=True)

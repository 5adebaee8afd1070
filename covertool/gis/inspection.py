"""What is in a file: layers or bands, CRS, counts, and what would be trouble."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from affine import Affine
from pyproj import CRS

from covertool import crs as crs_door
from covertool.errors import CovertoolError, FileError
from covertool.gis import guard
from covertool.gis.formats import (
    CSV,
    GEOPACKAGE,
    GEOPARQUET,
    RASTER_FORMATS,
    VECTOR_FORMATS,
    Format,
    by_suffix,
    suffixes,
)
from covertool.gis.geopackage import read_metadata
from covertool.gis.georaster import open_dataset
from covertool.gis.geotiff import open_raster
from covertool.gis.layers import Layer, read_layer
from covertool.gis.repair import finite
from covertool.gis.study import layer_names, read_tables, table_names
from covertool.model.sources import COARSEST_GSD_M

if TYPE_CHECKING:
    import geopandas as gpd


@dataclass(frozen=True)
class Part:
    """A layer, a table or the pixels of a file.

    Attributes
    ----------
    name, kind : such as ``anchors``, ``512 Point``; ``pixels``, ``8-bit, 3 bands``
    rows : features, rows, or pixels
    crs : its name, or None
    bounds : left, bottom, right, top in the CRS, or None
    columns : names of the columns; of pixels, none
    facts : other things worth a line
    problems : what would be trouble, and how to mend it
    """

    name: str
    kind: str
    rows: int
    crs: str | None
    bounds: tuple[float, float, float, float] | None
    columns: tuple[str, ...]
    facts: tuple[str, ...]
    problems: tuple[str, ...]


@dataclass(frozen=True)
class FileInfo:
    """What is in a file.

    Attributes
    ----------
    path, format, size_bytes : of the file
    parts : its layers and tables, or its pixels
    metadata : the metadata table of a GeoPackage; empty for others
    """

    path: str
    format: str
    size_bytes: int
    parts: tuple[Part, ...]
    metadata: dict[str, str]

    @property
    def problems(self) -> int:
        """Number of problems of all parts."""
        return sum(len(part.problems) for part in self.parts)


def inspect_file(path: str | Path) -> FileInfo:
    """Return what is in a vector or raster file.

    A layer that cannot be read is a problem of that layer, and the others are looked at.

    Raises
    ------
    FileError
        When the file as a whole cannot be opened.
    """
    formats = (*VECTOR_FORMATS, *RASTER_FORMATS)
    known = by_suffix(guard.local_path(path), formats)
    if known is None:
        guard.require_readable(guard.local_path(path))
        raise FileError(
            "this is no GIS file that covertool knows", str(path), f"use {suffixes(formats)}"
        )
    checked, known = guard.input_file(path, (known,))
    parts = (
        (_pixels(checked, known),) if known in RASTER_FORMATS else tuple(_layers(checked, known))
    )
    metadata = read_metadata(checked) if known is GEOPACKAGE else {}
    return FileInfo(str(path), known.name, checked.stat().st_size, parts, metadata)


def _layers(path: Path, known: Format) -> Iterator[Part]:
    if known is not GEOPACKAGE:
        yield _table(path, known) or _layer(str(path), path.stem)
        return
    for name in layer_names(path):
        yield _layer(f"{path}:{name}", name)
    names = table_names(path)
    for name, frame in read_tables(path, names).items():
        yield Part(name, "table", len(frame), None, None, tuple(map(str, frame.columns)), (), ())


def _table(path: Path, known: Format) -> Part | None:
    """Return a CSV or Parquet file without places, such as observations; None for the others."""
    import pyarrow.csv
    import pyarrow.parquet

    try:
        if known is CSV:
            table = pyarrow.csv.read_csv(path)
            rows, columns = table.num_rows, table.column_names
        elif known is GEOPARQUET:
            file = pyarrow.parquet.read_metadata(path)
            rows, columns = file.num_rows, file.schema.to_arrow_schema().names
        else:
            return None
    except (pyarrow.ArrowException, OSError):
        return None
    if {"x", "y"} <= set(columns) or {"lon", "lat"} <= set(columns) or "geometry" in columns:
        return None
    return Part(path.stem, "table", rows, None, None, tuple(columns), (), ())


def _layer(spec: str, name: str) -> Part:
    """Return what is in one layer; one that cannot be read has that for its problem."""
    try:
        layer = read_layer(spec, name)
    except CovertoolError as error:
        return Part(name, "not readable", 0, None, None, (), (), (f"{error.what}: {error.mend}",))
    frame = layer.frame
    geometries = np.asarray(frame.geometry, dtype=object)
    columns = tuple(str(column) for column in frame.columns if column != frame.geometry.name)
    sound = geometries[finite(geometries)]
    whole = shapely.total_bounds(sound) if len(sound) else np.full(4, np.nan)
    bounds = tuple(float(v) for v in whole) if np.isfinite(whole).all() else None
    return Part(
        name,
        _kinds(geometries),
        len(frame),
        crs_door.name(layer.crs),
        bounds,  # type: ignore[arg-type]
        columns,
        tuple(_scale(layer.crs, bounds)),
        tuple(_problems(layer, geometries, frame)),
    )


def _kinds(geometries: Any) -> str:
    counted = Counter(g.geom_type if g is not None else "null" for g in geometries)
    return ", ".join(f"{count} {kind}" for kind, count in counted.most_common()) or "empty"


def _scale(crs: CRS, bounds: Any) -> Iterator[str]:
    if bounds is None or not crs.is_projected:
        return
    middle = ((bounds[0] + bounds[2]) / 2, (bounds[1] + bounds[3]) / 2)
    factor = crs_door.scale_factor(crs, *middle)
    yield f"scale factor {factor:.6f} in the middle: 100 m on the map are {100 / factor:.2f} m"


def _problems(layer: Layer, geometries: Any, frame: gpd.GeoDataFrame) -> Iterator[str]:
    """Yield what would be trouble, in words."""
    if len(frame) == 0:
        yield "the layer is empty"
    if crs_door.is_web_mercator(layer.crs):
        yield "EPSG:3857 stretches lengths by 1 / cos(latitude): covertool will transform it"
    elif layer.crs.is_geographic:
        yield "coordinates are degrees: covertool will transform them to metres"
    elif not crs_door.is_working(layer.crs):
        yield "the CRS is not conformal, or not in metres: covertool will transform it"
    present = ~shapely.is_missing(geometries)
    for count, what in (
        (int((~present).sum()), "null geometries"),
        (int((present & shapely.is_empty(geometries)).sum()), "empty geometries"),
        (int((~finite(geometries)).sum()), "geometries with NaN or infinite coordinates"),
        (int((present & ~shapely.is_valid(geometries)).sum()), "invalid geometries"),
        (_repeated(geometries[present]), "geometries that repeat another one"),
    ):
        if count:
            yield f"{count} {what}"


def _repeated(geometries: Any) -> int:
    return len(geometries) - len(np.unique(shapely.to_wkb(geometries))) if len(geometries) else 0


def _pixels(path: Path, known: Format) -> Part:
    """Return what is in a raster."""
    dataset = open_dataset(path, known.driver)
    try:
        placed = dataset.transform != Affine.identity()
        facts = [
            f"{dataset.width} x {dataset.height} pixels",
            f"nodata {dataset.nodata:g}" if dataset.nodata is not None else "no nodata value",
            f"overviews {', '.join(map(str, dataset.overviews(1)))}"
            if dataset.overviews(1)
            else "no overviews",
        ]
        kind = f"{dataset.count} band{'s' * (dataset.count > 1)} of {dataset.dtypes[0]}"
        rows = dataset.width * dataset.height
        bounds = tuple(float(v) for v in dataset.bounds) if placed else None
        crs = crs_door.name(CRS.from_wkt(dataset.crs.to_wkt())) if dataset.crs else None
    finally:
        dataset.close()
    problems = []
    try:
        raster = open_raster(path)
        across_m, down_m = raster.gsd_m(raster.width / 2, raster.height / 2)
        facts.append(f"GSD {across_m:.4g} m across, {down_m:.4g} m down, in the middle")
        if max(across_m, down_m) > COARSEST_GSD_M:
            problems.append(f"pixels above {COARSEST_GSD_M} m are too coarse to find cars in")
    except CovertoolError as error:
        problems.append(f"{error.what}: {error.mend}")
    return Part("pixels", kind, rows, crs, bounds, (), tuple(facts), tuple(problems))  # type: ignore[arg-type]

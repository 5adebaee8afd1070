"""Anchors in GeoParquet, sorted in space, so that a worker reads only those near its tile."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pyproj import CRS

from covertool import crs as crs_door
from covertool.errors import ColumnError, CrsError, FileError
from covertool.gis import guard
from covertool.gis.columns import typed
from covertool.gis.formats import GEOPARQUET
from covertool.model import Anchors, Bounds

if TYPE_CHECKING:
    import geopandas as gpd
    import pyarrow as pa

_ROWS_IN_GROUP = 16_384
_COLUMNS = ("id", "x_m", "y_m", "radius_m", "device_class", "sigma_m", "origin")


def write_anchors(path: str | Path, anchors: Anchors, *, overwrite: bool = False) -> None:
    """Write anchors as GeoParquet 1.1 along a Hilbert curve, in small row groups.

    `ParquetAnchors` reads of them only those near a place.

    Raises
    ------
    FileError
        When the path may not be written.
    """
    frame = typed(anchors.to_frame())
    write_along_curve(path, frame, rows_in_group=_ROWS_IN_GROUP, overwrite=overwrite)


def write_along_curve(
    path: str | Path, frame: gpd.GeoDataFrame, *, rows_in_group: int, overwrite: bool
) -> None:
    """Write a layer as GeoParquet 1.1, its rows in the order of a Hilbert curve.

    Neighbours on the curve are neighbours on the ground, so that each row group covers a small
    area and a reader can leave most of them unread.

    Raises
    ------
    FileError
        When the path may not be written, or not all rows arrived.
    """
    checked, _ = guard.output_file(path, (GEOPARQUET,), overwrite=overwrite)
    if len(frame) > 1:
        order = np.argsort(frame.geometry.hilbert_distance().to_numpy(), kind="stable")
        frame = frame.iloc[order]
    with guard.replacing(checked) as temporary:
        frame.to_parquet(
            temporary,
            index=False,
            write_covering_bbox=True,
            schema_version="1.1.0",
            row_group_size=rows_in_group,
        )
        if open_parquet(temporary).metadata.num_rows != len(frame):
            raise FileError("not all rows arrived", str(path), "check free space and try again")


@dataclass(frozen=True)
class ParquetAnchors:
    """Anchors in a file of `write_anchors`, read by bounding box; picklable.

    Parameters
    ----------
    path : str or Path
        The file.

    Raises
    ------
    FileError, ColumnError
        When the file is no GeoParquet of anchors.
    """

    path: Path
    crs: CRS
    bounds: Bounds

    def __init__(self, path: str | Path) -> None:
        checked, _ = guard.input_file(path, (GEOPARQUET,))
        file = open_parquet(checked)
        missing = [name for name in _COLUMNS if name not in file.schema_arrow.names]
        column = geometry_column(file)
        if missing or column.get("crs") is None:
            raise ColumnError(
                f"this is no GeoParquet of anchors (missing: {', '.join(missing) or 'CRS'})",
                str(checked),
                "write it with covertool convert",
            )
        crs = crs_door.settled(CRS.from_json_dict(column["crs"]))
        if not crs_door.is_working(crs):
            raise CrsError(
                f"{crs_door.name(crs)} is not a conformal CRS in metres",
                str(checked),
                "write it with covertool convert",
            )
        bounds = tuple(column.get("bbox") or (np.nan,) * 4)
        object.__setattr__(self, "path", checked)
        object.__setattr__(self, "crs", crs)
        object.__setattr__(self, "bounds", bounds)

    def read(self, bounds: Bounds | None = None) -> Anchors:
        """Return the anchors inside bounds (x0, y0, x1, y1; closed), or all of them."""
        import pyarrow.compute as pc
        import pyarrow.parquet as pq

        inside = None
        if bounds is not None:
            x0, y0, x1, y1 = bounds
            x, y = pc.field("x_m"), pc.field("y_m")
            inside = (x >= x0) & (x <= x1) & (y >= y0) & (y <= y1)
        table = pq.read_table(self.path, columns=list(_COLUMNS), filters=inside)
        return _anchors(table, self.crs)


def _anchors(table: pa.Table, crs: CRS) -> Anchors:
    columns: dict[str, Any] = {}
    for name in _COLUMNS:
        values = table.column(name)
        if name in ("id", "device_class", "origin"):
            columns[name] = np.array([*values.to_pylist(), None], dtype=object)[:-1]
        else:
            columns[name] = np.asarray(values.to_numpy(), dtype=float)
    return Anchors(**columns, crs=crs)


def geometry_column(file: Any) -> dict[str, Any]:
    """Return what the header of a GeoParquet file says of its geometries; nothing in others."""
    told = json.loads((file.metadata.metadata or {}).get(b"geo", b"{}"))
    column: dict[str, Any] = told.get("columns", {}).get(told.get("primary_column"), {})
    return column


def open_parquet(path: Path) -> Any:
    """Return an open Parquet file.

    Raises
    ------
    FileError
        When it is none.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        return pq.ParquetFile(path)
    except (pa.ArrowException, OSError) as error:
        raise FileError(f"the file cannot be read: {error}", str(path), "write it again") from None

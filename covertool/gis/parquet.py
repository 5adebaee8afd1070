"""GeoParquet sorted in space: anchors, or any rows, of which a worker reads those near its tile."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from pyproj import CRS

from covertool import crs as crs_door
from covertool.errors import ColumnError, CrsError, FileError
from covertool.gis import guard
from covertool.gis.columns import typed
from covertool.gis.formats import GEOPARQUET
from covertool.model import Anchors, Bounds, Floats, Objects

if TYPE_CHECKING:
    import geopandas as gpd
    import pyarrow as pa

Columns = tuple[str, ...]
Box = tuple[str, str, str, str]

_ROWS_IN_GROUP = 8_192
_PLACE = ("x_m", "y_m", "x_m", "y_m")
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
        return _anchors(rows_near(self.path, _COLUMNS, bounds, box=_PLACE), self.crs)


def rows_near(path: Path, columns: Columns, bounds: Bounds | None, *, box: Box) -> pa.Table:
    """Return the rows whose boxes meet bounds (closed), or all; row groups beyond stay unread.

    Parameters
    ----------
    path : a Parquet file
    columns : to be returned
    bounds : x0, y0, x1, y1
    box : columns that hold the least x and y and the greatest x and y of each row; row groups
        without statistics of them are read always

    Raises
    ------
    FileError
        When the file is no Parquet.
    """
    status = path.stat()
    metadata, boxes = _footer(path, box, (status.st_mtime_ns, status.st_size))
    with open_parquet(path, metadata) as file:
        if bounds is None:
            return file.read(columns=list(columns), use_threads=False)
        near = np.flatnonzero(_meets(boxes.T, bounds)).tolist()
        table = file.read_row_groups(
            near, columns=[*dict.fromkeys((*columns, *box))], use_threads=False
        )
    edges = dict(zip(table.flatten().column_names, table.flatten().columns, strict=True))
    return table.select(list(columns)).filter(
        _meets([_floats(edges[name]) for name in box], bounds)
    )


def _meets(boxes: Sequence[Floats] | Floats, bounds: Bounds) -> npt.NDArray[np.bool_]:
    x0, y0, x1, y1 = boxes
    return (x0 <= bounds[2]) & (y0 <= bounds[3]) & (x1 >= bounds[0]) & (y1 >= bounds[1])


@lru_cache(maxsize=4)
def _footer(path: Path, box: Box, stamp: tuple[int, int]) -> tuple[Any, Floats]:
    """Return a file's metadata, and (G, 4) the least and the greatest x and y of its row groups.

    Kept, for a tile reads little and the footer of a country is long; ``stamp`` changes with the
    file.
    """
    metadata = open_parquet(path).metadata
    names = [metadata.schema.column(i).path for i in range(metadata.num_columns)]
    boxes = [
        [
            _edge(metadata.row_group(group).column(names.index(name)), k)
            for k, name in enumerate(box)
        ]
        for group in range(metadata.num_row_groups)
    ]
    return metadata, np.array(boxes, dtype=float).reshape(-1, 4)


def _edge(column: Any, place: int) -> float:
    """Return the least (places 0 and 1) or greatest value in a part of a column, else infinity."""
    told = column.statistics
    if column.physical_type != "DOUBLE" or told is None or not told.has_min_max:
        return -np.inf if place < 2 else np.inf
    return float(told.min if place < 2 else told.max)


def _anchors(table: pa.Table, crs: CRS) -> Anchors:
    columns: dict[str, Any] = {}
    for name in _COLUMNS:
        values = table.column(name)
        if name == "id":
            columns[name] = np.array([*values.to_pylist(), None], dtype=object)[:-1]
        elif name in ("device_class", "origin"):
            columns[name] = _names(values)
        else:
            columns[name] = _floats(values)
    return Anchors(**columns, crs=crs)


def _floats(values: pa.ChunkedArray) -> Floats:
    return np.asarray(values.to_numpy(), dtype=float)


def _names(values: pa.ChunkedArray) -> Objects:
    """Return a column of few different strings; equal ones are one object, quick to compare."""
    coded = values.combine_chunks().dictionary_encode()
    known = np.array([*coded.dictionary.to_pylist(), None], dtype=object)
    column: Objects = known[coded.indices.fill_null(len(known) - 1).to_numpy()]
    return column


def geometry_column(file: Any) -> dict[str, Any]:
    """Return what the header of a GeoParquet file says of its geometries; nothing in others."""
    told = json.loads((file.metadata.metadata or {}).get(b"geo", b"{}"))
    column: dict[str, Any] = told.get("columns", {}).get(told.get("primary_column"), {})
    return column


def open_parquet(path: Path, metadata: Any = None) -> Any:
    """Return an open Parquet file; its metadata are not read again where they are known.

    Raises
    ------
    FileError
        When it is none.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        return pq.ParquetFile(path, metadata=metadata)
    except (pa.ArrowException, OSError) as error:
        raise FileError(f"the file cannot be read: {error}", str(path), "write it again") from None

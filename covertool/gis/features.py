"""The feature tables of a GeoPackage, read straight from SQLite.

A GeoPackage is a SQLite file whose geometries are WKB behind a short header (OGC 12-128r19,
2.1.3). Reading it needs neither GDAL nor a data frame library, which take longer to load than a
town takes to read.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from pyproj import CRS
from pyproj.exceptions import CRSError

from covertool.gis.sqlite import quoted, read_only
from covertool.model import Objects

Column = npt.NDArray[Any]

_ROWS_AT_ONCE = 100_000
_ENVELOPE_BYTES = (0, 32, 48, 48, 64)
_HEADER_BYTES = 8
_LAST_STRAIGHT_KIND = 7  # beyond it are curves and surfaces, which GEOS does not compute with
_NUMBERS = ("INT", "MEDIUMINT", "TINYINT", "SMALLINT", "REAL", "DOUBLE", "FLOAT")
_TIMES = ("DATE", "DATETIME")


@dataclass(frozen=True)
class Features:
    """The rows of a feature table.

    Attributes
    ----------
    columns : (N,) values by name
    geometries : (N,) in 2D, None where there is none
    crs : None when the table names none
    straight : False when a geometry is a curve, or cannot be read at all: its row then holds no
        geometry or one that GEOS does not compute with
    """

    columns: dict[str, Column]
    geometries: Objects
    crs: CRS | None
    straight: bool


def present(values: Column) -> npt.NDArray[np.bool_]:
    """Return which cells hold something: neither None nor NaN.

    >>> present(np.array(["a", None, float("nan")], dtype=object)).tolist()
    [True, False, False]
    """
    if values.dtype == object:
        return np.array([value is not None and value == value for value in values], dtype=bool)
    return np.asarray(values == values, dtype=bool)


def feature_layers(path: Path) -> list[str]:
    """Return the names of the layers with geometry, in the order of the file's contents.

    Raises
    ------
    sqlite3.Error
        When the file is damaged or no GeoPackage.
    """
    with read_only(path) as connection:
        rows = connection.execute(
            "SELECT c.table_name FROM gpkg_contents c JOIN gpkg_geometry_columns g"
            " ON lower(c.table_name) = lower(g.table_name) ORDER BY c.rowid"
        )
        return [str(name) for (name,) in rows]


def read_features(path: Path, layer: str) -> Features:
    """Return all rows of a layer.

    Raises
    ------
    sqlite3.Error, UnicodeError
        When the file is damaged or no GeoPackage.
    """
    with read_only(path) as connection:
        shape, srs_id = connection.execute(
            "SELECT column_name, srs_id FROM gpkg_geometry_columns WHERE lower(table_name) = ?",
            (layer.lower(),),
        ).fetchone()
        declared = connection.execute(f"PRAGMA table_info({quoted(layer)})").fetchall()
        kinds = {
            str(name): str(kind).upper()
            for _, name, kind, _, _, key in declared
            if name.lower() != shape.lower() and not (key and str(kind).upper() == "INTEGER")
        }
        names = ", ".join(quoted(name) for name in (*kinds, shape))
        cursor = connection.execute(f"SELECT {names} FROM {quoted(layer)}")
        parts = [_part(rows, kinds) for rows in _batches(cursor)]
        columns = {
            name: np.concatenate([np.empty(0, object), *(columns[name] for columns, _, _ in parts)])
            for name in kinds
        }
        return Features(
            {name: _typed(values, kinds[name]) for name, values in columns.items()},
            np.concatenate([np.empty(0, object), *(shapes for _, shapes, _ in parts)]),
            _crs(connection, srs_id),
            all(straight for _, _, straight in parts),
        )


def _batches(cursor: sqlite3.Cursor) -> Iterator[list[tuple[Any, ...]]]:
    while rows := cursor.fetchmany(_ROWS_AT_ONCE):
        yield rows


def _part(
    rows: list[tuple[Any, ...]], names: Sequence[str] | dict[str, str]
) -> tuple[dict[str, Column], Objects, bool]:
    """Return columns and geometries of some rows, and whether GEOS can use all of these."""
    *columns, blobs = zip(*rows, strict=True)
    shapes, straight = _geometries(blobs)
    found = {}
    for name, values in zip(names, columns, strict=True):
        found[name] = np.empty(len(values), dtype=object)
        found[name][:] = values
    return found, shapes, straight


def _geometries(blobs: Sequence[bytes | None]) -> tuple[Objects, bool]:
    wkb = np.array([None if blob is None else _wkb(blob) for blob in blobs], dtype=object)
    try:
        read = shapely.from_wkb(wkb, on_invalid="ignore")
    except NotImplementedError:  # a curve, in one release of shapely
        return np.full(len(wkb), None, dtype=object), False
    lost = shapely.is_missing(read) & present(wkb)
    straight = not lost.any() and bool((shapely.get_type_id(read) <= _LAST_STRAIGHT_KIND).all())
    shapes: Objects = np.asarray(shapely.force_2d(read) if straight else read, dtype=object)
    return shapes, straight


def _wkb(blob: bytes) -> bytes:
    """Return what follows the header of a geometry; nothing when it has none."""
    if len(blob) < _HEADER_BYTES or blob[:2] != b"GP":
        return b""
    envelope = blob[3] >> 1 & 7
    if envelope >= len(_ENVELOPE_BYTES):
        return b""
    return blob[_HEADER_BYTES + _ENVELOPE_BYTES[envelope] :]


def _typed(values: Column, kind: str) -> Column:
    """Return a column in the type that it declares, as far as its cells are of it."""
    whole = bool(present(values).all())
    base = kind.partition("(")[0].strip()
    try:
        if base in ("BOOLEAN", "BOOL"):
            if whole:
                return values.astype(bool)
            return np.array([None if v is None else bool(v) for v in values], dtype=object)
        if base.startswith(_NUMBERS):
            if whole and all(type(value) is int for value in values):
                return values.astype(np.int64)
            return values.astype(float)  # None becomes NaN
        if base in _TIMES:
            moments = [None if v is None else datetime.fromisoformat(v) for v in values]
            return np.array(moments, dtype=object)
    except (TypeError, ValueError, OverflowError):
        return values
    return values


def _crs(connection: sqlite3.Connection, srs_id: int) -> CRS | None:
    """Return a CRS by its authority's code, else by the best definition that the file holds."""
    cursor = connection.execute("SELECT * FROM gpkg_spatial_ref_sys WHERE srs_id = ?", (srs_id,))
    row = cursor.fetchone()
    if row is None:
        return None
    told = dict(zip((name for name, *_ in cursor.description), row, strict=True))
    organization, code = str(told["organization"]), told["organization_coordsys_id"]
    if organization.upper() != "NONE":
        try:
            return CRS.from_authority(organization.upper(), code)
        except CRSError:
            pass
    for text in (told.get("definition_12_063"), told.get("definition")):
        if text and text.lower() != "undefined":
            try:
                return CRS.from_user_input(text)
            except CRSError:
                continue
    return None

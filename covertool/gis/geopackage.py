"""The one writer of GeoPackages: styled, indexed, the same bytes for the same input."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from covertool.errors import FileError, OptionError
from covertool.gis import guard
from covertool.gis.columns import Parts, geometry_column, has_geometry, layer_kind, typed
from covertool.gis.qml import qml
from covertool.gis.sld import sld
from covertool.gis.sqlite import quoted, read_only, snapshot
from covertool.gis.styles import Style, choices, style_of

if TYPE_CHECKING:
    import pandas as pd

DATE = "2000-01-01T00:00:00.000Z"
"""Written as every file's date, so that the same input gives the same bytes."""

_DATASET = {"VERSION": "1.3"}  # QGIS 3.22 and ArcGIS Pro 2.9 warn of 1.4

_STYLES = """CREATE TABLE IF NOT EXISTS layer_styles (
 id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, f_table_catalog TEXT(256),
 f_table_schema TEXT(256), f_table_name TEXT(256), f_geometry_column TEXT(256),
 styleName TEXT(30), styleQML TEXT, styleSLD TEXT, useAsDefault BOOLEAN, description TEXT,
 owner TEXT(30), ui TEXT(30), update_time DATETIME)"""
OWN_TABLES = ("layer_styles", "metadata")
"""Tables of the format and of this writer, which are no part of a study's findings."""
_METADATA = """CREATE TABLE IF NOT EXISTS metadata (
 id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, key TEXT NOT NULL UNIQUE, value TEXT)"""


def write_geopackage(
    path: Path,
    layers: Mapping[str, pd.DataFrame | Parts],
    *,
    into: bool = False,
    metadata: Mapping[str, str] | None = None,
) -> None:
    """Write layers and tables as a whole new GeoPackage, or into a copy of an existing one.

    A GeoDataFrame becomes a layer, a plain DataFrame a table of attributes without geometry, and
    Parts a layer that is written part by part.
    The result takes the place of the old file in one step. With ``into`` all other layers stay as
    they are; without it nothing of the old file stays.

    Raises
    ------
    FileError
        When the file is locked or open elsewhere, or a layer did not arrive whole.
    """
    for name in layers:
        _require_free_name(name, path)
    if path.exists():
        _release(path)
    with guard.replacing(path) as temporary:
        if into and path.exists():
            snapshot(path, temporary)
        with _fixed_date():
            rows = {name: _write_layer(temporary, name, layer) for name, layer in layers.items()}
        samples = {
            name: layer.sample if isinstance(layer, Parts) else layer
            for name, layer in layers.items()
        }
        _write_tables(temporary, samples, metadata or {})
        _check(temporary, path, rows)


def _require_free_name(name: str, path: Path) -> None:
    if (
        not name
        or name.lower() in OWN_TABLES
        or name.lower().startswith(("gpkg_", "sqlite_", "rtree_"))
    ):
        raise OptionError(f"a layer cannot be named {name!r}", str(path), "choose another name")


def read_metadata(path: Path) -> dict[str, str]:
    """Return the metadata table of a GeoPackage; empty when it has none of covertool's.

    Raises
    ------
    FileError
        When the file is damaged.
    """
    try:
        with read_only(path) as connection:
            columns = connection.execute("SELECT name FROM pragma_table_info('metadata')")
            if not {("key",), ("value",)} <= set(columns.fetchall()):
                return {}
            rows = connection.execute("SELECT key, value FROM metadata").fetchall()
    except sqlite3.Error as error:
        raise FileError(
            f"the file cannot be read: {error}", str(path), "copy it again, or make it anew"
        ) from None
    return {str(key): str(value) for key, value in rows}


@contextmanager
def _fixed_date() -> Iterator[None]:
    import pyogrio

    pyogrio.set_gdal_config_options({"OGR_CURRENT_DATE": DATE})
    try:
        yield
    finally:
        pyogrio.set_gdal_config_options({"OGR_CURRENT_DATE": None})


def _write_layer(path: Path, name: str, layer: pd.DataFrame | Parts) -> int:
    """Write a layer and return the number of its rows."""
    rows = 0
    for place, frame in enumerate(layer if isinstance(layer, Parts) else (layer,)):
        _write_rows(path, name, frame, append=place > 0)
        rows += len(frame)
    return rows


def _write_rows(path: Path, name: str, frame: pd.DataFrame, *, append: bool) -> None:
    """Write the rows of a layer or table, or add them to those that are there."""
    import pyogrio

    table = typed(frame)
    if append:
        pyogrio.write_dataframe(
            table, path, layer=name, driver="GPKG", append=True, promote_to_multi=True
        )
        return
    shape = geometry_column(table)
    taken = {str(column).lower() for column in table.columns if column != shape}
    key = "fid" if "fid" not in taken else "ogc_fid"
    if not has_geometry(table):
        pyogrio.write_dataframe(
            table,
            path,
            layer=name,
            driver="GPKG",
            dataset_options=_DATASET,
            layer_options={"ASPATIAL_VARIANT": "GPKG_ATTRIBUTES", "FID": key},
        )
        return
    kind = layer_kind(name, table)
    pyogrio.write_dataframe(
        table,
        path,
        layer=name,
        driver="GPKG",
        geometry_type=kind,
        promote_to_multi=kind.startswith("Multi"),
        dataset_options=_DATASET,
        layer_options={
            "SPATIAL_INDEX": "YES",
            "GEOMETRY_NAME": "geom" if "geom" not in taken else "shape_geom",
            "FID": key,
        },
    )


def _write_tables(
    path: Path, layers: Mapping[str, pd.DataFrame], metadata: Mapping[str, str]
) -> None:
    """Write styles and metadata beside the layers."""
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute(_STYLES)
        connection.execute(_METADATA)
        for table in OWN_TABLES:
            connection.execute(
                "INSERT OR IGNORE INTO gpkg_contents (table_name, data_type, identifier,"
                " description, last_change) VALUES (?, 'attributes', ?, '', ?)",
                (table, table, DATE),
            )
        for name in layers:
            connection.execute("DELETE FROM layer_styles WHERE f_table_name = ?", (name,))
            style = style_of(name) if has_geometry(layers[name]) else None
            if style is not None:
                _insert_style(connection, name, style, layers[name])
        connection.executemany(
            "INSERT OR REPLACE INTO metadata (key, value) VALUES (?, ?)", metadata.items()
        )


def _insert_style(
    connection: sqlite3.Connection, name: str, style: Style, frame: pd.DataFrame
) -> None:
    rows = choices(name, frame)
    column = connection.execute(
        "SELECT column_name FROM gpkg_geometry_columns WHERE table_name = ?", (name,)
    ).fetchone()[0]
    connection.execute(
        "INSERT INTO layer_styles (f_table_catalog, f_table_schema, f_table_name,"
        " f_geometry_column, styleName, styleQML, styleSLD, useAsDefault, description, owner,"
        " update_time) VALUES ('', '', ?, ?, 'covertool', ?, ?, 1, 'colours of the paper', '', ?)",
        (name, column, qml(style, rows), sld(name, style, rows), DATE),
    )


def _check(temporary: Path, path: Path, rows: Mapping[str, int]) -> None:
    """Reopen the file and count: what was written must be there."""
    with read_only(temporary) as connection:
        for name, expected in rows.items():
            count = connection.execute(f"SELECT count(*) FROM {quoted(name)}").fetchone()[0]
            if count != expected:
                raise FileError(
                    f"{count} of {expected} rows of the layer {name} arrived",
                    str(path),
                    "check free space and try again",
                )


def _release(path: Path) -> None:
    """Refuse a file that another program holds; settle its write-ahead log.

    A log left beside the file that takes its place would be played into it.
    """
    try:
        with closing(sqlite3.connect(path, timeout=1)) as connection:
            mode = connection.execute("PRAGMA journal_mode=DELETE").fetchone()[0]
            connection.execute("BEGIN EXCLUSIVE")
    except sqlite3.OperationalError as error:
        if "locked" not in str(error):
            return
        mode = "locked"
    except sqlite3.DatabaseError:
        return
    if mode != "delete":
        raise FileError(
            "the file is open in another program", str(path), "close it there and try again"
        )

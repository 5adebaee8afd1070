"""Opening one layer of a vector file: the right layer, its CRS settled, no side effects."""

from __future__ import annotations

import logging
import sqlite3
import warnings
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import shapely
from pyproj import CRS

from covertool import crs as crs_door
from covertool.errors import CrsError, FileError, GeometryError
from covertool.gis import guard, tables
from covertool.gis.columns import SHORT_NAMES
from covertool.gis.features import Column, Features, feature_layers, read_features
from covertool.gis.formats import (
    CSV,
    GEOJSON,
    GEOPACKAGE,
    GEOPARQUET,
    SHAPEFILE,
    VECTOR_FORMATS,
    Format,
)
from covertool.gis.repair import POLYGONS
from covertool.gis.sqlite import readable
from covertool.model import Objects

if TYPE_CHECKING:
    import geopandas as gpd

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class Layer:
    """The rows of one layer as they lie in the file, with their CRS settled.

    Attributes
    ----------
    columns : (N,) values by name; None or NaN where a cell is empty
    geometries : (N,) shapely geometries, or None
    crs : as the file names it, else as the user does
    where : the file and layer, for messages
    """

    columns: dict[str, Column]
    geometries: Objects
    crs: CRS
    where: str

    def __len__(self) -> int:
        return len(self.geometries)

    def rows(self, rows: npt.NDArray[np.bool_ | np.integer[Any]]) -> dict[str, Column]:
        """Return the columns of some rows, named by number or by True."""
        return {name: values[rows] for name, values in self.columns.items()}

    @property
    def is_areal(self) -> bool:
        """Whether the layer holds polygons."""
        return bool(np.isin(shapely.get_type_id(self.geometries), POLYGONS).any())

    @property
    def frame(self) -> gpd.GeoDataFrame:
        """The layer as a data frame."""
        return geo_frame(self.columns, self.geometries, self.crs)


def geo_frame(columns: dict[str, Column], geometries: Objects, crs: CRS) -> gpd.GeoDataFrame:
    """Return columns and geometries as a data frame, moments and texts in their own types."""
    import geopandas as gpd

    named = {name: values for name, values in columns.items() if name != "geometry"}
    frame = gpd.GeoDataFrame(named, geometry=list(geometries), crs=crs)
    texts = [name for name in named if frame[name].dtype == object]
    return frame.assign(**{name: frame[name].infer_objects() for name in texts})


def read_layer(spec: str | Path, default: str | None, crs: str | CRS | None = None) -> Layer:
    """Return one layer of a vector file.

    Parameters
    ----------
    spec : str or Path
        ``FILE`` or ``FILE:LAYER``.
    default : str or None
        Layer to read when the spec names none; else the only layer, else an error.
    crs : str, CRS or None
        CRS to assign when the layer names none.

    Raises
    ------
    FileError, CrsError, ColumnError
        When the file, its CRS or its columns cannot be used.
    """
    asked, wanted = guard.layer_spec(spec)
    path, known = guard.input_file(asked, VECTOR_FORMATS)
    assigned = crs_door.parse(crs) if crs is not None else None
    where = str(path)
    if known is CSV:
        read = _of_frame(tables.read_points(path, assigned))
    elif known is GEOPARQUET:
        read = _of_frame(_read_parquet(path, assigned))
    else:
        with readable(path, known) as opened:
            layer = choose_layer(path, geometry_layers(opened, path), wanted, default)
            where = f"{path}:{layer}" if known.layers else where
            read = (_read_geopackage if known is GEOPACKAGE else _read_ogr)(opened, path, layer)
    columns = read.columns
    if known is SHAPEFILE:
        full = {short: name for name, short in SHORT_NAMES.items()}
        columns = {full.get(name, name): values for name, values in columns.items()}
    crs_ = _settle_crs(read, known, assigned, where)
    return Layer(columns, read.geometries, crs_, where)


def choose_layer(path: Path, names: list[str], wanted: str | None, default: str | None) -> str:
    """Return the layer to read: the wanted one, else the default, else the only one."""
    listed = ", ".join(names) or "none"
    if wanted is not None:
        if wanted in names:
            return wanted
        raise FileError(
            f"there is no layer {wanted!r}", str(path), f"choose one of its layers: {listed}"
        )
    if default in names:
        return str(default)
    if len(names) == 1:
        return names[0]
    said = f"no layer {default!r} and not just one layer" if default else "not just one layer"
    raise FileError(
        f"it is open which layer is meant: {said}",
        str(path),
        f"name it as {path.name}:LAYER; the layers are: {listed}",
    )


def geometry_layers(opened: Path, path: Path) -> list[str]:
    """Return the names of the layers that hold geometry."""
    if path.suffix.lower() in GEOPACKAGE.suffixes:
        try:
            return feature_layers(opened)
        except sqlite3.Error as error:
            raise guard.unread(path, error) from None
    return [name for name, kind in _listed(opened, path) if kind is not None]


def attribute_tables(opened: Path, path: Path) -> list[str]:
    """Return the names of the tables of a GeoPackage that hold no geometry."""
    return [name for name, kind in _listed(opened, path) if kind is None]


def _listed(opened: Path, path: Path) -> list[tuple[str, str | None]]:
    """Return the name and the kind of geometry of each layer, None for a table."""
    import pyogrio

    try:
        return [(str(name), kind) for name, kind in pyogrio.list_layers(opened)]
    except (pyogrio.errors.DataSourceError, UnicodeError) as error:
        raise guard.unread(path, error) from None


def _read_geopackage(opened: Path, path: Path, layer: str) -> Features:
    try:
        features = read_features(opened, layer)
    except (sqlite3.Error, UnicodeError) as error:
        raise guard.unread(path, error) from None
    if features.straight:
        return features
    # GDAL draws curves as chords, and drops what cannot be read.
    return replace(features, geometries=_read_ogr(opened, path, layer).geometries)


def _read_ogr(opened: Path, path: Path, layer: str) -> Features:
    """Return the rows of a layer as GDAL reads them."""
    import geopandas as gpd
    import pyogrio

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # bad geometries are counted later
            frame = pyogrio.read_dataframe(opened, layer=layer, force_2d=True, on_invalid="ignore")
    except (
        pyogrio.errors.DataSourceError,
        pyogrio.errors.DataLayerError,
        shapely.errors.ShapelyError,
        UnicodeError,
    ) as error:
        raise guard.unread(path, error) from None
    if not isinstance(frame, gpd.GeoDataFrame):
        raise GeometryError("the layer holds no geometry", f"{path}:{layer}", "name another layer")
    return _of_frame(frame)


def _of_frame(frame: gpd.GeoDataFrame) -> Features:
    """Return a data frame as columns, with None or NaN where a cell is empty."""
    columns: dict[str, Column] = {}
    for name in frame.columns.drop(frame.geometry.name):
        plain = isinstance(frame[name].dtype, np.dtype)
        told: dict[str, Any] = {} if plain else {"dtype": object, "na_value": None}
        columns[str(name)] = frame[name].to_numpy(**told)
    shapes = np.asarray(frame.geometry.array, dtype=object)
    return Features(columns, shapes, frame.crs, straight=True)


def _read_parquet(path: Path, assigned: CRS | None) -> gpd.GeoDataFrame:
    """Return the rows of GeoParquet, or of a plain Parquet table with coordinates."""
    import geopandas as gpd
    import pandas as pd
    import pyarrow as pa

    try:
        return gpd.read_parquet(path)
    except (ValueError, KeyError) as error:
        if "geo" not in str(error).lower():
            raise guard.unread(path, error) from None
    except (pa.ArrowException, OSError) as error:
        raise guard.unread(path, error) from None
    try:
        return tables.to_points(pd.read_parquet(path), str(path), assigned)
    except (pa.ArrowException, OSError) as error:
        raise guard.unread(path, error) from None


def _settle_crs(read: Features, known: Format, assigned: CRS | None, where: str) -> CRS:
    """Return the CRS of a layer: its own, or the one that the user assigns to it."""
    found = _named_crs(read.crs)
    if found is None:
        if assigned is None:
            raise CrsError("the layer names no CRS", where, "add --crs EPSG:CODE of its numbers")
        return assigned
    if assigned is None or found.equals(assigned, ignore_axis_order=True):
        return found
    if known is GEOJSON and found == crs_door.WGS84 and not _looks_like_degrees(read.geometries):
        _LOG.warning(
            "%s: its numbers are not the WGS 84 degrees of RFC 7946; read as %s",
            where,
            crs_door.name(assigned),
        )
        return assigned
    raise CrsError(
        f"the layer is in {crs_door.name(found)} and --crs says {crs_door.name(assigned)}",
        where,
        "leave --crs out (it only names a missing CRS), or use --dst-crs to transform",
    )


def _named_crs(crs: CRS | None) -> CRS | None:
    if crs is None or crs.name.lower().startswith("undefined"):
        return None
    return crs_door.settled(CRS.from_user_input(crs))


def _looks_like_degrees(geometries: Objects) -> bool:
    bounds = np.abs(shapely.total_bounds(geometries))
    return bool(np.nanmax(bounds[[0, 2]]) <= 360 and np.nanmax(bounds[[1, 3]]) <= 90)

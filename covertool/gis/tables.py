"""Points in CSV tables: ``x,y`` with a CRS, or ``lon,lat``; columns found by name."""

from __future__ import annotations

import difflib
import logging
import math
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely
from pyproj import CRS

from covertool import crs as crs_door
from covertool.errors import ColumnError, CrsError, FileError
from covertool.model import Floats

if TYPE_CHECKING:
    import geopandas as gpd
    import pandas as pd

_LOG = logging.getLogger(__name__)

_X = ("x", "x_m", "easting")
_Y = ("y", "y_m", "northing")
_LON = ("lon", "longitude", "lng", "long")
_LAT = ("lat", "latitude")
OPTIONAL = ("id", "radius_m", "device_class", "sigma_m", "origin")
_ENCODINGS = ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"))


def read_points(path: Path, crs: CRS | None) -> gpd.GeoDataFrame:
    """Return the rows of a CSV file as points, in the CRS that the columns or ``crs`` tell.

    The delimiter is a comma, a semicolon (then a decimal comma is understood) or a tab. A place
    that is not a number becomes a point with NaN, for the caller to count.

    Raises
    ------
    ColumnError
        When there are no coordinate columns; near misses are named.
    CrsError
        When ``x,y`` come without a CRS, or ``lon,lat`` with a projected one.
    """
    return to_points(_read_text_table(path), str(path), crs)


def to_points(table: pd.DataFrame, where: str, crs: CRS | None) -> gpd.GeoDataFrame:
    """Return a table with coordinate columns as points; see `read_points`."""
    import geopandas as gpd

    table.columns = [str(column).strip() for column in table.columns]
    twice = table.columns[table.columns.duplicated()]
    if twice.size:
        raise ColumnError(f"the column {twice[0]} stands twice", where, "give it another name")
    x_name, y_name, found = _coordinate_columns(list(table.columns), where, crs)
    x, y = _numbers(table[x_name]), _numbers(table[y_name])
    rest = table.drop(columns=[x_name, y_name])
    rest = rest.rename(columns=_known_spellings(list(rest.columns)))
    return gpd.GeoDataFrame(rest, geometry=shapely.points(x, y), crs=found)


def number(cell: object) -> float:
    """Return a cell as a number; a decimal comma is understood, other text becomes NaN.

    >>> number(" 1,5 "), number("wide")
    (1.5, nan)
    """
    try:
        return float(str(cell).strip().replace(",", "."))
    except ValueError:
        return math.nan


def _numbers(column: pd.Series) -> Floats:
    """Return a column as floats, NaN where a cell holds none."""
    if column.dtype.kind in "fiu":
        return column.to_numpy(dtype=float)
    return np.array([number(cell) for cell in column], dtype=float)


def _known_spellings(columns: list[str]) -> dict[str, str]:
    """Return which columns are meant by the optional names, where none is spelled like that."""
    lower = {column.lower(): column for column in reversed(columns)}
    return {lower[name]: name for name in OPTIONAL if name in lower and name not in columns}


def _coordinate_columns(columns: list[str], where: str, crs: CRS | None) -> tuple[str, str, CRS]:
    """Return the names of the two columns of coordinates, and the CRS that they are in."""
    lower = {column.lower(): column for column in reversed(columns)}
    pick = [
        next((lower[alias] for alias in names if alias in lower), None)
        for names in (_X, _Y, _LON, _LAT)
    ]
    x, y, lon, lat = pick
    if lon is not None and lat is not None and (x is None or y is None or crs is None):
        if crs is not None and not crs.is_geographic:
            raise CrsError(
                f"the columns {lon},{lat} are degrees and --crs {crs_door.name(crs)} is not",
                where,
                "leave --crs out, or name the columns x,y",
            )
        return lon, lat, crs or crs_door.WGS84
    if x is None or y is None:
        hints = [
            f"{near[0]!r} for {wanted!r}"
            for wanted in ("x", "y", "lon", "lat", "longitude", "latitude", "easting", "northing")
            if (near := difflib.get_close_matches(wanted, [c.lower() for c in columns], 1, 0.7))
            and wanted not in lower
        ]
        raise ColumnError(
            f"there are no columns x,y or lon,lat (found: {', '.join(columns)})",
            where,
            f"did you mean {' or '.join(hints)}?" if hints else "name them x,y or lon,lat",
        )
    if crs is None:
        raise CrsError(
            f"the columns {x},{y} come without a CRS",
            where,
            "add --crs EPSG:CODE, or give lon,lat columns",
        )
    return x, y, crs


def warn_of_near_misses(columns: list[str], where: str) -> None:
    """Log a warning for each column whose name nearly is one that covertool reads."""
    lower = [column.lower() for column in columns]
    for wanted in OPTIONAL[1:]:
        near = difflib.get_close_matches(wanted, lower, 1, 0.75)
        if wanted not in lower and near:
            _LOG.warning("%s: column %r is not read; did you mean %r?", where, near[0], wanted)


def _read_text_table(path: Path) -> pd.DataFrame:
    """Return a CSV file as text, whatever its delimiter and encoding."""
    import pandas as pd

    encoding = _encoding(path)
    try:
        with path.open(encoding=encoding, newline="") as file:
            header = file.readline()
        delimiter = max(",;\t", key=header.count)
        with warnings.catch_warnings():
            warnings.simplefilter("error", pd.errors.ParserWarning)  # rows longer than the header
            return pd.read_csv(
                path,
                sep=delimiter,
                encoding=encoding,
                dtype=str,
                keep_default_na=False,
                na_values=["", "NA", "NULL", "null"],
                skipinitialspace=True,
                index_col=False,
            )
    except (
        pd.errors.ParserError,
        pd.errors.ParserWarning,
        pd.errors.EmptyDataError,
        UnicodeError,
    ) as error:
        raise FileError(
            f"the table cannot be read: {error}",
            str(path),
            "save it as CSV in UTF-8; with decimal commas use semicolons",
        ) from None


def _encoding(path: Path) -> str:
    """Return the encoding by its mark, UTF-8 when the bytes are that, else Windows-1252."""
    with path.open("rb") as file:
        head = file.read(4)
        for mark, encoding in _ENCODINGS:
            if head.startswith(mark):
                return encoding
        if b"\x00" in head:
            raise FileError("this is not a text table", str(path), "save it as CSV in UTF-8")
        file.seek(0)
        try:
            for line in file:
                line.decode("utf-8")
        except UnicodeDecodeError:
            _LOG.warning("%s: not UTF-8; read as Windows-1252", path)
            return "cp1252"
    return "utf-8"

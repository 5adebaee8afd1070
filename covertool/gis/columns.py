"""How columns and geometries of covertool's layers are typed in a file."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

import numpy as np
import shapely

if TYPE_CHECKING:
    import geopandas as gpd
    import pandas as pd

Frame = TypeVar("Frame", bound="pd.DataFrame")

_BOOLEAN = {"parked"}
_NUMBER_SUFFIXES = ("_m", "_m2", "_deg", "_px")
_KINDS_WHEN_EMPTY = {
    "anchors": "Point",
    "vehicles": "MultiPolygon",
    "transit": "MultiPolygon",
    "coverage_level_1": "MultiPolygon",
    "coverage_level_2": "MultiPolygon",
    "coverage_level_3": "MultiPolygon",
    "segments": "LineString",
    "trajectories": "LineString",
    "buildings": "MultiPolygon",
}
SHORT_NAMES = {
    "device_class": "dev_class",
    "heading_deg": "head_deg",
    "image_x_px": "img_x_px",
    "image_y_px": "img_y_px",
    "transit_area_m2": "transit_m2",
    "coverage_level": "cov_lvl",
}
_SHORT_LENGTH = 10
_NAMES = ("Point", "LineString", "LineString", "Polygon", "MultiPoint", "MultiLineString")


@dataclass(frozen=True)
class Parts:
    """A layer that comes in parts, because the whole does not fit in memory.

    Attributes
    ----------
    sample : a frame of the layer's columns that stands for it: at least a row for each radius
    read : returns the parts one after the other, each a frame of the same columns
    """

    sample: gpd.GeoDataFrame
    read: Callable[[], Iterable[gpd.GeoDataFrame]]

    def __iter__(self) -> Iterator[gpd.GeoDataFrame]:
        """Yield a part without rows, which makes the layer, and then the parts."""
        yield self.sample.iloc[:0]
        yield from self.read()


def has_geometry(frame: pd.DataFrame) -> bool:
    """Return True for a layer, False for a plain table of attributes."""
    import geopandas as gpd

    return isinstance(frame, gpd.GeoDataFrame)


def layer_kind(layer: str, frame: gpd.GeoDataFrame) -> str:
    """Return the geometry type of a layer as GDAL names it; polygons are always Multi.

    >>> import geopandas as gpd
    >>> layer_kind("zones", gpd.GeoDataFrame(geometry=[shapely.box(0, 0, 1, 1)]))
    'MultiPolygon'
    """
    codes = set(np.unique(shapely.get_type_id(frame.geometry.array)).tolist()) - {-1}
    if not codes:
        return _KINDS_WHEN_EMPTY.get(layer, "Unknown")
    if codes <= {3, 6}:
        return "MultiPolygon"
    if len(codes) == 1 and (code := codes.pop()) < len(_NAMES):
        return _NAMES[code]
    if codes == {1, 5}:
        return "MultiLineString"
    if codes == {0, 4}:
        return "MultiPoint"
    return "Unknown"


def geometry_column(frame: pd.DataFrame) -> str | None:
    """Return the name of the geometry column; None for a plain table."""
    return str(frame.geometry.name) if has_geometry(frame) else None


def typed(frame: Frame) -> Frame:
    """Return the frame with columns of Python objects as nullable booleans, numbers or text.

    GDAL would else take a column that holds only None, or no row at all, for text or integers.
    """
    out = frame.copy()
    shape = geometry_column(frame)
    for name in out.columns:
        if name != shape and out[name].dtype == object:
            out[name] = _typed(str(name), out[name])
    return out


def _typed(name: str, column: pd.Series) -> pd.Series:
    values = [value for value in column if value is not None and value == value]
    if name in _BOOLEAN or (values and all(isinstance(v, bool | np.bool_) for v in values)):
        return column.astype("boolean")
    if name.endswith(_NUMBER_SUFFIXES) or (
        values and all(isinstance(v, int | float | np.number) for v in values)
    ):
        return column.astype(float)
    text = [
        None if v is None or v != v else json.dumps(v) if isinstance(v, dict | list) else str(v)
        for v in column
    ]
    return column.__class__(text, index=column.index, dtype="string")


def short_names(columns: list[str]) -> dict[str, str]:
    """Return names of at most ten characters for the columns of a Shapefile, all different.

    >>> short_names(["device_class", "a_very_long_name", "a_very_long_one"])
    {'device_class': 'dev_class', 'a_very_long_name': 'a_very_lon', 'a_very_long_one': 'a_very_l_1'}
    """
    chosen: dict[str, str] = {}
    for column in columns:
        short = SHORT_NAMES.get(column, column)[:_SHORT_LENGTH]
        count = 0
        while short.lower() in {name.lower() for name in chosen.values()}:
            count += 1
            short = f"{column[: _SHORT_LENGTH - len(str(count)) - 1]}_{count}"
        chosen[column] = short
    return chosen

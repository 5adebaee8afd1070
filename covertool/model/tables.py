"""Columns of equal length held as arrays, and the array types of all rooms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import numpy.typing as npt
import shapely
from pyproj import CRS

from covertool.errors import GeometryError

if TYPE_CHECKING:
    import geopandas as gpd

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Objects = npt.NDArray[np.object_]
Bounds = tuple[float, float, float, float]


class Table:
    """Columns of equal length held as arrays: length, choice of rows, one check of both."""

    _not_columns: tuple[str, ...] = ("crs",)

    def columns(self) -> dict[str, npt.NDArray[Any]]:
        """Return the columns by name, in the order of the fields."""
        return {
            f.name: getattr(self, f.name)
            for f in fields(self)  # type: ignore[arg-type]
            if f.name not in self._not_columns
        }

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> dict[str, npt.NDArray[Any]]:
        """Return the columns of several tables, of which there is one at least, row after row."""
        columns = [part.columns() for part in parts]
        return {name: np.concatenate([one[name] for one in columns]) for name in columns[0]}

    def __post_init__(self) -> None:
        sizes = {name: column.shape for name, column in self.columns().items()}
        if len(set(sizes.values())) > 1 or any(len(shape) != 1 for shape in sizes.values()):
            raise GeometryError(
                "columns differ in length", f"{type(self).__name__}: {sizes}", "pass equal lengths"
            )

    def __len__(self) -> int:
        return int(next(iter(self.columns().values())).size)

    def take(self, rows: npt.ArrayLike) -> Self:
        """Return the chosen rows (a mask or indices) as a new table."""
        chosen = np.asarray(rows)
        picked = {name: column[chosen] for name, column in self.columns().items()}
        return replace(self, **picked)  # type: ignore[type-var]


def within(x_m: Floats, y_m: Floats, bounds: Bounds) -> npt.NDArray[np.bool_]:
    """Return which places lie in bounds, their edge included.

    >>> within(np.array([0.0, 5.0]), np.array([0.0, 0.0]), (0.0, 0.0, 1.0, 1.0)).tolist()
    [True, False]
    """
    x0, y0, x1, y1 = bounds
    return (x_m >= x0) & (x_m <= x1) & (y_m >= y0) & (y_m <= y1)


def by_car(vehicle: Objects, time_s: Floats) -> npt.NDArray[np.intp]:
    """Return the order of rows in which each car's stand together, the earliest first.

    >>> by_car(np.array(["b", "a", "a"], dtype=object), np.array([0.0, 1.0, 0.0])).tolist()
    [2, 1, 0]
    """
    return np.lexsort((time_s, vehicle.astype(str)))


def points_frame(
    columns: dict[str, npt.NDArray[Any]], x_m: Floats, y_m: Floats, crs: CRS
) -> gpd.GeoDataFrame:
    """Return columns and their places, in metres of a CRS, as a GeoDataFrame of points."""
    import geopandas as gpd

    return gpd.GeoDataFrame(columns, geometry=shapely.points(x_m, y_m), crs=crs)

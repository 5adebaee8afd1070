"""``--by ZONES[:FIELD]``: polygons by name, from a file or from a column of the transit layer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely
from pyproj import CRS

from covertool.errors import ColumnError
from covertool.gis.formats import VECTOR_FORMATS
from covertool.gis.guard import input_file, layer_spec
from covertool.gis.layers import geometry_layers
from covertool.gis.read import read_polygons
from covertool.gis.sqlite import readable
from covertool.model import Objects

if TYPE_CHECKING:
    import geopandas as gpd


@dataclass(frozen=True)
class ZonesOf:
    """The zones that ``--by`` names, read once in each process.

    Attributes
    ----------
    text : what followed the option
    transit : the transit layer, of which a column may be meant
    crs : working CRS
    """

    text: str
    transit: str
    crs: CRS

    def read(self) -> dict[str, Objects]:
        """Return the polygons of each zone by its name."""
        return _zones_once(self)

    def file(self) -> Path:
        """Return the file that holds the zones."""
        for text in (self.text, self.text.rpartition(":")[0], self.transit):
            if text and (path := layer_spec(text)[0]).is_file():
                return path
        return layer_spec(self.text)[0]


@dataclass(frozen=True)
class AreaOfInterest:
    """The polygons that ``--aoi`` names, as one zone, read once in each process."""

    spec: str
    crs: CRS

    def read(self) -> dict[str, Objects]:
        """Return the polygons under one name."""
        return _area_once(self)

    def file(self) -> Path:
        """Return the file that holds the polygons."""
        return layer_spec(self.spec)[0]


@lru_cache(maxsize=1)
def _zones_once(zones: ZonesOf) -> dict[str, Objects]:
    found = read_zones(zones.text, zones.transit, zones.crs)
    return {
        zone: np.array([shapely.union_all(shapes)], dtype=object) for zone, shapes in found.items()
    }


@lru_cache(maxsize=1)
def _area_once(area: AreaOfInterest) -> dict[str, Objects]:
    shapes = read_polygons(area.spec, dst_crs=area.crs).geometry.array
    united = shapely.union_all(np.asarray(shapes, dtype=object))
    return {"area of interest": np.array([united], dtype=object)}


def read_zones(text: str, transit: str, crs: CRS) -> dict[str, Objects]:
    """Return the polygons of each zone by its name.

    ``FILE`` or ``FILE:LAYER`` names zones by a column `name` or `id`, else by number; ``:FIELD``
    after it names another column. A text that is no file is a column of the transit layer.

    Raises
    ------
    FileError, ColumnError
        When there is no such file or column.
    """
    head, _, last = text.rpartition(":")
    if layer_spec(text)[0].is_file() and not _is_column(text, head, last):
        return _grouped(read_polygons(text, dst_crs=crs), None, text)
    if head and layer_spec(head)[0].is_file():
        return _grouped(read_polygons(head, dst_crs=crs), last, head)
    if "/" not in text and "." not in text and not Path(text).exists():
        return _grouped(read_polygons(transit, dst_crs=crs), text.lstrip(":"), transit)
    return _grouped(read_polygons(text, dst_crs=crs), None, text)


def _is_column(text: str, head: str, last: str) -> bool:
    """Return whether FILE:WORD means a column: the file has no layer of that name."""
    if not head or not Path(head).expanduser().is_file() or Path(text).exists():
        return False
    path, known = input_file(head, VECTOR_FORMATS)
    if not known.layers:
        return True
    with readable(path, known) as opened:
        return last not in geometry_layers(opened, path)


def _grouped(frame: gpd.GeoDataFrame, field: str | None, where: str) -> dict[str, Objects]:
    columns = [str(column) for column in frame.columns if column != frame.geometry.name]
    if field is None:
        field = next((name for name in ("name", "id") if name in columns), None)
    elif field not in columns:
        raise ColumnError(
            f"there is no column {field!r}", where, f"choose one of: {', '.join(columns) or 'none'}"
        )
    names = [str(i + 1) for i in range(len(frame))] if field is None else list(frame[field])
    return zones_by_name(np.asarray(frame.geometry.array, dtype=object), [str(n) for n in names])


def zones_by_name(shapes: Objects, names: Sequence[str]) -> dict[str, Objects]:
    """Return the rows of a layer by name: the rows of one name are one zone, in order of names.

    Names that are whole numbers come in the order of the numbers.

    Examples
    --------
    >>> rows = np.array([shapely.box(0, 0, 1, 1), shapely.box(1, 0, 2, 1)], dtype=object)
    >>> list(zones_by_name(rows, ["residential", "primary"]))
    ['primary', 'residential']
    """
    labels = np.array(names, dtype=object)
    return {name: shapes[labels == name] for name in sorted(set(names), key=_as_counted)}


def _as_counted(name: str) -> tuple[bool, int, str]:
    """Return a key that puts whole numbers first and in their order: 2 before 10."""
    return (False, int(name), name) if name.isdecimal() else (True, 0, name)

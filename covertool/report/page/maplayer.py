"""One layer of the map, as it is drawn."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from covertool.model import Objects
from covertool.report.page.popups import Values

if TYPE_CHECKING:
    import geopandas as gpd

    from covertool.report.page.theme import Pair


@dataclass(frozen=True)
class MapLayer:
    """One switchable layer of the map.

    Attributes
    ----------
    key : name of the layer's switch; layers of several radii share it
    label : what the switch says
    form : area, outline, line, car or mark
    shapes : (N,) geometries in the map's CRS
    values : pop-up texts by heading, N each
    colour : light and dark
    shown : whether the page opens with it
    radius : the radius that it belongs to, None when it belongs to all
    width : of lines, in pixels
    opacity : of areas, 0 to 1
    turned : of cars: heading in degrees, length and width in metres
    """

    key: str
    label: str
    form: str
    shapes: Objects
    values: Values
    colour: Pair
    shown: bool = True
    radius: str | None = None
    width: float = 1.0
    opacity: float = 1.0
    turned: tuple[Any, Any, Any] | None = field(default=None, repr=False)


def shapes_of(frame: gpd.GeoDataFrame) -> Objects:
    """Return the geometries of a layer's rows."""
    return np.asarray(frame.geometry.array, dtype=object)

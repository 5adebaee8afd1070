"""The discs that anchors reach, as areas to draw; coverage is never counted from these."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import shapely

from covertool.dsrc import DEVICE_CLASSES
from covertool.errors import CrsError, OptionError
from covertool.gis.styles import DISCS_PREFIX

if TYPE_CHECKING:
    import geopandas as gpd

_QUARTER_SIDES = 16  # the outline runs within 0.5 % of the radius of the true circle


def disc_layer(anchors: gpd.GeoDataFrame, size: str) -> tuple[str, gpd.GeoDataFrame]:
    """Return the name and rows of a layer with one disc for each anchor.

    Parameters
    ----------
    anchors : GeoDataFrame of points in metres
    size : str
        A radius in metres, or a device class A to D.

    Raises
    ------
    OptionError
        When the size is neither.
    CrsError
        When the anchors lie in degrees, where no disc is round.

    Examples
    --------
    >>> import geopandas as gpd
    >>> points = gpd.GeoDataFrame({"id": ["1"]}, geometry=[shapely.Point(0, 0)], crs=2157)
    >>> name, discs = disc_layer(points, "A")
    >>> name, round(float(discs.area[0] / (math.pi * 15**2)), 2)
    ('discs_class_a', 1.0)
    """
    import geopandas as gpd

    if anchors.crs is not None and anchors.crs.is_geographic:
        raise CrsError(
            "the anchors lie in degrees, where discs are not round",
            "--discs",
            "compute the study in metres first: covertool coverage STUDY --radius 15 -o NEW.gpkg",
        )
    name, radius_m, device_class = _size(size)
    points = np.asarray(anchors.geometry.array, dtype=object)
    ids = anchors["id"] if "id" in anchors.columns else range(1, len(anchors) + 1)
    discs = gpd.GeoDataFrame(
        {"id": [str(id_) for id_ in ids], "radius_m": radius_m, "device_class": device_class},
        geometry=list(shapely.buffer(points, radius_m, quad_segs=_QUARTER_SIDES)),
        crs=anchors.crs,
    )
    return name, discs


def _size(text: str) -> tuple[str, float, str | None]:
    letter = text.strip().upper()
    if letter in DEVICE_CLASSES:
        return f"{DISCS_PREFIX}class_{letter.lower()}", DEVICE_CLASSES[letter].radius_m, letter
    try:
        radius_m = float(text)
    except ValueError:
        radius_m = math.nan
    if not 0 < radius_m < math.inf:
        raise OptionError(
            f"{text!r} is no size of a disc", "--discs", "give a radius in metres or A, B, C, D"
        )
    return f"{DISCS_PREFIX}{radius_m:g}_m".replace(".", "_"), radius_m, None

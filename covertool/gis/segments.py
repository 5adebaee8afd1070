"""Street segments: lines with an id, in a working CRS."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely

from covertool import crs as crs_door
from covertool.errors import GeometryError
from covertool.gis import target
from covertool.gis.layers import geo_frame, read_layer
from covertool.gis.target import AnyCrs

if TYPE_CHECKING:
    import geopandas as gpd

_LOG = logging.getLogger(__name__)

_LINES = (1, 5)


def read_segments(
    spec: str | Path, *, crs: AnyCrs = None, dst_crs: AnyCrs = None
) -> gpd.GeoDataFrame:
    """Return the lines of a layer with all their columns, in a working CRS in metres.

    Parameters
    ----------
    spec : str or Path
        ``FILE`` or ``FILE:LAYER``; without a layer ``segments``, else the only one.
    crs, dst_crs : str, CRS or None
        CRS of a file that names none; CRS to compute in, else one is picked.

    Raises
    ------
    FileError, CrsError, GeometryError
        When the input cannot be used or holds no line.
    """
    layer = read_layer(spec, "segments", crs)
    lines = layer.geometries
    good = np.isin(shapely.get_type_id(lines), _LINES) & ~shapely.is_empty(lines)
    good &= np.isfinite(shapely.length(lines))
    if not good.any():
        raise GeometryError("the layer holds no lines", layer.where, "name the layer of segments")
    if not good.all():
        _LOG.warning("%s: %d rows that are no lines dropped", layer.where, (~good).sum())
    working = target.pick(lines[good], layer.crs, dst_crs, layer.where)
    moved = crs_door.transform_geometries(shapely.force_2d(lines[good]), layer.crs, working)
    return geo_frame(layer.rows(good), moved, working)

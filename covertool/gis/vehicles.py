"""The vehicles layer of a study."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import shapely
from pyproj import CRS

from covertool import crs as crs_door
from covertool.gis import attributes, repair, target
from covertool.gis.layers import read_layer
from covertool.gis.repair import Repairs
from covertool.model import SITES, Floats, Vehicles


def read_vehicles(spec: str | Path, *, dst_crs: target.AnyCrs = None) -> Vehicles:
    """Return the vehicles of a layer of footprints, in a working CRS.

    The place is the centroid of the footprint; heading and size come from the columns.

    Raises
    ------
    FileError, CrsError, ColumnError
        When the layer cannot be used.
    """
    layer = read_layer(spec, "vehicles")
    repairs = Repairs(layer.where)
    good = np.flatnonzero(repair.usable(layer.geometries, repairs))
    table = attributes.Table(layer.rows(good), good.size, layer.where)
    centres = shapely.centroid(layer.geometries[good])
    crs = target.pick(centres, layer.crs, dst_crs, layer.where)
    x, y = shapely.get_x(centres), shapely.get_y(centres)
    x_m, y_m = crs_door.transform(x, y, layer.crs, crs)
    heading = attributes.floats(table, "heading_deg")
    vehicles = Vehicles(
        id=attributes.ids(table, repairs),
        x_m=x_m,
        y_m=y_m,
        heading_deg=_turned(x, y, heading, layer.crs, crs),
        length_m=attributes.floats(table, "length_m"),
        width_m=attributes.floats(table, "width_m"),
        score=attributes.floats(table, "score"),
        site=attributes.choices(table, "site", SITES, None),
        parked=attributes.flags(table, "parked"),
        image=attributes.texts(table, "image"),
        image_x_px=attributes.floats(table, "image_x_px"),
        image_y_px=attributes.floats(table, "image_y_px"),
        crs=crs,
    )
    repairs.tell()
    return vehicles


def _turned(x: Floats, y: Floats, heading_deg: Floats, source: CRS, crs: CRS) -> Floats:
    """Return headings from the grid north of one projected CRS to that of another."""
    if source == crs:
        return heading_deg
    angle = np.radians(heading_deg)
    x0, y0 = crs_door.transform(x, y, source, crs)
    x1, y1 = crs_door.transform(x + np.sin(angle), y + np.cos(angle), source, crs)
    turned = np.degrees(np.arctan2(x1 - x0, y1 - y0)) % 360
    front_unknown = np.nanmax(heading_deg, initial=0.0) <= 180
    return turned % 180 if front_unknown else turned

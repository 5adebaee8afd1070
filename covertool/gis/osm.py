"""OpenStreetMap extracts: roads and parking areas with all of their tags, through GDAL."""

from __future__ import annotations

import json
import warnings
import zlib
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely

from covertool import crs as crs_door
from covertool.errors import FileError, GeometryError
from covertool.gis import guard, repair
from covertool.gis.formats import OSM_FORMATS
from covertool.gis.repair import Repairs
from covertool.gis.streams import open_stream

if TYPE_CHECKING:
    import geopandas as gpd

_NOT_TAGS = {"osm_id", "osm_way_id", "z_order", "other_tags", "geometry"}
_TAIL = 4096
_LARGEST_UNPACKED = 2**40  # a continent; a bomb is known by its ratio


def read_roads(path: str | Path) -> gpd.GeoDataFrame:
    """Return the ways of an OSM extract that carry a ``highway`` tag, in a working CRS.

    Parameters
    ----------
    path : str or Path
        An ``.osm``, ``.osm.gz`` or ``.osm.pbf`` file.

    Returns
    -------
    GeoDataFrame
        Lines; columns osm_id, highway, name (text) and tags (dict of all tags).

    Raises
    ------
    FileError
        When the file is no OSM extract or is cut off.
    GeometryError
        When it holds no road.
    """
    roads = _read(path, "SELECT * FROM lines WHERE highway IS NOT NULL")
    if roads.empty:
        raise GeometryError(
            "the extract holds no way with a highway tag", str(path), "export a larger area"
        )
    return roads


def read_parking_areas(path: str | Path) -> gpd.GeoDataFrame:
    """Return the areas of an OSM extract tagged ``amenity=parking``, in a working CRS.

    The columns are those of `read_roads`; an extract without such areas gives no rows.
    """
    return _read(path, "SELECT * FROM multipolygons WHERE amenity = 'parking'")


def read_buildings(path: str | Path) -> gpd.GeoDataFrame:
    """Return the areas of an OSM extract that carry a ``building`` tag, in a working CRS.

    The columns are those of `read_roads`.
    """
    return _read(path, "SELECT * FROM multipolygons WHERE building IS NOT NULL")


def _read(path: str | Path, sql: str) -> gpd.GeoDataFrame:
    """Return what a query finds in an extract."""
    import pyogrio

    checked, known = guard.input_file(path, OSM_FORMATS)
    _require_whole(checked, known.name)
    source = f"/vsigzip/{checked.absolute()}" if known.name.startswith("gz") else checked
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # broken rings are counted below
            frame = pyogrio.read_dataframe(source, sql=sql, TAGS_FORMAT="JSON", on_invalid="ignore")
    except (pyogrio.errors.DataSourceError, pyogrio.errors.DataLayerError) as error:
        raise _broken(checked, str(error)) from None
    except (pyogrio.errors.FeatureError, RuntimeError) as error:
        raise _broken(checked, str(error)) from None
    return _to_working(_with_tags(frame), checked)


def _to_working(frame: gpd.GeoDataFrame, path: Path) -> gpd.GeoDataFrame:
    """Return what can be used of an extract, in metres of a working CRS."""
    repairs = Repairs(str(path))
    geometries = np.asarray(frame.geometry.array, dtype=object)
    frame = frame[repair.usable(geometries, repairs)].reset_index(drop=True)
    if frame.empty:
        return frame
    x0, y0, x1, y1 = (float(value) for value in frame.total_bounds)
    target = crs_door.working_crs(crs_door.WGS84, (x0, y0, x1, y1))
    moved = crs_door.transform_geometries(
        np.asarray(frame.geometry.array, dtype=object), crs_door.WGS84, target
    )
    if set(frame.geom_type) <= {"Polygon", "MultiPolygon"}:
        moved = repair.polygons(moved, repairs)
        keep = ~shapely.is_missing(moved)
        frame, moved = frame[keep].reset_index(drop=True), moved[keep]
    repairs.tell()
    return frame.set_geometry(list(moved), crs=None).set_crs(target, allow_override=True)


def _with_tags(frame: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """Return osm_id, highway, name and all tags as one dict a row."""
    import geopandas as gpd
    import pandas as pd

    named = [str(name) for name in frame.columns if name not in _NOT_TAGS]
    records = frame[named].to_dict("records")
    others = frame["other_tags"].tolist() if "other_tags" in frame else [None] * len(frame)
    tags = [
        {key: str(value) for key, value in record.items() if isinstance(value, str)}
        | _parsed(other)
        for record, other in zip(records, others, strict=True)
    ]
    ids = frame["osm_id"]
    if "osm_way_id" in frame:
        ids = ids.fillna(frame["osm_way_id"])
    columns = {
        "osm_id": ids.tolist(),
        "highway": [tag.get("highway") for tag in tags],
        "name": [tag.get("name") for tag in tags],
        "tags": tags,
    }
    plain = pd.DataFrame(columns, dtype=object)  # object keeps None; text would make it NaN
    return gpd.GeoDataFrame(plain, geometry=frame.geometry.array, crs=crs_door.WGS84)


def _parsed(other: object) -> dict[str, str]:
    """Return the other tags, which pyogrio hands over as JSON text or already as a dict."""
    found = json.loads(other) if isinstance(other, str) else other
    return {key: str(value) for key, value in found.items()} if isinstance(found, dict) else {}


def _require_whole(path: Path, kind: str) -> None:
    """Refuse XML that ends before its closing tag; GDAL would take it for a smaller town."""
    if kind == "OSM PBF":
        return
    try:
        tail = _gzip_tail(path) if kind.startswith("gz") else guard.tail(path)
    except (OSError, EOFError, zlib.error) as error:
        raise _broken(path, str(error)) from None
    if not tail.rstrip().endswith(b"</osm>"):
        raise _broken(path, "it ends before </osm>")


def _gzip_tail(path: Path) -> bytes:
    tail = b""
    with open_stream(path, max_bytes=_LARGEST_UNPACKED) as file:
        while chunk := file.read(1 << 20):
            tail = (tail + chunk)[-_TAIL:]
    return tail


def _broken(path: Path, told: str) -> FileError:
    return FileError(
        f"the OSM extract is broken or cut off: {told}", str(path), "download it again"
    )

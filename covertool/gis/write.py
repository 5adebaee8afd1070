"""What goes out: layers in any of the vector formats, written whole or not at all."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely

from covertool import crs as crs_door
from covertool.errors import CrsError, FileError, GeometryError, OptionError
from covertool.gis import formats, guard
from covertool.gis.columns import Parts, has_geometry, layer_kind, typed
from covertool.gis.formats import VECTOR_OUTPUTS, Format
from covertool.gis.geopackage import write_geopackage
from covertool.gis.kml import write_kml
from covertool.gis.shapefile import write_shapefile, write_zip

if TYPE_CHECKING:
    import geopandas as gpd
    import pandas as pd

_LOG = logging.getLogger(__name__)

_WITHOUT_METADATA = (formats.SHAPEFILE, formats.CSV)


def write_layers(
    path: str | Path,
    layers: Mapping[str, pd.DataFrame | Parts],
    *,
    overwrite: bool = False,
    into: bool = False,
    metadata: Mapping[str, str] | None = None,
    inputs: Iterable[str | Path] = (),
) -> None:
    """Write layers to a file; the extension decides the format.

    Parameters
    ----------
    path : str or Path
        ``.gpkg``, ``.kml`` and ``.shp.zip`` hold many layers; ``.geojson``, ``.parquet``, ``.fgb``,
        ``.shp`` and ``.csv`` (points) hold one.
    layers : mapping of str to GeoDataFrame, DataFrame or Parts
        Layers by name. A plain DataFrame is written as a table of attributes without geometry,
        and Parts as a layer too large for memory; both only to a GeoPackage.
    overwrite : bool
        Replace an existing file.
    into : bool
        Add or replace only these layers in an existing GeoPackage; a new one is made if there is
        none.
    metadata : mapping of str to str, or None
        Keys and values that the file carries: in its metadata table, its description, or, where
        the format has no such place (Shapefile, CSV), in a file ``NAME.provenance.json`` beside.
    inputs : iterable of str or Path
        Files that the output must not be one of.

    Raises
    ------
    FileError, CrsError, OptionError, GeometryError
        When the path or the layers do not fit; the old file is then as it was.

    Examples
    --------
    >>> import tempfile
    >>> from pyproj import CRS
    >>> from covertool.gis.study import layer_names
    >>> from covertool.model import Anchors
    >>> anchors = Anchors.from_points([0.0, 10.0], [0.0, 0.0], CRS(2157)).to_frame()
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_layers(f"{folder}/town.gpkg", {"anchors": anchors})
    ...     layer_names(f"{folder}/town.gpkg")
    ['anchors']
    """
    checked, known = guard.output_file(
        path, VECTOR_OUTPUTS, overwrite=overwrite or into, inputs=inputs
    )
    if not layers:
        raise OptionError("there is no layer to write", str(checked), "name at least one")
    if into and known is not formats.GEOPACKAGE:
        raise OptionError("only a GeoPackage takes layers into it", str(checked), "use a .gpkg")
    if known is formats.GEOPACKAGE:
        if into and checked.exists():
            guard.input_file(checked, (formats.GEOPACKAGE,))
        write_geopackage(checked, layers, into=into, metadata=metadata)
        return
    whole = _whole(checked, layers)
    about = json.dumps(dict(metadata), ensure_ascii=False) if metadata else ""
    if known is formats.KML:
        _write_kml(checked, whole, metadata or {})
        return
    if known is formats.SHAPEFILES:
        write_zip(checked, whole, about)
        return
    if len(layers) > 1:
        raise OptionError(
            f"{known.name} holds one layer, not {len(layers)} ({', '.join(layers)})",
            str(checked),
            "write a .gpkg, or choose one layer",
        )
    name, frame = next(iter(whole.items()))
    _write_single(checked, known, name, frame, about)
    if about and known in _WITHOUT_METADATA:
        with guard.replacing(checked.with_name(f"{checked.name}.provenance.json")) as temporary:
            temporary.write_text(f"{about}\n", encoding="utf-8")


def _whole(path: Path, layers: Mapping[str, pd.DataFrame | Parts]) -> dict[str, gpd.GeoDataFrame]:
    """Return the layers as whole frames with geometry, which is what formats but one take."""
    found: dict[str, gpd.GeoDataFrame] = {}
    for name, layer in layers.items():
        if isinstance(layer, Parts) or not has_geometry(layer):
            raise GeometryError(
                f"the table {name} has no geometry or comes in parts",
                str(path),
                "write it to a .gpkg",
            )
        found[name] = layer
    return found


def _write_single(
    path: Path, known: Format, name: str, frame: gpd.GeoDataFrame, about: str
) -> None:
    """Write one layer in a format that holds no more, and count its rows again."""
    if known is formats.SHAPEFILE:
        write_shapefile(path, name, frame)
        return
    with guard.replacing(path) as temporary:
        if known is formats.GEOJSON:
            _write_geojson(temporary, name, frame, path, about)
        elif known is formats.GEOPARQUET:
            _write_parquet(temporary, frame, about)
        elif known is formats.CSV:
            _write_csv(temporary, frame, path)
        else:
            described = {"DESCRIPTION": about} if about else {}
            _write_ogr(temporary, known, name, frame, SPATIAL_INDEX="YES", **described)
        _check(temporary, known, path, len(frame))


def _write_ogr(
    path: Path, known: Format, name: str, frame: gpd.GeoDataFrame, **layer_options: str
) -> None:
    """Write a layer by GDAL."""
    import pyogrio

    kind = layer_kind(name, frame)
    pyogrio.write_dataframe(
        typed(frame),
        path,
        layer=name,
        driver=known.driver,
        geometry_type=kind,
        promote_to_multi=kind.startswith("Multi"),
        layer_options=layer_options,
    )


def _write_geojson(
    path: Path, name: str, frame: gpd.GeoDataFrame, target: Path, about: str
) -> None:
    """Write RFC 7946: WGS 84, exterior rings counterclockwise, seven decimals, no crs member."""
    described = {"DESCRIPTION": about} if about else {}
    moved = in_wgs84(frame, target)
    _write_ogr(path, formats.GEOJSON, name, moved, RFC7946="YES", **described)


def _write_parquet(path: Path, frame: gpd.GeoDataFrame, about: str) -> None:
    """Write GeoParquet 1.1 with a bounding box of each row; pandas keeps ``attrs`` beside."""
    table = typed(frame)
    table.attrs = {"covertool": about} if about else {}
    table.to_parquet(path, index=False, write_covering_bbox=True, schema_version="1.1.0")


def in_wgs84(frame: gpd.GeoDataFrame, target: Path) -> gpd.GeoDataFrame:
    """Return the frame in WGS 84 longitude and latitude.

    Raises
    ------
    CrsError
        When the frame lies in an image plane, which has no place on Earth.
    """
    source = frame.crs
    if source is None or crs_door.is_image_plane(source):
        raise CrsError(
            "the layer lies in an image plane, and this format needs a place on Earth",
            str(target),
            "extract again with --crs EPSG:CODE and --origin X,Y of the image's lower left corner",
        )
    return crs_door.transform_frame(frame, crs_door.WGS84)


def _write_kml(
    path: Path, layers: Mapping[str, gpd.GeoDataFrame], metadata: Mapping[str, str]
) -> None:
    moved = {name: in_wgs84(frame, path) for name, frame in layers.items()}
    about = "\n".join(f"{key}: {value}" for key, value in metadata.items())
    with guard.replacing(path) as temporary:
        write_kml(temporary, metadata.get("title") or path.stem, moved, about)
        _check(temporary, formats.KML, path, sum(map(len, layers.values())))


def _write_csv(path: Path, frame: gpd.GeoDataFrame, target: Path) -> None:
    """Write points as a table whose first columns are their coordinates."""
    import pandas as pd

    kinds = set(np.unique(shapely.get_type_id(frame.geometry.array)).tolist())
    if not kinds <= {0}:
        raise GeometryError(
            "a CSV file holds points only", str(target), "write polygons to a .gpkg or .geojson"
        )
    places = frame.geometry.array
    geographic = frame.crs is not None and frame.crs.is_geographic
    names = ("lon", "lat") if geographic else ("x", "y")
    rest = frame.drop(columns=[frame.geometry.name, "x_m", "y_m"], errors="ignore")
    coordinates = pd.DataFrame(
        dict(zip(names, (shapely.get_x(places), shapely.get_y(places)), strict=True)),
        index=frame.index,
    )
    pd.concat([coordinates, rest], axis=1).to_csv(path, index=False, lineterminator="\n")
    if not geographic and frame.crs is not None:
        _LOG.info("%s: read it again with --crs %s", target, crs_door.name(frame.crs))


def _check(temporary: Path, known: Format, path: Path, expected: int) -> None:
    """Reopen the file and count its rows."""
    count = _count(temporary, known)
    if count != expected:
        raise FileError(
            f"{count} of {expected} rows arrived", str(path), "check free space and try again"
        )


def _count(path: Path, known: Format) -> int:
    """Return the rows of a written file, as another reader finds them."""
    if known is formats.GEOPARQUET:
        import pyarrow.parquet as pq

        return int(pq.ParquetFile(path).metadata.num_rows)
    if known is formats.CSV:
        import pandas as pd

        return len(pd.read_csv(path))
    if known is formats.KML:
        from lxml import etree

        marks = etree.iterparse(str(path), tag="{*}Placemark", remove_blank_text=True)
        return sum(element.clear() is None for _, element in marks)
    import pyogrio

    return int(pyogrio.read_info(path, force_feature_count=True)["features"])

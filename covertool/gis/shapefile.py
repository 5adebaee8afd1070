"""Shapefiles, for programs that take nothing newer: what the format would lose is refused."""

from __future__ import annotations

import logging
import os
import shutil
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import shapely

from covertool.errors import FileError, GeometryError
from covertool.gis import guard
from covertool.gis.columns import layer_kind, short_names, typed

if TYPE_CHECKING:
    import geopandas as gpd

_LOG = logging.getLogger(__name__)

LIMIT = 2**31 - 1
"""Bytes that a part of a Shapefile can hold."""
_TEXT_BYTES = 254
_COLUMNS = 255
_NUMBER_BYTES = 24
_ZIP_DATE = (2000, 1, 1, 0, 0, 0)
_DBF_DATE = "2000-01-01"
_LAYER_NAMES = {f"coverage_level_{level}": f"cov_l{level}" for level in (1, 2, 3)}


def write_shapefile(path: Path, name: str, frame: gpd.GeoDataFrame) -> None:
    """Write all parts of a Shapefile in a folder beside, then move them; the .shp comes last.

    Raises
    ------
    FileError, GeometryError
        When the format cannot hold the layer whole.
    """
    with guard.replacing(path) as temporary, _folder_for(temporary) as folder:
        _write_parts(folder / path.name, name, frame, str(path))
        for part in sorted(folder.iterdir()):
            os.replace(part, temporary if part.suffix == ".shp" else path.with_name(part.name))


def write_zip(path: Path, layers: Mapping[str, gpd.GeoDataFrame], about: str = "") -> None:
    """Write several layers as Shapefiles in one archive, which GIS programs open as it is.

    Layers have short names in it, such as ``cov_l1`` for ``coverage_level_1``. What ``about`` says
    lies in it as ``provenance.json``.
    """
    with guard.replacing(path) as temporary, _folder_for(temporary) as folder:
        for name, frame in layers.items():
            _write_parts(folder / f"{_LAYER_NAMES.get(name, name)}.shp", name, frame, str(path))
        if about:
            (folder / "provenance.json").write_text(about, encoding="utf-8")
        with zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
            for part in sorted(folder.iterdir()):
                entry = zipfile.ZipInfo(part.name, date_time=_ZIP_DATE)
                entry.compress_type = zipfile.ZIP_DEFLATED
                with part.open("rb") as source, archive.open(entry, "w", force_zip64=True) as sink:
                    shutil.copyfileobj(source, sink)


@contextmanager
def _folder_for(temporary: Path) -> Iterator[Path]:
    folder = temporary.with_suffix("")
    folder.mkdir()
    try:
        yield folder
    finally:
        shutil.rmtree(folder)


def _write_parts(shp: Path, name: str, frame: gpd.GeoDataFrame, where: str) -> None:
    """Write the files of one Shapefile, and count its rows again."""
    import pyogrio

    table = plain(frame)
    require_fits(table, where)
    columns = [str(column) for column in table.columns if column != table.geometry.name]
    renamed = table.rename(columns=short_names(columns))
    kind = layer_kind(name, renamed)
    pyogrio.write_dataframe(
        renamed,
        shp,
        layer=shp.stem,
        driver="ESRI Shapefile",
        geometry_type=kind,
        promote_to_multi=kind.startswith("Multi"),
        layer_options={
            "ENCODING": "UTF-8",
            "2GB_LIMIT": "YES",
            "DBF_DATE_LAST_UPDATE": _DBF_DATE,
        },
    )
    count = int(pyogrio.read_info(shp, force_feature_count=True)["features"])
    if count != len(frame):
        raise FileError(
            f"{count} of {len(frame)} rows arrived", where, "check free space and try again"
        )
    short = [f"{column} as {new}" for column, new in short_names(columns).items() if column != new]
    if short:
        _LOG.info("%s: column names of ten characters: %s", where, ", ".join(short))


def plain(frame: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """Return the frame with moments as ISO 8601 text, since a Shapefile knows only days."""
    import pandas as pd

    table = typed(frame)
    for name in table.columns:
        if name != table.geometry.name and pd.api.types.is_datetime64_any_dtype(table[name]):
            texts = [None if pd.isna(moment) else moment.isoformat() for moment in table[name]]
            table[name] = pd.Series(texts, index=table.index, dtype="string")
    return table


def require_fits(frame: gpd.GeoDataFrame, where: str, limit: int = LIMIT) -> None:
    """Refuse a layer that a Shapefile would cut, mix up or drop.

    Raises
    ------
    GeometryError
        When points, lines and areas are mixed.
    FileError
        When a text, the number of columns or the size is too great.
    """
    if layer_kind("", frame) == "Unknown" and len(frame) > 0:
        raise GeometryError(
            "a Shapefile holds either points, lines or areas", where, "write a .gpkg"
        )
    names = [column for column in frame.columns if column != frame.geometry.name]
    if len(names) > _COLUMNS:
        raise FileError(
            f"a Shapefile has {_COLUMNS} columns at most, not {len(names)}", where, "write a .gpkg"
        )
    widths = {str(name): _width(frame, str(name)) for name in names}
    long = [f"{name} ({width} bytes)" for name, width in widths.items() if width > _TEXT_BYTES]
    if long:
        raise FileError(
            f"a Shapefile cuts text after {_TEXT_BYTES} bytes: {', '.join(long)}",
            where,
            "write a .gpkg, or drop the column",
        )
    points = int(shapely.get_num_coordinates(frame.geometry.array).sum())
    size = max(16 * points + 60 * len(frame), (1 + sum(widths.values())) * len(frame))
    if size > limit:
        raise FileError(
            f"a Shapefile holds 2 GB and this layer needs about {size / 1e9:.1f} GB",
            where,
            "write a .gpkg",
        )


def _width(frame: gpd.GeoDataFrame, name: str) -> int:
    column = frame[name]
    if column.dtype != "string":
        return _NUMBER_BYTES
    return max((len(text.encode()) for text in column.dropna()), default=1)

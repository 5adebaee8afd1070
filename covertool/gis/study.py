"""A study's layers as they lie in its file, for the exporters, which never compute."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from covertool.gis import guard
from covertool.gis.formats import GEOPACKAGE
from covertool.gis.geopackage import OWN_TABLES, read_metadata
from covertool.gis.layers import attribute_tables, geometry_layers, read_layer
from covertool.gis.sqlite import readable

if TYPE_CHECKING:
    import geopandas as gpd
    import pandas as pd


def layer_names(path: str | Path) -> list[str]:
    """Return the names of the layers of a study that hold geometry.

    Raises
    ------
    FileError
        When the file is not a readable GeoPackage.
    """
    with _opened(path) as (opened, checked):
        return geometry_layers(opened, checked)


def table_names(path: str | Path) -> list[str]:
    """Return the names of a study's tables of findings, which hold no geometry.

    Raises
    ------
    FileError
        When the file is not a readable GeoPackage.
    """
    with _opened(path) as (opened, checked):
        return [name for name in attribute_tables(opened, checked) if name not in OWN_TABLES]


def read_tables(path: str | Path, names: Iterable[str]) -> dict[str, pd.DataFrame]:
    """Return those of the named tables of findings that a study has, in the order of the names.

    Raises
    ------
    FileError
        When the file is not a readable GeoPackage.
    """
    import pyogrio

    with _opened(path) as (opened, checked):
        there = set(attribute_tables(opened, checked)) - set(OWN_TABLES)
        return {
            name: pyogrio.read_dataframe(opened, layer=name, read_geometry=False)
            for name in names
            if name in there
        }


@contextmanager
def _opened(path: str | Path) -> Iterator[tuple[Path, Path]]:
    """Yield the path to read a study from, and the study's own path for messages."""
    checked, known = guard.input_file(path, (GEOPACKAGE,))
    with readable(checked, known) as opened:
        yield opened, checked


def inherited_metadata(files: Iterable[Path]) -> dict[str, str]:
    """Return what the metadata tables of the GeoPackages among some files say, the first first.

    A study made from others carries it on: what was synthetic stays called synthetic.
    """
    packages = [path for path in files if path.suffix.lower() == GEOPACKAGE.suffixes[0]]
    return {key: value for path in reversed(packages) for key, value in read_metadata(path).items()}


def read_layers(path: str | Path, names: Iterable[str]) -> dict[str, gpd.GeoDataFrame]:
    """Return those of the named layers that a study has, in the order of the names.

    Raises
    ------
    FileError
        When the file is not a readable GeoPackage.
    """
    there = set(layer_names(path))
    return {name: read_layer(f"{path}:{name}", name).frame for name in names if name in there}

"""A study read for its tables: findings, counts and metadata as they lie in its file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from covertool import crs as crs_door
from covertool.gis.provenance import sha256
from covertool.gis.study import (
    inherited_metadata,
    layer_names,
    read_layers,
    read_tables,
    table_names,
)

if TYPE_CHECKING:
    import pandas as pd

RUN_ID_DIGITS = 12


@dataclass(frozen=True)
class Findings:
    """What the tables are made from, as it lies in a study.

    Attributes
    ----------
    name : of the study
    path : of the study, for messages
    run_id : short hash of the study
    crs : name of its CRS
    counts : rows of each layer
    transit_area_m2 : area of the transit layer; None when there is none
    tables : its tables of findings by name
    columns : columns of each layer and table
    metadata : its metadata table
    """

    name: str
    path: str
    run_id: str
    crs: str
    counts: Mapping[str, int]
    transit_area_m2: float | None
    tables: Mapping[str, pd.DataFrame]
    columns: Mapping[str, Sequence[str]]
    metadata: Mapping[str, str]


def run_id(study: Path) -> str:
    """Return the first twelve digits of the study's SHA-256: the same study, the same id."""
    return sha256(study)[:RUN_ID_DIGITS]


def read_findings(study: Path) -> Findings:
    """Return what the tables of a study are made from.

    Raises
    ------
    FileError
        When the file is not a readable GeoPackage.
    """
    layers = read_layers(study, layer_names(study))
    tables = read_tables(study, table_names(study))
    transit = layers.get("transit")
    crs = next((frame.crs for frame in layers.values()), None)
    columns = {
        name: [str(column) for column in frame.columns if column != frame.geometry.name]
        for name, frame in layers.items()
    }
    columns |= {name: [str(column) for column in frame.columns] for name, frame in tables.items()}
    return Findings(
        name=study.name,
        path=str(study),
        run_id=run_id(study),
        crs="none" if crs is None else crs_door.name(crs),
        counts={name: len(frame) for name, frame in layers.items()},
        transit_area_m2=None if transit is None else float(transit.area.sum()),
        tables=tables,
        columns=columns,
        metadata=inherited_metadata([study]),
    )

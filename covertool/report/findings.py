"""A study read for its tables: findings, counts and metadata as they lie in its file."""

from __future__ import annotations

from pathlib import Path

from covertool import crs as crs_door
from covertool.gis.provenance import sha256
from covertool.gis.study import (
    inherited_metadata,
    layer_names,
    read_layers,
    read_tables,
    table_names,
)
from covertool.report.tables import Findings

RUN_ID_DIGITS = 12


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

"""A study as what a planner takes home: layers, tables, a map. Nothing is computed here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from covertool import __version__
from covertool.errors import FileError, OptionError
from covertool.gis import formats, guard
from covertool.gis.figure import FIGURE_FORMATS, write_figure
from covertool.gis.formats import Format
from covertool.gis.spreadsheet import XLSX, write_csv, write_workbook
from covertool.gis.study import (
    inherited_metadata,
    layer_names,
    read_layers,
    read_tables,
    table_names,
)
from covertool.gis.textfile import HTML, LATEX, MARKDOWN, write_text
from covertool.gis.write import write_layers
from covertool.report import markup, tables, views
from covertool.report.discs import disc_layer
from covertool.report.findings import read_findings, run_id
from covertool.report.parts import LAYER_MENDS, typed
from covertool.report.views import MapOptions

if TYPE_CHECKING:
    import pandas as pd

_RASTER = formats.RASTER_FORMATS[0]
_MARKUP = (LATEX, MARKDOWN)
OUTPUTS = (*formats.VECTOR_OUTPUTS, XLSX, *_MARKUP, *FIGURE_FORMATS)
"""Formats that a study is exported to."""


def export(
    study: str | Path,
    path: str | Path,
    *,
    layers: Sequence[str] = (),
    table: str | None = None,
    discs: Sequence[str] = (),
    figure: MapOptions | None = None,
    overwrite: bool = False,
    metadata: Mapping[str, str] | None = None,
) -> None:
    """Write a study, or a part of it, as a file of another kind; the extension decides which.

    Parameters
    ----------
    study : str or Path
        A GeoPackage of covertool.
    path : str or Path
        Layers: ``.gpkg``, ``.kml``, ``.shp.zip`` (many), ``.geojson``, ``.parquet``, ``.fgb``,
        ``.shp``, ``.csv`` (one). Tables: ``.xlsx``, ``.tex``, ``.md`` (all or one), ``.csv`` (one).
        Figures: ``.png``, ``.pdf``, ``.svg``.
    layers : sequence of str
        The layers to write; all of them, or the only one, when none is named.
    table : str or None
        The table to write; see `tables.TABLE_NAMES`.
    discs : sequence of str
        Also a layer with the disc of each anchor: radii in metres or device classes A to D.
    figure : MapOptions or None
        What a figure shows.
    overwrite : bool
        Replace an existing file.
    metadata : mapping of str to str, or None
        Keys and values to add to those that the study carries.

    Raises
    ------
    FileError
        When the study lacks a part, which the error names with the verb that makes it, or a file
        cannot be read or written.
    OptionError
        When the options do not fit together.

    Examples
    --------
    >>> import tempfile
    >>> from covertool.gis.sample import SAMPLE_STUDY, sample_folder
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     page = Path(folder) / "transit.geojson"
    ...     export(sample_folder() / SAMPLE_STUDY, page, layers=["transit"])
    ...     "FeatureCollection" in page.read_text(encoding="utf-8")
    True
    """
    source, target = Path(study), guard.local_path(path)
    _refuse_what_is_computed(source, target)
    checked, known = guard.output_file(target, OUTPUTS, overwrite=overwrite, inputs=[source])
    told = {**inherited_metadata([source]), **(metadata or {})}
    if known in FIGURE_FORMATS:
        drawn, note = views.draw(source, figure or MapOptions(), told)
        write_figure(checked, drawn, about=note, overwrite=overwrite)
    elif known is XLSX or known in _MARKUP or (known is formats.CSV and table is not None):
        _export_tables(source, checked, known, table, overwrite)
    elif table is not None:
        raise OptionError(
            f"a table does not go into {known.name}", "--table", "use .xlsx, .csv, .tex or .md"
        )
    else:
        chosen = _chosen(source, known, layers, discs)
        write_layers(checked, chosen, overwrite=overwrite, metadata=told, inputs=[source])


def _refuse_what_is_computed(study: Path, path: Path) -> None:
    if formats.by_suffix(path, (_RASTER,)):
        raise FileError(
            "a level raster is computed, and export never computes",
            str(path),
            f"covertool coverage {study} --radius 15 --raster 0.5 -o {path}",
        )
    if formats.by_suffix(path, (HTML,)):
        raise FileError(
            "a page is made by the verb report", str(path), f"covertool report {study} -o {path}"
        )


def _chosen(
    study: Path, known: Format, layers: Sequence[str], discs: Sequence[str]
) -> dict[str, pd.DataFrame]:
    """Return the layers to write, and in a whole GeoPackage the tables too."""
    there = layer_names(study)
    missing = [name for name in layers if name not in there]
    if missing:
        mend = LAYER_MENDS.get(missing[0], f"choose of: {', '.join(there) or 'none'}")
        raise FileError(f"the study has no layer {missing[0]}", str(study), typed(mend, str(study)))
    names = list(layers) or (there if known.layers or not discs else [])
    if not known.layers and len(names) + len(discs) > 1:
        raise OptionError(
            f"{known.name} holds one layer, and the study has {len(names)}",
            "--layer",
            f"add --layer NAME, one of: {', '.join(there)}",
        )
    chosen: dict[str, pd.DataFrame] = dict(read_layers(study, names))
    if discs:
        anchors = read_layers(study, ["anchors"])
        if not anchors:
            mend = typed(LAYER_MENDS["anchors"], str(study))
            raise FileError("the study has no layer anchors", str(study), mend)
        chosen |= dict(disc_layer(anchors["anchors"], size) for size in discs)
    if known is formats.GEOPACKAGE and not layers:
        chosen |= read_tables(study, table_names(study))
    return chosen


def _export_tables(
    study: Path, path: Path, known: Format, table: str | None, overwrite: bool
) -> None:
    """Write one table or all of them, by the format."""
    found = read_findings(study)
    sheets = tables.sheets(found) if table is None else [tables.sheet(found, table)]
    if known is XLSX:
        write_workbook(path, sheets, title=found.name, overwrite=overwrite)
    elif known is formats.CSV:
        write_csv(path, sheets[0], overwrite=overwrite)
    else:
        content, mark = (
            (markup.latex(sheets), "% {}")
            if known is LATEX
            else (markup.markdown(sheets), "<!-- {} -->")
        )
        note = f"covertool {__version__}, from {study.name}, run {run_id(study)}"
        write_text(path, f"{content}\n{mark.format(note)}\n", known, overwrite=overwrite)

"""The figures that a study can show, each a counterpart of one in the paper."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from covertool import __version__
from covertool.errors import FileError, OptionError
from covertool.gis.study import read_layers, read_tables
from covertool.model import LEVELS, Bounds
from covertool.report.curves import LevelCurve, level_curves
from covertool.report.figures import of_one_radius, study_map
from covertool.report.findings import run_id
from covertool.report.parts import LAYER_MENDS, PARTS, typed

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class MapView:
    """A map: the layers it draws, the one it cannot do without, and its headline."""

    layers: tuple[str, ...]
    needed: str
    headline: str


_GROUND = ("buildings", "transit")
_LEVELS = tuple(f"coverage_level_{level}" for level in LEVELS[1:])
MAPS: Mapping[str, MapView] = {
    "coverage": MapView((*_GROUND, *_LEVELS, "anchors"), "transit", ""),
    "parked": MapView((*_GROUND, "anchors"), "transit", "transit area and parked cars"),
    "streets": MapView(("buildings", "streets", "segments"), "segments", "monitored streets"),
    "circuit": MapView(
        ("buildings", "trajectories", "anchors"), "trajectories", "drives and parked cars"
    ),
}
"""Maps: coverage (the paper's Figs. 3 and 5), parked (Fig. 4), streets (Fig. 1), circuit (Figs. 6
and 7)."""
CURVES = ("curve", "penetration")
VIEWS = (*MAPS, *CURVES)


@dataclass(frozen=True)
class MapOptions:
    """What a figure shows.

    Attributes
    ----------
    show : one of `VIEWS`
    radius_m : of the coverage; the smallest in the study when None
    bounds : the part of the map, in metres of the CRS; all when None
    title : headline; said from the study when None
    licence, data_date : for the footnote; from the study's metadata when None
    """

    show: str = "coverage"
    radius_m: float | None = None
    bounds: Bounds | None = None
    title: str | None = None
    licence: str | None = None
    data_date: str | None = None


def draw(study: Path, options: MapOptions, metadata: Mapping[str, str]) -> tuple[Figure, str]:
    """Return a figure of a study and what the file says of its making.

    Raises
    ------
    OptionError
        When there is no such view, or the study holds no coverage of the radius.
    FileError
        When the study lacks what the view shows; the error names the verb that makes it.
    """
    note = json.dumps({"study": study.name, "run": run_id(study), **metadata}, ensure_ascii=False)
    if options.show in MAPS:
        return _draw_map(study, MAPS[options.show], options, metadata), note
    if options.show in CURVES:
        return _draw_curve(study, options, metadata), note
    raise OptionError(
        f"there is no view {options.show!r}", "--show", f"choose one of: {', '.join(VIEWS)}"
    )


def _draw_map(
    study: Path, view: MapView, options: MapOptions, metadata: Mapping[str, str]
) -> Figure:
    """Return a map of the layers that a view shows."""
    layers = read_layers(study, view.layers)
    if view.needed not in layers:
        raise FileError(
            f"the study has no {view.needed} layer",
            str(study),
            typed(LAYER_MENDS[view.needed], str(study)),
        )
    shown, coverage = of_one_radius(layers, options.radius_m)
    headline = view.headline or coverage
    return study_map(
        shown,
        title=options.title or f"{metadata.get('title', study.stem)}: {headline}",
        footnote=footnote(study, options, metadata),
        bounds=options.bounds,
    )


def footnote(study: Path, options: MapOptions, metadata: Mapping[str, str]) -> str:
    """Return the lines below a map: data date, licence, what made it, and that it is synthetic."""
    date = options.data_date or metadata.get("data_date") or "not stated"
    licence = options.licence or metadata.get("licence") or "not stated"
    lines = [
        f"Data of: {date}. Licence of the data: {licence}.",
        f"covertool {__version__}, from {study.name}, run {run_id(study)}. Unit-disc model.",
    ]
    if "synthetic" in metadata:
        lines.append(f"synthetic: {metadata.get('title', 'invented data')}, no measured place")
    return "\n".join(lines)


def _draw_curve(study: Path, options: MapOptions, metadata: Mapping[str, str]) -> Figure:
    """Return coverage against the radius, or against the share of equipped cars."""
    part = PARTS[options.show]
    frame = read_tables(study, [part.table]).get(part.table)
    if frame is None:
        raise part.absent(str(study))
    if options.show == "curve":
        panels = [LevelCurve("all anchors", "radius (m)", *_by_level(frame, "radius_m"))]
    else:
        panels = [
            LevelCurve(_size(size), "equipped cars (%)", 100 * x, fractions)
            for size, group in frame.groupby("radius_m", dropna=False)
            for x, fractions in [_by_level(group, "share", "expected")]
        ]
    return level_curves(panels, footnote=footnote(study, options, metadata))


def _by_level(frame: pd.DataFrame, x: str, value: str = "fraction") -> tuple[Any, Any]:
    """Return the rising values of a column, and the share of each level (N, 4) at each."""
    wide = frame.pivot_table(index=x, columns="level", values=value).reindex(columns=LEVELS)
    return np.asarray(wide.index, dtype=float), wide.fillna(0.0).to_numpy(dtype=float)


def _size(radius_m: Any) -> str:
    return "each its own radius" if radius_m != radius_m else f"radius {radius_m:g} m"

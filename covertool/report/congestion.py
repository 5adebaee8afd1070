"""Figures of congestion: the map in the paper's colours, and weekday against hour."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from covertool import crs as crs_door
from covertool.congestion.status import CLOSED, UNKNOWN
from covertool.gis.styles import CONGESTION_COLOURS
from covertool.report.figures import draw_north_arrow, draw_scale_bar

if TYPE_CHECKING:
    from collections.abc import Collection

    import geopandas as gpd
    from pyproj import CRS

    from covertool.congestion.moment import Moment
    from covertool.congestion.streets import Streets
    from covertool.model import Objects, OccupancyTable

_WIDTHS_PT = {"unknown": 0.8, "closed": 1.4, "free": 1.6, "occupied": 1.8}


def kinds(status: Objects, occupied: Collection[str]) -> Objects:
    """Return how each piece is drawn: occupied, free, closed or unknown.

    Examples
    --------
    >>> kinds(np.array(["slow", "free", "closed"], dtype=object), ["slow"]).tolist()
    ['occupied', 'free', 'closed']
    """
    words = status.astype(str)
    kind: Objects = np.where(np.isin(words, list(occupied)), "occupied", "free").astype(object)
    for word in (CLOSED, UNKNOWN):
        kind[words == word] = word
    return kind


def congestion_layer(network: Streets, moment: Moment, kind: Objects) -> gpd.GeoDataFrame:
    """Return the pieces of street as a layer, each with its state at one moment."""
    import geopandas as gpd

    columns = {
        "segment_id": network.segment_id,
        "length_m": network.length_m,
        "lanes": network.lanes,
        "status": moment.status,
        "kind": kind,
        "queue_m": moment.queue_m,
        "day": str(moment.day),
        "window": moment.window,
    }
    return gpd.GeoDataFrame(columns, geometry=list(network.line), crs=network.crs)


def congestion_map(
    lines: Objects, kind: Objects, crs: CRS, *, title: str, width_in: float = 8.0
) -> Figure:
    """Return the map of a network at one moment: occupied black, free yellow.

    Parameters
    ----------
    lines : (N,) object array of LineStrings in ``crs``, in metres
    kind : (N,) object array as `kinds` returns it
    crs : CRS of the lines
    title : str
    width_in : float
        Width of the figure in inches; the height follows from the map.

    Examples
    --------
    >>> from pyproj import CRS
    >>> lines = np.array([shapely.LineString([(0, 0), (900, 400)])], dtype=object)
    >>> black = np.array(["occupied"], dtype=object)
    >>> congestion_map(lines, black, CRS(2157), title="noon").axes[0].get_title(loc="left")
    'noon'
    """
    x0, y0, x1, y1 = shapely.total_bounds(lines)
    margin = 0.03 * max(x1 - x0, y1 - y0)
    x0, y0, x1, y1 = x0 - margin, y0 - margin, x1 + margin, y1 + margin
    height = min(14.0, width_in * (y1 - y0) / (x1 - x0) + 1.0)
    figure = Figure(figsize=(width_in, height), layout="constrained")
    axes = figure.add_subplot()
    axes.set_facecolor("#f4f2ee")
    handles = []
    for order, (name, colour) in enumerate(CONGESTION_COLOURS.items()):
        width = _WIDTHS_PT[name]
        chosen = lines[kind == name]
        if chosen.size:
            paths = [shapely.get_coordinates(line) for line in chosen]
            axes.add_collection(
                LineCollection(paths, colors=colour, linewidths=width, zorder=2 + order)
            )
            label = f"{name}: {shapely.length(chosen).sum() / 1000:.1f} km"
            handles.append(Line2D([], [], color=colour, linewidth=2 * width, label=label))
    axes.set(xlim=(x0, x1), ylim=(y0, y1), aspect="equal", xticks=[], yticks=[])
    axes.set_title(title, loc="left", fontsize=11)
    note = f"CRS {crs_door.name(crs)}. Length by direction; of two the occupied lies on top."
    axes.set_xlabel(note, fontsize=7, loc="left")
    draw_scale_bar(axes, x1 - x0)
    draw_north_arrow(axes)
    figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=8, frameon=False)
    return figure


def heat_matrix(table: OccupancyTable, *, title: str) -> Figure:
    """Return the flagged length by weekday (rows) and window (columns) as colours and numbers.

    Blank cells, of which too little was observed, stay white.
    """
    days = list(dict.fromkeys(cell.day for cell in table.cells))
    windows = list(dict.fromkeys(cell.window for cell in table.cells))
    figures = np.full((len(days), len(windows)), np.nan)
    for cell in table.cells:
        if cell.percent is not None:
            figures[days.index(cell.day), windows.index(cell.window)] = cell.percent
    figure = Figure(
        figsize=(2.0 + 0.42 * len(windows), 1.6 + 0.38 * len(days)), layout="constrained"
    )
    axes = figure.add_subplot()
    top = float(np.nanmax(figures)) if np.isfinite(figures).any() else 1.0
    image = axes.imshow(figures, cmap="YlOrRd", vmin=0, vmax=max(top, 1e-9), aspect="auto")
    for row, column in zip(*np.nonzero(np.isfinite(figures)), strict=True):
        value = figures[row, column]
        colour = "white" if value > 0.6 * top else "black"
        axes.text(column, row, f"{value:.0f}", ha="center", va="center", fontsize=7, color=colour)
    axes.set_xticks(range(len(windows)), windows, fontsize=7)
    axes.set_yticks(range(len(days)), days, fontsize=8)
    axes.set_title(title, loc="left", fontsize=10)
    figure.colorbar(image, ax=axes, label="flagged street length, %")
    return figure

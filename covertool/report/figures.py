"""The coverage map as a printed figure, in the paper's colours."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch, Rectangle
from matplotlib.path import Path

from covertool import crs as crs_door
from covertool.errors import OptionError
from covertool.gis.styles import (
    BUILDING_COLOUR,
    CAR_DIAMETER_M,
    LEVEL_COLOURS,
    PARKED_COLOUR,
    TRANSIT_COLOUR,
)
from covertool.model import Bounds

if TYPE_CHECKING:
    import geopandas as gpd
    from matplotlib.axes import Axes

TRANSIT, PARKED = TRANSIT_COLOUR, PARKED_COLOUR
LEVEL_1, LEVEL_2, LEVEL_3 = LEVEL_COLOURS.values()
"""Colours of the paper's Fig. 3: transit blue; Levels 1, 2, 3 yellow, orange, red; cars black."""

_AREAS = (
    ("buildings", BUILDING_COLOUR, "buildings"),
    ("transit", TRANSIT, "transit area, not covered"),
    ("coverage_level_1", LEVEL_1, "Level 1: one parked car"),
    ("coverage_level_2", LEVEL_2, "Level 2: two"),
    ("coverage_level_3", LEVEL_3, "Level 3: three or more"),
)
_LINES = (
    ("streets", "#b9b4ab", 0.6, "streets"),
    ("segments", TRANSIT, 1.8, "monitored streets"),
    ("trajectories", TRANSIT, 1.2, "drives"),
)
_SUBJECTS = ("transit", "segments", "trajectories")
_TALLEST = 1.6  # height of a map over its width; a page is about that


def study_map(
    layers: Mapping[str, gpd.GeoDataFrame],
    *,
    title: str,
    footnote: str = "",
    bounds: Bounds | None = None,
    width_in: float = 8.0,
) -> Figure:
    """Return the map of a study: areas, lines and parked cars, with what a printed map needs.

    A scale bar, an arrow to grid north, a legend, and below the CRS and the footnote.

    Parameters
    ----------
    layers : mapping of layer name to GeoDataFrame
        Of `buildings`, `transit`, `coverage_level_1` to `_3`, `streets`, `segments`,
        `trajectories` and `anchors` those that are there, all in one projected CRS; a level layer
        holds one radius.
    title : str
        The headline.
    footnote : str
        Provenance and licence, printed below the map.
    bounds : (x0, y0, x1, y1), optional
        The part to show, in metres of the CRS; when left out, the box of the transit area, of
        the segments or of the trajectories, whichever is there first.
    width_in : float
        Width of the figure in inches; the height follows from the map.

    Examples
    --------
    >>> import geopandas as gpd, shapely
    >>> road = gpd.GeoDataFrame(geometry=[shapely.box(0, 0, 200, 100)], crs=2157)
    >>> study_map({"transit": road}, title="a road").axes[0].get_title(loc="left")
    'a road'
    """
    x0, y0, x1, y1 = bounds or _padded(_extent(layers))
    height_in = min(width_in * (y1 - y0) / (x1 - x0), _TALLEST * width_in)
    figure = Figure(figsize=(width_in, height_in + 1.3), layout="constrained")
    axes = figure.add_subplot()
    handles: list[Any] = [
        _draw_areas(axes, layers[name], colour, label)
        for name, colour, label in _AREAS
        if name in layers
    ]
    handles += [
        _draw_lines(axes, layers[name], colour, width_pt, label)
        for name, colour, width_pt, label in _LINES
        if name in layers
    ]
    if "anchors" in layers:
        handles.append(_draw_anchors(axes, layers["anchors"], (x0, y0, x1, y1), width_in))
    axes.set(xlim=(x0, x1), ylim=(y0, y1), aspect="equal", xticks=[], yticks=[])
    axes.set_title(title, loc="left", fontsize=11)
    draw_scale_bar(axes, x1 - x0)
    crs = next(iter(layers.values())).crs
    if not crs_door.is_image_plane(crs):  # which has no north
        draw_north_arrow(axes)
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    told = "\n".join(filter(None, [f"CRS {crs_door.name(crs)}", footnote]))
    axes.set_xlabel(told, fontsize=7, loc="left")
    return figure


def of_one_radius(
    layers: Mapping[str, gpd.GeoDataFrame], radius_m: float | None
) -> tuple[dict[str, gpd.GeoDataFrame], str]:
    """Return the layers with the coverage of one radius only, and a phrase that names it.

    Parameters
    ----------
    layers : mapping of layer name to GeoDataFrame
        Level layers have a column `radius_m`, null where anchors of several radii are mixed.
    radius_m : float or None
        The radius to keep; the first in the layers when None.

    Raises
    ------
    OptionError
        When the study holds no coverage of that radius.
    """
    levels = [name for name in layers if name.startswith("coverage_level_")]
    radii = sorted({float(r) for name in levels for r in layers[name]["radius_m"].dropna()})
    if radius_m is not None and radius_m not in radii:
        raise OptionError(
            f"the study holds no coverage for {radius_m:g} m",
            "--radius",
            f"covertool coverage STUDY --radius {radius_m:g} --into STUDY",
        )
    if not levels:
        return dict(layers), "transit area and parked cars (no coverage computed yet)"
    if not radii:
        return dict(layers), "coverage by each car's own radius"
    chosen = radii[0] if radius_m is None else radius_m
    kept = {
        name: frame[frame["radius_m"] == chosen] if name in levels else frame
        for name, frame in layers.items()
    }
    return kept, f"coverage at {chosen:g} m"


def _extent(layers: Mapping[str, gpd.GeoDataFrame]) -> Bounds:
    """Return the box of what the map is about: roads rather than the houses around them."""
    subject = next((name for name in _SUBJECTS if name in layers), None)
    frames = layers.values() if subject is None else [layers[subject]]
    boxes = np.array([frame.total_bounds for frame in frames if len(frame) > 0])
    if boxes.size == 0:
        return 0.0, 0.0, 1.0, 1.0
    (x0, y0), (x1, y1) = boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)
    return float(x0), float(y0), float(x1), float(y1)


def _padded(bounds: tuple[Any, ...]) -> Bounds:
    x0, y0, x1, y1 = (float(value) for value in bounds)
    margin = 0.02 * max(x1 - x0, y1 - y0)
    return x0 - margin, y0 - margin, x1 + margin, y1 + margin


def _draw_areas(axes: Axes, frame: gpd.GeoDataFrame, colour: str, label: str) -> Patch:
    patches = [PathPatch(_path(polygon)) for polygon in frame.geometry.explode() if polygon]
    axes.add_collection(PatchCollection(patches, facecolor=colour, edgecolor="none"))
    return Patch(facecolor=colour, label=label)


def _path(polygon: Any) -> Path:
    rings = [polygon.exterior, *polygon.interiors]
    return Path.make_compound_path(
        *(Path(np.asarray(ring.coords)[:, :2], closed=True) for ring in rings)
    )


def _draw_lines(
    axes: Axes, frame: gpd.GeoDataFrame, colour: str, width_pt: float, label: str
) -> Line2D:
    paths = [shapely.get_coordinates(line) for line in frame.geometry.explode() if line]
    axes.add_collection(LineCollection(paths, colors=colour, linewidths=width_pt, zorder=2))
    return Line2D([], [], color=colour, linewidth=width_pt, label=label)


def _draw_anchors(axes: Axes, frame: gpd.GeoDataFrame, shown: Bounds, width_in: float) -> Line2D:
    """Draw cars as dots of a car's area; the one in the legend is seen at any scale."""
    x0, y0, x1, y1 = shown
    points = frame.geometry.cx[x0:x1, y0:y1]
    car_pt = CAR_DIAMETER_M / (x1 - x0) * width_in * 72
    size = max(car_pt, 0.7) ** 2
    axes.scatter(points.x, points.y, s=size, c=PARKED, linewidths=0, zorder=3)
    origins = set(frame["origin"]) if "origin" in frame.columns else {"parked"}
    what = "parked cars" if origins <= {"parked"} else f"anchors ({', '.join(sorted(origins))})"
    count = f"{len(frame):,}" if len(points) == len(frame) else f"{len(points):,} of {len(frame):,}"
    label = f"{count} {what}"
    return Line2D([], [], linestyle="", marker="o", markersize=3, color=PARKED, label=label)


def draw_scale_bar(axes: Axes, map_width_m: float) -> None:
    """Draw a bar of a round length, about a fifth of the map."""
    exponent = math.floor(math.log10(map_width_m / 5))
    length = max(
        step * 10.0**exponent for step in (1, 2, 5, 10) if step * 10.0**exponent <= map_width_m / 4
    )
    share = length / map_width_m
    axes.add_patch(
        Rectangle((0.03, 0.03), share, 0.008, transform=axes.transAxes, color="black", zorder=5)
    )
    text = f"{length / 1000:g} km" if length >= 1000 else f"{length:g} m"
    axes.text(0.03 + share / 2, 0.045, text, transform=axes.transAxes, ha="center", fontsize=8)


def draw_north_arrow(axes: Axes) -> None:
    """Draw an arrow to grid north in the upper right corner."""
    axes.annotate(
        "N", xy=(0.96, 0.97), xytext=(0.96, 0.88), xycoords="axes fraction", ha="center",
        va="center", fontsize=10, arrowprops={"arrowstyle": "-|>", "facecolor": "black"},
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.5}, zorder=6,
    )  # fmt: skip

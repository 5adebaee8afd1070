"""The map as a Bokeh figure, and what the page says about how it was drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from bokeh.models import (
    Circle,
    ColumnDataSource,
    MultiLine,
    MultiPolygons,
    PanTool,
    Range1d,
    Rect,
    WheelZoomTool,
)
from bokeh.plotting import figure

from covertool.model import Bounds
from covertool.report.page import shapes, theme
from covertool.report.page.maplayer import MapLayer
from covertool.report.page.shapes import Drawn, MapFrame
from covertool.report.page.theme import coloured, dress

_UNIT = 10  # decimetres in a metre
_MARK_M = 4.0  # about a car


@dataclass(frozen=True)
class TownMap:
    """The map of a study.

    Attributes
    ----------
    plot : Bokeh figure in decimetres from the frame's origin
    layers : the layers drawn, from the bottom up
    radii : names of the radii to choose from
    tolerance_m : how far a line may lie from where it is in the study
    thinned : a sentence for each layer of which not every mark is drawn
    """

    plot: figure
    layers: tuple[MapLayer, ...]
    radii: tuple[str, ...]
    tolerance_m: float
    thinned: tuple[str, ...]


def town_map(layers: Sequence[MapLayer]) -> TownMap:
    """Return the map of some layers, all in one CRS in metres; at least one shape is needed."""
    frame = MapFrame.around(_bounds(layers))
    plot = _empty_figure(frame)
    drawable = [layer.shapes for layer in layers if layer.form in ("area", "outline", "line")]
    tolerance_m = shapes.choose_tolerance(drawable)
    radii = tuple(dict.fromkeys(layer.radius for layer in layers if layer.radius is not None))
    thinned = []
    for layer in layers:
        drawn, cell_m = _drawn(layer, frame, tolerance_m)
        if cell_m:
            thinned.append(
                f"{layer.label}: {len(drawn.x):,} of {len(layer.shapes):,} are drawn, one in each"
                f" square of {cell_m:g} m."
            )
        _add(plot, layer, drawn, shown=layer.shown and layer.radius in (None, *radii[:1]))
    dress(plot, ground=theme.LAND)
    return TownMap(plot, tuple(layers), radii, tolerance_m, tuple(thinned))


def _bounds(layers: Sequence[MapLayer]) -> Bounds:
    boxes = np.array([shapely.total_bounds(layer.shapes) for layer in layers])
    low, high = np.nanmin(boxes[:, :2], axis=0), np.nanmax(boxes[:, 2:], axis=0)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def _empty_figure(frame: MapFrame) -> figure:
    """Return a figure over the frame, which can be moved and zoomed."""
    wheel = WheelZoomTool(modifiers={"ctrl": True})
    plot = figure(
        name="map",
        x_range=Range1d(start=0, end=round(frame.width_m * _UNIT)),
        y_range=Range1d(start=0, end=round(frame.height_m * _UNIT)),
        sizing_mode="scale_width",
        aspect_ratio=frame.width_m / frame.height_m,
        min_border=0,
        toolbar_location=None,
        tools=[PanTool(), wheel],
        lod_threshold=None,
    )
    plot.toolbar.active_scroll = wheel
    plot.axis.visible = False
    plot.grid.visible = False
    return plot


def _drawn(layer: MapLayer, frame: MapFrame, tolerance_m: float) -> tuple[Drawn, float]:
    if layer.form in ("car", "mark"):
        x, y = shapely.get_x(layer.shapes), shapely.get_y(layer.shapes)
        return shapes.draw_marks(x, y, frame)
    draw = shapes.draw_lines if layer.form == "line" else shapes.draw_areas
    return draw(layer.shapes, frame, tolerance_m), 0.0


def _add(plot: figure, layer: MapLayer, drawn: Drawn, *, shown: bool) -> None:
    """Add a layer; its pop-up headings travel in the tags, for the page's script."""
    data: dict[str, Any] = {"x": drawn.x, "y": drawn.y}
    heads = list(layer.values)
    for i, head in enumerate(heads):
        texts = layer.values[head]
        data[f"v{i}"] = [texts[row] for row in drawn.row]
    if layer.turned is not None:
        heading, length, width = (values[drawn.row] for values in layer.turned)
        data["angle"] = np.rint(90 - heading).astype(int).tolist()
        data["length"] = np.rint(length * _UNIT).astype(int).tolist()
        data["width"] = np.rint(width * _UNIT).astype(int).tolist()
    glyph, chosen = _glyph(layer), _glyph(layer, chosen=True)
    renderer = plot.add_glyph(
        ColumnDataSource(data),
        glyph,
        selection_glyph=chosen,
        nonselection_glyph=glyph,  # a copy of Bokeh's own would keep the light colours
        visible=shown,
        name=layer.key,
    )
    renderer.tags = [{"key": layer.key, "label": layer.label, "radius": layer.radius,
                      "heads": heads, "form": layer.form}]  # fmt: skip


def _glyph(layer: MapLayer, *, chosen: bool = False) -> Any:
    """Return how a layer looks, or how its chosen shape does."""
    inked = theme.INK if chosen else layer.colour
    ringed = theme.ACCENT if chosen else layer.colour
    if layer.form == "area":
        area = MultiPolygons(xs="x", ys="y", fill_alpha=layer.opacity, line_width=2.5,
                             line_alpha=1.0 if chosen else 0.0)  # fmt: skip
        return coloured(area, fill_color=layer.colour, line_color=inked)
    if layer.form == "outline":
        dash = "solid" if chosen else [6, 4]
        outline = MultiPolygons(xs="x", ys="y", fill_alpha=0.0, line_width=2.5 if chosen else 1.2,
                                line_dash=dash)  # fmt: skip
        return coloured(outline, line_color=inked)
    if layer.form == "line":
        line = MultiLine(xs="x", ys="y", line_width=layer.width + (3 if chosen else 0))
        return coloured(line, line_color=inked)
    thick = 3 if chosen else 0.3
    if layer.form == "car":
        car = Rect(x="x", y="y", width="length", height="width", line_width=thick,
                   angle={"field": "angle", "units": "deg"})  # fmt: skip
        return coloured(car, fill_color=layer.colour, line_color=ringed)
    mark = Circle(x="x", y="y", radius=round(_MARK_M / 2 * _UNIT), line_width=thick)
    return coloured(mark, fill_color=layer.colour, line_color=ringed)

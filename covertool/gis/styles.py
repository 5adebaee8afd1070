"""The paper's colours, and how each layer of a study looks; `qml`, `sld` and `kml` spell it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd

LEVEL_COLOURS = {1: "#ffd92f", 2: "#fd8d3c", 3: "#e31a1c"}
"""Yellow, orange and red for Levels 1, 2 and 3, as in the paper's figures."""
TRANSIT_COLOUR = "#4f81bd"
PARKED_COLOUR = "#000000"
BUILDING_COLOUR = "#d9d6d0"
CONGESTION_COLOURS = {
    "unknown": "#d0d0d0",
    "closed": "#8c6bb1",
    "free": "#ffd92f",
    "occupied": "#000000",
}
"""Kinds of street from the bottom up; the paper's Fig. 2 draws occupied black and free yellow."""

PIXELS_PER_MM = 96 / 25.4
"""Of a screen, by the convention of web pages."""

CAR_DIAMETER_M = 3.2
"""Of a disc with the area that a car of 4.4 m by 1.8 m takes."""


@dataclass(frozen=True)
class Style:
    """How a layer looks.

    Attributes
    ----------
    kind : fill, line or marker
    colour : of the fill, line or marker, as #rrggbb
    opacity : 0 (not seen) to 1
    size_mm : width of a line, diameter of a marker, or width of a fill's outline on paper
    size_m : diameter of a marker on the ground, where a GIS can draw that; never below a third
        of ``size_mm`` nor above twice that
    outline : colour of a fill's outline, or None
    title : what a legend calls it
    """

    kind: str
    colour: str
    opacity: float = 1.0
    size_mm: float = 1.0
    size_m: float | None = None
    outline: str | None = None
    title: str = ""


@dataclass(frozen=True)
class Choice:
    """Rows of a layer that are shown or hidden together, such as the levels of one radius.

    Attributes
    ----------
    column, value : the rows are those with this value in this column
    label : what a legend adds to the layer's title
    shown : whether they are drawn at first
    style : how they look
    """

    column: str
    value: float | str
    label: str
    shown: bool
    style: Style


LAYER_STYLES = {
    "coverage_level_1": Style("fill", LEVEL_COLOURS[1], title="Level 1: one parked car"),
    "coverage_level_2": Style("fill", LEVEL_COLOURS[2], title="Level 2: two"),
    "coverage_level_3": Style("fill", LEVEL_COLOURS[3], title="Level 3: three or more"),
    "transit": Style("fill", TRANSIT_COLOUR, title="transit area"),
    "anchors": Style("marker", PARKED_COLOUR, 1.0, 1.0, CAR_DIAMETER_M, title="anchors"),
    "vehicles": Style("fill", PARKED_COLOUR, title="vehicles"),
    "segments": Style("line", "#5b2a86", size_mm=0.6, title="monitored segments"),
    "congestion": Style("line", CONGESTION_COLOURS["occupied"], size_mm=0.7, title="streets"),
    "zones": Style("fill", "#ffffff", 0.0, 0.4, outline="#333333", title="zones"),
    "trajectories": Style("line", "#0b7a5e", size_mm=0.4, title="trajectories"),
    "streets": Style("line", "#8a8a8a", size_mm=0.3, title="streets"),
    "buildings": Style("fill", BUILDING_COLOUR, title="buildings"),
}
_DISCS = Style("fill", "#4d4d4d", 0.08, 0.15, outline="#4d4d4d", title="discs")
DISCS_PREFIX = "discs_"


def rgb(colour: str) -> tuple[int, int, int]:
    """Return red, green and blue, 0 to 255, of #rrggbb.

    >>> rgb("#ffd92f")
    (255, 217, 47)
    """
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue


def style_of(layer: str) -> Style | None:
    """Return the style of a layer by its name, or None when it is no layer of covertool.

    >>> style_of("transit").colour
    '#4f81bd'
    """
    return _DISCS if layer.startswith(DISCS_PREFIX) else LAYER_STYLES.get(layer)


def choices(layer: str, frame: pd.DataFrame) -> list[Choice]:
    """Return the rows of a layer that a GIS shows or hides together; none when that is all.

    Levels of several radii lie on top of one another, so only the smallest is shown at first.
    Streets at rush hour are drawn by kind.
    """
    style = style_of(layer)
    if style is None:
        return []
    if layer == "congestion" and "kind" in frame.columns:
        there = set(frame["kind"])
        return [
            Choice("kind", kind, kind, True, replace(style, colour=colour))
            for kind, colour in CONGESTION_COLOURS.items()
            if kind in there
        ]
    if "radius_m" not in frame.columns or "level" not in frame.columns:
        return []
    radii = sorted({float(radius) for radius in frame["radius_m"].dropna()})
    if len(radii) < 2:
        return []
    return [
        Choice("radius_m", radius, f"{radius:g} m", radius == radii[0], style) for radius in radii
    ]

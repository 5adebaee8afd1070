"""Colours of the page's figures, each for light and for dark.

A figure is made in light colours; its models carry both in their tags, and the page's script sets
the ones that the reader's device asks for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from covertool.gis.styles import LEVEL_COLOURS, TRANSIT_COLOUR

if TYPE_CHECKING:
    from bokeh.models import Model
    from bokeh.plotting import figure

Pair = tuple[str, str]
"""A colour for light and one for dark."""

PAPER: Pair = ("#ffffff", "#1b1f24")
INK: Pair = ("#22272d", "#e8e6e1")
MUTED: Pair = ("#59626b", "#a9b2ba")
RULE: Pair = ("#e3dfd6", "#343a42")
LAND: Pair = ("#f6f4ef", "#14171b")
BUILDING: Pair = ("#d8d2c6", "#33393f")
TRANSIT: Pair = (TRANSIT_COLOUR, "#4b86dd")
LEVELS: dict[int, Pair] = {level: (colour, colour) for level, colour in LEVEL_COLOURS.items()}
PARKED: Pair = ("#000000", "#f7f7f7")
QUEUED: Pair = ("#7a0177", "#f0a6ee")
ROADSIDE: Pair = ("#006d5b", "#5fe0c6")
ACCENT: Pair = ("#1f5fbf", "#7fb0ff")
OCCUPIED: Pair = ("#7a0177", "#f58cf1")
FREE: Pair = ("#1a8f6d", "#3fc79b")
CLOSED: Pair = ("#8a5a00", "#d9a441")
UNKNOWN: Pair = ("#8b929a", "#7b838c")
ERRORS: tuple[Pair, ...] = (
    ("#440154", "#fde725"),
    ("#3b528b", "#b5de2b"),
    ("#21918c", "#35b779"),
    ("#5ec962", "#31a0a8"),
    ("#b5b000", "#6d7fc4"),
)
"""From the largest error to the smallest."""
FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Noto Sans', sans-serif"

M = TypeVar("M", bound="Model")


def coloured(model: M, **pairs: Pair) -> M:
    """Set colours on a Bokeh model, and leave both schemes' in its tags for the page's script."""
    light = {name: pair[0] for name, pair in pairs.items()}
    dark = {name: pair[1] for name, pair in pairs.items()}
    model.update(**light)
    model.tags = [*model.tags, {"light": light, "dark": dark}]
    return model


def dress(plot: figure, *, ground: Pair = PAPER) -> None:
    """Give a figure the page's fonts and colours."""
    coloured(
        plot,
        border_line_color=ground,
        background_fill_color=ground,
        border_fill_color=ground,
        outline_line_color=RULE,
    )
    for axis in plot.axis:
        axis.update(axis_label_text_font=FONT, major_label_text_font=FONT,
                    axis_label_text_font_size="13px", major_label_text_font_size="12px",
                    axis_label_text_font_style="normal", minor_tick_line_color=None)  # fmt: skip
        coloured(axis, axis_label_text_color=INK, major_label_text_color=MUTED,
                 axis_line_color=MUTED, major_tick_line_color=MUTED)  # fmt: skip
    for grid in plot.grid:
        coloured(grid, grid_line_color=RULE)

"""Plots of the page: levels against radius or share, errors by arm, what parked cars save."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from bokeh.models import ColumnDataSource, DataRange1d, FactorRange, HoverTool, Range1d
from bokeh.models.annotations import Span
from bokeh.plotting import figure

from covertool.model import Floats
from covertool.model.coverage import LEVEL_LABELS
from covertool.report.page import theme
from covertool.report.page.blocks import KeyEntry
from covertool.report.page.theme import coloured, dress

_LEVELS = (
    (3, LEVEL_LABELS[3], theme.LEVELS[3]),
    (2, LEVEL_LABELS[2], theme.LEVELS[2]),
    (1, LEVEL_LABELS[1], theme.LEVELS[1]),
    (0, LEVEL_LABELS[0], theme.TRANSIT),
)


LEVEL_KEY = tuple(KeyEntry(label, "area", colour) for _, label, colour in _LEVELS)
ERROR_KEY = (
    KeyEntry("without parked cars", "dot", theme.MUTED),
    KeyEntry("with parked cars", "dot", theme.ACCENT),
    KeyEntry("lower bound (RMSE)", "tick", theme.INK),
)
SAVING_KEY = (
    KeyEntry("improvement", "dot", theme.ACCENT),
    KeyEntry("95 % interval", "line", theme.ACCENT),
)
_DASHES = ("solid", "dashed")


def line_key(lines: Sequence[tuple[str, float]]) -> tuple[KeyEntry, ...]:
    """Return the key of the upright lines of `error_plot`."""
    forms = ("line", "dashed")
    return tuple(
        KeyEntry(f"{name}, {at:.2f} m", form, theme.MUTED)
        for (name, at), form in zip(lines, forms, strict=False)
    )


def level_plot(x: Floats, percents: Floats, *, x_label: str, unit: str) -> figure:
    """Return Levels 0 to 3 as stacked areas, Level 3 at the bottom.

    Parameters
    ----------
    x : (N,) rising values of what varies
    percents : (N, 4) shares of Levels 0, 1, 2, 3
    x_label : what varies, with its unit
    unit : the unit alone, for the pop-up
    """
    plot = _figure(x_label=x_label, y_label="share of the transit area (%)", height=320)
    low, high = float(np.min(x)), float(np.max(x))
    plot.x_range = Range1d(start=low, end=high if high > low else low + 1)
    plot.y_range = Range1d(start=0, end=100)
    base = np.zeros(len(x))
    for level, _, colour in _LEVELS:
        top = base + percents[:, level]
        area = plot.varea(x=x.tolist(), y1=base.tolist(), y2=top.tolist())
        coloured(area.glyph, fill_color=colour)
        base = top
    source = ColumnDataSource(
        {"x": x.tolist(), "top": (100 - percents[:, 0]).tolist()}
        | {f"p{level}": np.round(percents[:, level], 2).tolist() for level in range(4)}
    )
    dots = plot.scatter("x", "top", source=source, size=5)
    coloured(dots.glyph, fill_color=theme.INK, line_color=theme.INK)
    plot.add_tools(
        HoverTool(
            renderers=[dots],
            mode="vline",
            tooltips=[("at", f"@x{{0.[00]}} {unit}")]
            + [(label.split(":")[0], f"@p{level}{{0.00}} %") for level, label, _ in _LEVELS],
        )
    )
    dress(plot)
    return plot


@dataclass(frozen=True)
class ArmPair:
    """The mean error of a case with and without parked cars, and its bound; None where unknown.

    Attributes
    ----------
    case : estimator, zone and range noise in words
    traditional_m, proposed_m : mean error without and with parked cars
    bound_m : the least RMSE that is possible with parked cars
    """

    case: str
    traditional_m: float | None
    proposed_m: float | None
    bound_m: float | None


def error_plot(pairs: Sequence[ArmPair], lines: Sequence[tuple[str, float]]) -> figure:
    """Return one row for each case: without parked cars, with them, and the bound.

    ``lines`` are (name, metres) of the arms that do not range, drawn as upright lines.
    """
    cases = [pair.case for pair in pairs][::-1]
    plot = _figure(x_label="position error (m)", height=80 + 34 * len(cases), cases=cases)
    found = [v for p in pairs for v in (p.traditional_m, p.proposed_m, p.bound_m) if v is not None]
    plot.x_range = Range1d(start=0, end=1.08 * max([*found, *(at for _, at in lines), 1e-9]))
    both = [(p.case, p.traditional_m, p.proposed_m) for p in pairs
            if p.traditional_m is not None and p.proposed_m is not None]  # fmt: skip
    joins = plot.segment(
        x0=[without for _, without, _ in both], x1=[with_them for _, _, with_them in both],
        y0=[case for case, _, _ in both], y1=[case for case, _, _ in both], line_width=3,
    )  # fmt: skip
    coloured(joins.glyph, line_color=theme.RULE)
    for (_, at), dash in zip(lines, _DASHES, strict=False):
        _upright(plot, at, dash)
    for entry, values in zip(
        ERROR_KEY,
        (
            [(p.case, p.traditional_m) for p in pairs],
            [(p.case, p.proposed_m) for p in pairs],
            [(p.case, p.bound_m) for p in pairs],
        ),
        strict=True,
    ):
        _dots(plot, values, entry, "m")
    dress(plot)
    return plot


@dataclass(frozen=True)
class Saving:
    """What parked cars take off the mean error, in percent, with its interval where known.

    Attributes
    ----------
    case : estimator, zone and range noise in words
    percent : the improvement
    low, high : ends of its 95 % interval
    """

    case: str
    percent: float
    low: float | None = None
    high: float | None = None


def saving_plot(savings: Sequence[Saving]) -> figure:
    """Return one row for each case: the improvement and its 95 % interval."""
    cases = [saving.case for saving in savings][::-1]
    plot = _figure(x_label="taken off the mean error (%)", height=80 + 34 * len(cases),
                   cases=cases)  # fmt: skip
    ends = [v for s in savings for v in (s.percent, s.low, s.high, 0.0) if v is not None]
    margin = 0.06 * max(max(ends) - min(ends), 1e-9)
    plot.x_range = Range1d(start=min(ends) - margin, end=max(ends) + margin)
    known = [(s.case, s.low, s.high) for s in savings if s.low is not None and s.high is not None]
    whiskers = plot.segment(
        x0=[low for _, low, _ in known], x1=[high for _, _, high in known],
        y0=[case for case, _, _ in known], y1=[case for case, _, _ in known], line_width=2,
    )  # fmt: skip
    coloured(whiskers.glyph, line_color=theme.ACCENT)
    _upright(plot, 0.0, "solid")
    _dots(plot, [(s.case, s.percent) for s in savings], SAVING_KEY[0], "%")
    dress(plot)
    return plot


def density_plot(density: Floats, percent: Floats, names: Sequence[str]) -> figure:
    """Return each car's improvement against how many parked cars it met per kilometre."""
    plot = _figure(
        x_label="parked cars met per km", y_label="taken off the mean error (%)", height=320
    )
    source = ColumnDataSource(
        {"x": density.tolist(), "y": percent.tolist(), "name": [str(name) for name in names]}
    )
    dots = plot.scatter("x", "y", source=source, size=8, fill_alpha=0.7)
    coloured(dots.glyph, fill_color=theme.ACCENT, line_color=theme.ACCENT)
    plot.add_tools(
        HoverTool(
            renderers=[dots],
            tooltips=[("car", "@name"), ("cars per km", "@x{0.0}"), ("improvement", "@y{0.0} %")],
        )
    )
    dress(plot)
    return plot


def _figure(
    *, x_label: str, height: int, y_label: str = "", cases: Sequence[str] | None = None
) -> figure:
    rows = DataRange1d() if cases is None else FactorRange(factors=list(cases))
    return figure(
        height=height, sizing_mode="stretch_width", toolbar_location=None, tools=[],
        x_axis_label=x_label, y_axis_label=y_label, min_border_right=18, y_range=rows,
    )  # fmt: skip


def _upright(plot: figure, at: float, dash: str) -> None:
    line = Span(location=at, dimension="height", line_width=1.5, line_dash=dash)
    plot.add_layout(coloured(line, line_color=theme.MUTED))


def _dots(
    plot: figure, values: Sequence[tuple[str, float | None]], entry: KeyEntry, unit: str
) -> None:
    """Draw one dot a case, or an upright tick, with its pop-up."""
    known = [(case, value) for case, value in values if value is not None]
    if not known:
        return
    source = ColumnDataSource({"x": [v for _, v in known], "y": [c for c, _ in known]})
    tick = entry.form == "tick"
    dots = plot.scatter(
        "x", "y", source=source, size=16 if tick else 11, marker="dash" if tick else "circle",
        angle=np.pi / 2 if tick else 0, line_width=2.5 if tick else 1,
    )  # fmt: skip
    coloured(dots.glyph, fill_color=entry.colour, line_color=entry.colour)
    plot.add_tools(
        HoverTool(renderers=[dots], tooltips=[("", "@y"), (entry.label, f"@x{{0.00}} {unit}")])
    )

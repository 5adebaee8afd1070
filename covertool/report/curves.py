"""Coverage against radius or share of equipped cars, as stacked areas in the paper's colours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from covertool.model import Floats
from covertool.model.coverage import LEVEL_LABELS
from covertool.report.figures import LEVEL_1, LEVEL_2, LEVEL_3, TRANSIT

_COLOURS = (LEVEL_3, LEVEL_2, LEVEL_1, TRANSIT)
_LABELS = LEVEL_LABELS[::-1]


@dataclass(frozen=True)
class LevelCurve:
    """One panel of a figure.

    Attributes
    ----------
    title : what was held fixed
    x_label : what varies, with its unit
    x : (N,) its values, rising
    fractions : (N, 4) shares of Levels 0, 1, 2, 3
    """

    title: str
    x_label: str
    x: Floats
    fractions: Floats


def level_curves(curves: Sequence[LevelCurve], *, footnote: str = "") -> Figure:
    """Return a figure with one panel for each curve: Level 3 at the bottom, Level 0 on top.

    The footnote, such as the provenance, is printed below.

    Examples
    --------
    >>> curve = LevelCurve("a road", "radius (m)", np.array([5.0, 9.0]), np.eye(4)[:2])
    >>> len(level_curves([curve]).axes)
    1
    """
    figure = Figure(figsize=(max(5.2 * len(curves), 6.4), 4.2), layout="constrained")
    panels = figure.subplots(1, len(curves), squeeze=False, sharey=True)[0]
    for axes, curve in zip(panels, curves, strict=True):
        stacked = 100 * curve.fractions[:, ::-1].T
        axes.stackplot(curve.x, stacked, colors=_COLOURS, labels=_LABELS, linewidth=0)
        axes.plot(curve.x, stacked[:3].sum(axis=0), "o", color="black", markersize=2.5)
        axes.set(
            title=curve.title,
            xlabel=curve.x_label,
            xlim=_limits(curve.x),
            ylim=(0, 100),
        )
        axes.grid(color="white", alpha=0.35, linewidth=0.6)
    panels[0].set_ylabel("share of the transit area (%)")
    handles, labels = panels[0].get_legend_handles_labels()
    if footnote:
        figure.supxlabel(footnote, fontsize=7, x=0.01, ha="left")
    figure.legend(handles, labels, loc="outside upper center", ncols=4, fontsize=8, frameon=False)
    return figure


def _limits(x: Floats) -> tuple[float, float]:
    low, high = float(np.min(x)), float(np.max(x))
    return (low, high) if high > low else (low - 0.5, high + 0.5)

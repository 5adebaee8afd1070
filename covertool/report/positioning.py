"""Figures of the positioning: the error over time, and what parked cars save by their density."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from covertool.model import CarDensity, Floats, PositionTracks
from covertool.report.positioning_tables import ESTIMATOR_NAMES

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = {
    "traditional": "#d95f02",
    "proposed": "#1b7837",
    "gps": "#7f7f7f",
    "gps_odometry": "#4f81bd",
}
"""One colour for each arm, told apart also by colour-blind readers."""

LABELS = {
    "traditional": "traditional CP",
    "proposed": "proposed CP, with parked cars",
    "gps": "GPS alone",
    "gps_odometry": "GPS and odometry",
}
BAND = (10.0, 90.0)
"""Percentiles of the runs between which the band lies."""

_Case = tuple[str, float | None, float | None]


def error_over_time(tracks: Sequence[PositionTracks], cars: Sequence[str]) -> Figure:
    """Return the error of cars over time: the mean over the runs, and a band of 10 to 90 %.

    One panel for each car, estimator, range noise and zone, one line an arm (the paper's Fig. 8);
    the arms that do not range go into every panel, without their band. Several cars stand side by
    side; of one car alone the range noises do.

    Parameters
    ----------
    tracks : one for each arm, estimator, range noise and zone
    cars : ids of the cars to draw
    """
    cases: list[_Case | None] = list(dict.fromkeys(filter(None, map(_row, tracks))))
    shown = [(car, case) for case in cases or [None] for car in cars]
    columns = len(cars) if len(cars) > 1 else min(len({case and case[1] for _, case in shown}), 3)
    rows = -(-len(shown) // columns)
    figure = Figure(figsize=(max(4.4 * columns, 7.0), 2.0 * rows + 1.2), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    for axes, (car, case) in zip(panels.flat, shown, strict=False):
        for track in tracks:
            if _row(track) in (case, None):
                _draw_error(axes, track, car)
        axes.set_title(f"{car}{_case_text(case)}", loc="left", fontsize=8)
        axes.grid(alpha=0.25, linewidth=0.5)
    for axes in panels[:, 0]:
        axes.set_ylabel("error (m)")
    for axes in panels[-1]:
        axes.set_xlabel("time (s)")
    panels[0][0].set_ylim(bottom=0)
    handles, labels = panels[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=8, frameon=False)
    return figure


def _row(track: PositionTracks) -> _Case | None:
    if track.estimator is None:
        return None
    return track.estimator, track.sigma_range_m, track.radius_m


def _case_text(case: _Case | None) -> str:
    if case is None:
        return ""
    estimator, sigma_m, radius_m = case
    name = ESTIMATOR_NAMES.get(estimator, estimator)
    return f", {name}, range noise {sigma_m:g} m, zone {radius_m:g} m"


def _draw_error(axes: Axes, track: PositionTracks, car: str) -> None:
    time_s, errors_m = errors_by_run(track, car)
    low, high = np.nanpercentile(errors_m, BAND, axis=0)
    colour, ranges = COLOURS[track.arm], track.estimator is not None
    if ranges:
        axes.fill_between(time_s, low, high, color=colour, alpha=0.18, linewidth=0)
    mean_m, width = np.nanmean(errors_m, axis=0), 1.3 if ranges else 0.7
    axes.plot(time_s, mean_m, color=colour, linewidth=width, label=LABELS[track.arm])


def errors_by_run(track: PositionTracks, car: str) -> tuple[Floats, Floats]:
    """Return the times of a car, (N,), and its errors in metres, (runs, N)."""
    mine = np.flatnonzero(track.vehicle == car)
    runs = int(np.unique(track.run[mine]).size)
    return track.time_s[mine].reshape(runs, -1)[0], track.error_m[mine].reshape(runs, -1)


def density_figure(
    densities: Sequence[CarDensity], *, title: str, paper: Sequence[tuple[float, float]] = ()
) -> Figure:
    """Return parked cars met per kilometre against improvement, as in the paper's Table VIII.

    Small dots are layouts; a large one with bars is the mean over them and their standard
    deviation.

    Parameters
    ----------
    densities : one for each car
    title : the headline
    paper : the paper's own points, drawn as hollow diamonds

    Examples
    --------
    >>> density_figure([CarDensity("a", (6,), (2.0,), (9.4,))], title="a town").axes[0].get_xlabel()
    'parked cars met per km'
    """
    figure = Figure(figsize=(7.4, 4.8), layout="constrained")
    axes = figure.add_subplot()
    for number, each in enumerate(densities):
        _draw_density(axes, each, f"C{number % 10}")
    if paper:
        x, y = zip(*paper, strict=True)
        axes.plot(x, y, "D", color="black", fillstyle="none", label="the paper's five cars")
    axes.axhline(0.0, color="black", linewidth=0.6)
    axes.set(xlabel="parked cars met per km", ylabel="improvement of the mean error (%)")
    reach = [density for each in densities for density in each.met_per_km]
    axes.set_xlim(0, 1.08 * max([*reach, *(x for x, _ in paper), 1.0]))
    axes.set_title(title, loc="left", fontsize=10)
    axes.grid(alpha=0.25, linewidth=0.5)
    axes.legend(fontsize=8, frameon=False)
    return figure


def _draw_density(axes: Axes, density: CarDensity, colour: str) -> None:
    x, y = np.array(density.met_per_km), np.array(density.percent)
    if not y.size:
        return
    spread_x = spread_y = None
    if y.size > 1:
        axes.scatter(x, y, s=9, color=colour, alpha=0.45, linewidths=0)
        spread_x, spread_y = float(np.std(x, ddof=1)), float(np.std(y, ddof=1))
    axes.errorbar(
        float(np.mean(x)), float(np.mean(y)), xerr=spread_x, yerr=spread_y, fmt="o",
        color=colour, capsize=3, markersize=7, label=density.vehicle,
    )  # fmt: skip

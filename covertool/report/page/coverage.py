"""The page's part on coverage: by radius, the curve, shares of equipped cars, zones."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from covertool.model import Floats
from covertool.report.page.blocks import Bars, Block, Missing, Plot, Prose, Section, Table
from covertool.report.page.plots import LEVEL_KEY, level_plot
from covertool.report.page.study import ReportStudy, radius_names

if TYPE_CHECKING:
    import pandas as pd

_HEADS = ("Level 0", "Level 1", "Level 2", "Level 3")


def coverage_section(study: ReportStudy) -> Section:
    """Return the tables and plots of coverage that the study holds, and name the others."""
    blocks: list[Block] = [
        Prose(
            (
                "A place of the transit area is at Level 1 when exactly one parked car hears it,"
                " at Level 2 when exactly two do, and at Level 3 when three or more do: three"
                " ranges are what it takes to fix a position in the plane. At Level 0 nobody"
                " hears it. The four levels add up to the transit area.",
            )
        ),
        *_summary(study),
        *_curve(study),
        *_penetration(study),
        *_zones(study),
    ]
    return Section("coverage", "Coverage", tuple(blocks))


def by_radius(frame: pd.DataFrame) -> dict[str, dict[int, pd.Series]]:
    """Return the rows of the summary by the name of their radius and by level."""
    found: dict[str, dict[int, pd.Series]] = {}
    for name, (_, row) in zip(radius_names(frame), frame.iterrows(), strict=True):
        found.setdefault(name, {})[int(row["level"])] = row
    return {name: rows for name, rows in found.items() if set(rows) >= {0, 1, 2, 3}}


def _summary(study: ReportStudy) -> list[Block]:
    """Return the shares of each radius as bars, and as tables in percent and square metres."""
    frame = study.table("coverage_summary")
    if frame is None:
        return [Missing("how much of the transit area each level takes", study.command("coverage"))]
    found = by_radius(_everyone(frame))
    shares = {name: [100 * rows[level]["fraction"] for level in range(4)]
              for name, rows in found.items()}  # fmt: skip
    bars = tuple((name, (s[0], s[1], s[2], s[3])) for name, s in shares.items())
    percent = tuple(
        (name, *(f"{value:.2f}" for value in values), f"{100 - values[0]:.2f}")
        for name, values in shares.items()
    )
    areas = tuple(
        (name, *(f"{rows[level]['area_m2']:,.0f}" for level in range(4)))
        for name, rows in found.items()
    )
    heads = ("Radius", *_HEADS)
    return [
        Bars(bars),
        Table("Share of the transit area at each level, %", (*heads, "Levels 1 to 3"), percent),
        Table("The same in square metres", heads, areas, folded=True),
    ]


def _everyone(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the rows that count all anchors, where others count those of one origin."""
    if "origin" not in frame:
        return frame
    together = frame[frame["origin"].isna()]
    return together if len(together) else frame


def _curve(study: ReportStudy) -> list[Block]:
    """Return coverage against the radius as a plot and a table."""
    frame = study.table("coverage_curve")
    if frame is None:
        return [Missing("coverage against the radius", study.command("curve"))]
    x, percents = _shares(frame, "radius_m", "fraction")
    low, high = percents[0], percents[-1]
    summary = (
        f"From {x[0]:g} m to {x[-1]:g} m, the share that hears at least one parked car goes from"
        f" {100 - low[0]:.1f} % to {100 - high[0]:.1f} %, and the share that hears three or more"
        f" from {low[3]:.1f} % to {high[3]:.1f} %."
    )
    plot = level_plot(x, percents, x_label="radius of every parked car (m)", unit="m")
    return [
        Plot("plot-curve", "Coverage against the radius", summary, plot, LEVEL_KEY),
        _numbers("Coverage against the radius, %", "Radius (m)", x, percents),
    ]


def _penetration(study: ReportStudy) -> list[Block]:
    """Return coverage against the share of equipped cars as a plot and a table, by radius."""
    frame = study.table("coverage_penetration")
    if frame is None:
        what = "coverage when only a share of the cars is equipped"
        return [Missing(what, study.command("penetration"))]
    blocks: list[Block] = []
    names = np.array(radius_names(frame), dtype=object)
    for i, name in enumerate(dict.fromkeys(names)):
        share, percents = _shares(frame[names == name], "share", "expected")
        share = 100 * share
        title = f"When only a share of the cars is equipped, {name}"
        summary = (
            f"With {share[0]:g} % of the cars equipped, {100 - percents[0][0]:.1f} % of the transit"
            f" area is expected to hear at least one; with {share[-1]:g} %,"
            f" {100 - percents[-1][0]:.1f} %."
        )
        plot = level_plot(share, percents, x_label="equipped cars (%)", unit="% of the cars")
        blocks += [
            Plot(f"plot-penetration-{i}", title, summary, plot, LEVEL_KEY),
            _numbers(f"{title}: expected shares, %", "Equipped (%)", share, percents),
        ]
    return blocks


def _zones(study: ReportStudy) -> list[Block]:
    """Return one table of zones for each radius."""
    frame = study.table("coverage_zones")
    if frame is None:
        return [Missing("coverage by zone", study.command("zones"))]
    blocks: list[Block] = []
    names = np.array(radius_names(frame), dtype=object)
    for name in dict.fromkeys(names):
        rows = frame[names == name]
        percents = _wide(rows, "zone", "fraction")
        areas = rows.drop_duplicates("zone").set_index("zone")["transit_area_m2"]
        body = tuple(
            (str(zone), f"{areas[zone]:,.0f}", *(f"{value:.2f}" for value in values))
            for zone, values in percents
        )
        heads = ("Zone", "Transit area (m²)", *(f"{head} (%)" for head in _HEADS))
        blocks.append(Table(f"Coverage by zone, {name}", heads, body))
    return blocks


def _shares(frame: pd.DataFrame, by: str, value: str) -> tuple[Floats, Floats]:
    rows = sorted(_wide(frame, by, value))
    x = np.array([float(at) for at, _ in rows])
    return x, np.array([values for _, values in rows])


def _wide(frame: pd.DataFrame, by: str, value: str) -> list[tuple[Any, list[float]]]:
    """Return (what, percents of Levels 0 to 3) in the table's order."""
    found: dict[Any, list[float]] = {}
    for what, level, share in zip(frame[by], frame["level"], frame[value], strict=True):
        found.setdefault(what, [0.0] * 4)[int(level)] = 100 * float(share)
    return list(found.items())


def _numbers(caption: str, head: str, x: Floats, percents: Floats) -> Table:
    rows = tuple(
        (f"{at:g}", *(f"{value:.2f}" for value in values))
        for at, values in zip(x, percents, strict=True)
    )
    return Table(caption, (head, *_HEADS), rows, folded=True)

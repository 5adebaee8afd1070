"""The page's part on congestion: how much street length stands or crawls, as in Table I."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from covertool.report.page.blocks import Block, Missing, Prose, Section, Table
from covertool.report.page.study import ReportStudy
from covertool.report.parts import LAYER_MENDS

if TYPE_CHECKING:
    import pandas as pd


def congestion_section(study: ReportStudy) -> Section:
    """Return the occupancy table, or the verb that makes it."""
    blocks: list[Block] = []
    cells = study.table("occupancy")
    if cells is None:
        what = "how much street length is congested at rush hour"
        blocks.append(Missing(what, study.command("congestion")))
    else:
        blocks += [
            Prose(
                (
                    "Flagged is the length of the streets whose traffic is reported as slow or"
                    " standing. Filled is the length that the queued cars themselves take up. The"
                    " second is several times less: slow traffic is not stationary traffic.",
                )
            ),
            _table(cells, study.table("occupancy_means")),
        ]
    if "congestion" not in study.layers:
        command = study.named(LAYER_MENDS["congestion"])
        blocks.append(Missing("the streets coloured by congestion at one rush hour", command))
    return Section("congestion", "Congestion", tuple(blocks))


def _table(cells: pd.DataFrame, means: pd.DataFrame | None) -> Table:
    windows = list(dict.fromkeys(cells["window"]))
    rows = _rows(cells, "day", windows)
    if means is not None:
        rows += [(f"{row[0]} mean", *row[1:]) for row in _rows(means, "group", windows)]
    heads = [f"{w}: {what}" for w in windows for what in ("flagged %", "filled %")]
    days = ""
    if "days" in cells:
        counts = sorted({int(count) for count in cells["days"]})
        days = f"Each cell is the mean of {' to '.join(map(str, {counts[0]: 0, counts[-1]: 0}))} "
        days += "day." if counts[-1] == 1 else "days."
    return Table("Share of the street length, %", ("Day", *heads), tuple(rows), note=days)


def _rows(frame: pd.DataFrame, by: str, windows: list[Any]) -> list[tuple[str, ...]]:
    found = {(row[by], row["window"]): row for _, row in frame.iterrows()}
    rows = []
    for day in dict.fromkeys(frame[by]):
        texts = [str(day)]
        for window in windows:
            row = found.get((day, window))
            texts += [_percent(row, "percent"), _percent(row, "filled_percent")]
        rows.append(tuple(texts))
    return rows


def _percent(row: pd.Series | None, name: str) -> str:
    value = None if row is None else row.get(name)
    return "–" if value is None or value != value else f"{value:.2f}"

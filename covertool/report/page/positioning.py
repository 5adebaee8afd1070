"""The page's part on positioning: errors with and without parked cars, bounds, improvements."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from covertool.report.page.blocks import Block, Missing, Plot, Prose, Section, Table
from covertool.report.page.plots import (
    ERROR_KEY,
    SAVING_KEY,
    ArmPair,
    Saving,
    density_plot,
    error_plot,
    line_key,
    saving_plot,
)
from covertool.report.page.study import ReportStudy
from covertool.report.positioning_tables import ESTIMATOR_NAMES

if TYPE_CHECKING:
    import pandas as pd

ARMS = {
    "gps": "GPS alone",
    "gps_odometry": "GPS and odometry",
    "traditional": "without parked cars",
    "proposed": "with parked cars",
}
_ERRORS = (
    ("mean_error_m", "Mean"),
    ("sd_error_m", "SD"),
    ("rmse_m", "RMSE"),
    ("median_error_m", "Median"),
    ("p95_error_m", "95th percentile"),
    ("bound_rmse_m", "Lower bound (RMSE)"),
)


def positioning_section(study: ReportStudy) -> Section:
    """Return the tables and plots of the simulation that the study holds."""
    command = study.command("positioning")
    blocks: list[Block] = []
    results = study.table("positioning")
    if results is None:
        blocks.append(Missing("how many metres of error parked cars take off", command))
    else:
        blocks += _errors(results)
    improvements = study.table("improvements")
    if improvements is not None:
        blocks += _savings(improvements)
    elif results is not None:
        blocks.append(Missing("the improvement that parked cars bring", command))
    met = study.table("parked_met")
    if met is not None:
        blocks += _densities(met)
    if "trajectories" not in study.layers:
        blocks.append(Missing("the tracks of moving cars on the map", command))
    return Section("positioning", "Positioning", tuple(blocks))


def _errors(frame: pd.DataFrame) -> list[Block]:
    """Return the errors of each case as a plot and as a table."""
    together = _of_all(frame)
    pairs, lines = _pairs(together), _lines(together)
    rows = tuple(
        (ARMS.get(str(row["arm"]), str(row["arm"])), _case(row),
         *(_metres(row.get(name)) for name, _ in _ERRORS))
        for _, row in together.iterrows()
    )  # fmt: skip
    heads = ("Arm", "Case", *(head for _, head in _ERRORS))
    blocks: list[Block] = [
        Prose(
            (
                "Each moving car is positioned with and without the help of parked cars, over the"
                " same traffic and with the same noise. GPS alone and GPS with odometry are what a"
                " car has anyway. The lower bound is the posterior Cramér-Rao bound: no unbiased"
                " estimator does better with these measurements.",
            )
        )
    ]
    if pairs:
        plot = error_plot(pairs, lines)
        bounded = any(pair.bound_m is not None for pair in pairs)
        key = (*(ERROR_KEY if bounded else ERROR_KEY[:2]), *line_key(lines))
        blocks.append(Plot("plot-errors", "Mean error", _told(pairs, lines), plot, key))
    blocks.append(Table("Position error over all cars, m", heads, rows, words=2))
    return blocks


def _pairs(frame: pd.DataFrame) -> list[ArmPair]:
    cases: dict[str, dict[str, pd.Series]] = {}
    for _, row in frame.iterrows():
        if row["arm"] in ("traditional", "proposed"):
            cases.setdefault(_case(row), {})[str(row["arm"])] = row
    pairs = []
    for case, arms in cases.items():
        mean = {arm: _number(row.get("mean_error_m")) for arm, row in arms.items()}
        bound = _number(arms["proposed"].get("bound_rmse_m")) if "proposed" in arms else None
        pairs.append(ArmPair(case, mean.get("traditional"), mean.get("proposed"), bound))
    return pairs


def _lines(frame: pd.DataFrame) -> list[tuple[str, float]]:
    found = []
    for arm in ("gps", "gps_odometry"):
        rows = frame[frame["arm"] == arm]
        value = _number(rows["mean_error_m"].iloc[0]) if len(rows) else None
        if value is not None:
            found.append((ARMS[arm], value))
    return found


def _told(pairs: list[ArmPair], lines: list[tuple[str, float]]) -> str:
    """Return what the plot says: the spread of each arm and the largest difference."""
    whole = [(p.case, p.traditional_m, p.proposed_m) for p in pairs
             if p.traditional_m is not None and p.proposed_m is not None]  # fmt: skip
    parts: list[str] = []
    if whole:
        parts.append(f"Without parked cars: {_span([one[1] for one in whole])}")
        parts.append(f"with them: {_span([one[2] for one in whole])}")
    if len(whole) > 1:
        case, without, with_them = max(whole, key=lambda one: one[1] - one[2])
        parts.append(f"largest difference: {without:.2f} m to {with_them:.2f} m ({case})")
    parts += [f"{name}: {at:.2f} m" for name, at in lines]
    return f"{'; '.join(parts)}."


def _span(values: list[float]) -> str:
    low, high = min(values), max(values)
    return f"{low:.2f} m" if low == high else f"{low:.2f} to {high:.2f} m"


def _savings(frame: pd.DataFrame) -> list[Block]:
    """Return the improvement of each case as a plot and as a table."""
    together = _of_all(frame)
    known = [
        Saving(_case(row), percent, _number(row.get("ci95_low")), _number(row.get("ci95_high")))
        for _, row in together.iterrows()
        if (percent := _number(row.get("percent"))) is not None
    ]
    known = list({saving.case: saving for saving in known}.values())
    blocks: list[Block] = []
    if known:
        best, least = max(known, key=_by_percent), min(known, key=_by_percent)
        told = f"{_saving(best)}."
        if best is not least:
            told = f"Most: {_saving(best)}. Least: {_saving(least)}."
        title = "What parked cars take off the mean error"
        blocks.append(Plot("plot-savings", title, told, saving_plot(known), SAVING_KEY))
    rows = tuple((_case(row), *_saving_cells(row)) for _, row in together.iterrows())
    heads = ("Case", "Improvement (%)", "95 % from", "95 % to")
    blocks.append(Table("Improvement of the mean error, over all cars", heads, rows))
    return blocks


def _densities(frame: pd.DataFrame) -> list[Block]:
    """Return each reported car's improvement against the parked cars that it met, by layout."""
    rows = frame[frame["met_per_km"].notna() & frame["percent"].notna()]
    if not len(rows):
        return []
    x, y = rows["met_per_km"].to_numpy(dtype=float), rows["percent"].to_numpy(dtype=float)
    told = (
        f"{rows['vehicle'].nunique()} cars, a dot for each layout of parked cars, mean over the"
        f" cases. They met {x.min():.1f} to {x.max():.1f} parked cars per km; that took"
        f" {y.min():.1f} to {y.max():.1f} % off their mean error."
    )
    names = [
        f"{car}, layout {layout}"
        for car, layout in zip(rows["vehicle"], rows["scenario"], strict=True)
    ]
    plot = density_plot(x, y, names)
    return [Plot("plot-density", "Parked cars met and what they save", told, plot)]


def _by_percent(saving: Saving) -> float:
    return saving.percent


def _saving(saving: Saving) -> str:
    interval = ""
    if saving.low is not None and saving.high is not None:
        interval = f", 95 % interval {saving.low:.1f} to {saving.high:.1f} %"
    return f"{saving.percent:.1f} % ({saving.case}{interval})"


def _saving_cells(row: pd.Series) -> tuple[str, ...]:
    return tuple(_metres(row.get(name)) for name in ("percent", "ci95_low", "ci95_high"))


def _of_all(frame: pd.DataFrame) -> pd.DataFrame:
    return frame[frame["vehicle"] == "all"] if "vehicle" in frame else frame


def _case(row: pd.Series) -> str:
    """Return the estimator, zone and range noise of a row."""
    parts = []
    estimator, preset = row.get("estimator"), row.get("preset")
    if isinstance(estimator, str):
        parts.append(ESTIMATOR_NAMES.get(estimator, estimator))
    if isinstance(preset, str) and preset != "paper":
        parts.append(preset)
    radius, sigma = _number(row.get("radius_m")), _number(row.get("sigma_range_m"))
    if radius is not None:
        parts.append(f"{radius:g} m")
    if sigma is not None:
        parts.append(f"σ {sigma:g} m")
    return ", ".join(parts) or "–"


def _number(value: Any) -> float | None:
    return None if value is None or value != value else float(value)


def _metres(value: Any) -> str:
    number = _number(value)
    return "–" if number is None else f"{number:.2f}"

"""Every table of the paper beside ours, and what differs in the set-up."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from covertool.dsrc import DEVICE_CLASSES, battery_hours
from covertool.model import CoverageReport, OccupancyTable
from covertool.paper.comparison import CALIBRATED, Comparison, over_layouts
from covertool.paper.congestion import TABLE_1_MEANS, table_1
from covertool.paper.scenarios import LayoutResult
from covertool.paper.tables import (
    BATTERY,
    TABLE_2,
    TABLE_4_PERCENT,
    TABLE_5,
    TABLE_6,
    TABLE_7,
    TABLE_8,
    PaperErrors,
)
from covertool.report.positioning_tables import ESTIMATOR_NAMES

TABLES = (1, 2, 4, 5, 6, 7, 8)
ROMAN = {1: "I", 2: "II", 4: "IV", 5: "V", 6: "VI", 7: "VII", 8: "VIII"}
SCENARIO_OF = {5: "campus", 6: "town", 7: "town", 8: "town"}

DIFFERENCES: Mapping[int, tuple[str, ...]] = {
    1: (
        "The survey's raw data is not public: the means are taken anew from the paper's cells, "
        "and the sample town's own week is synthetic.",
        "Monday stands for two days in the paper (16 and 23 June 2014); we average over cells.",
    ),
    2: ("Device classes are copied; the battery budget is computed from the paper's inputs.",),
    4: (
        "The town is synthetic and its parking was set so that it comes near this table: "
        "agreement is calibrated and no evidence.",
    ),
    5: (
        "The circuit is a ring of the synthetic town, not the campus; a dozen cars drive round.",
        "The paper reports one target car that it does not name; ours is the mean over all cars.",
    ),
    6: (
        "The town is synthetic, with its own circuit, signals and parked cars along the circuit.",
        "The paper's five cars are not known; ours are those with the longest ways, put in the "
        "order of the parked cars that they met, as the paper's are.",
    ),
    7: ("As Table VI.",),
    8: (
        "As Table VI. In the paper's town a car met 2.57 to 30.05 parked cars per km; how many "
        "stand along the ways of ours follows from the synthetic town.",
    ),
}
"""What differs in the set-up, table by table."""

OPEN_POINTS = (
    "Open points are read by the preset paper: previous estimate + Ts v in the cost; "
    "R_j = sigma_R^2 + u' P_j u; neighbours share their GPS fix; v(t-1) with 0.5 m/s of noise; "
    "6 m of white GPS noise per axis; a GPS reset every 1 s (campus) or 10 s (town); a moving car "
    "that used 3 anchors is a pseudo-anchor; a car halted for 5 s is a stationary one.",
    "A seed (1, 2, ...) draws the traffic, the places of the parked cars along their streets, and "
    "the noise; seeds were fixed before looking and none is left out.",
    "No default was moved to come nearer to the paper.",
)


def compare(
    numbers: Sequence[int],
    found: Mapping[str, Sequence[LayoutResult]],
    congestion: Callable[[], OccupancyTable],
    coverage: Callable[[], CoverageReport],
    *,
    paper: bool = True,
    best: bool = True,
) -> list[Comparison]:
    """Return the rows of the paper's tables beside ours.

    Parameters
    ----------
    numbers : of ``TABLES``
    found : the layouts of each scenario that a table needs; see ``SCENARIO_OF``
    congestion, coverage : compute the sample town's week and its levels, where a table needs them
    paper, best : with the estimators that run as the paper does, and with second_order
    """
    rows: list[Comparison] = []
    for number in numbers:
        if number == 1:
            rows += compare_table_1(congestion())
        elif number == 2:
            rows += compare_table_2()
        elif number == 4:
            rows += compare_table_4(coverage())
        elif number == 8:
            rows += compare_table_8(found[SCENARIO_OF[number]], paper=paper, best=best)
        else:
            results = found[SCENARIO_OF[number]]
            rows += compare_errors(number, results, paper=paper, best=best)
    return rows


def compare_table_1(sample: OccupancyTable | None) -> list[Comparison]:
    """Return the printed means of Table I beside those of its cells, and of the sample's week."""
    ours = {(mean.group, mean.window): float(mean.text) for mean in table_1().means if mean.text}
    rows = [
        Comparison(1, f"{group}, {window}", "mean of the paper's cells, %", float(printed),
                   ours[group, window])
        for (group, window), printed in TABLE_1_MEANS.items()
    ]  # fmt: skip
    if sample is not None:
        found = {(mean.group, mean.window): mean.percent for mean in sample.means}
        rows += [
            Comparison(1, f"{group}, {window}", "sample town's week, %", float(printed),
                       found.get((group, window)), note="synthetic")
            for (group, window), printed in TABLE_1_MEANS.items()
        ]  # fmt: skip
    return rows


def compare_table_2() -> list[Comparison]:
    """Return the device classes and the battery figure of section II-1."""
    rows = []
    for name, (power_dbm, radius_m) in TABLE_2.items():
        ours = DEVICE_CLASSES[name]
        rows += [
            Comparison(2, f"class {name}", "power, dBm", power_dbm, ours.max_power_dbm),
            Comparison(2, f"class {name}", "zone, m", radius_m, ours.radius_m),
        ]
    hours = battery_hours(BATTERY.capacity_wh, BATTERY.share, BATTERY.load_w)
    return [*rows, Comparison(2, "battery (section II-1)", "hours", BATTERY.hours, hours)]


def compare_table_4(report: CoverageReport) -> list[Comparison]:
    """Return the levels of Table IV beside those of the sample town at 15 and 100 m."""
    rows = []
    for result in report.results:
        printed = TABLE_4_PERCENT[float(result.radius_m or 0.0)]
        for level, (paper, share) in enumerate(zip(printed, result.fractions, strict=True)):
            row = f"{result.radius_m:g} m, Level {level}"
            rows.append(Comparison(4, row, "area, %", paper, 100 * share, note=CALIBRATED))
    return rows


def compare_errors(
    table: int, results: Sequence[LayoutResult], *, paper: bool = True, best: bool = True
) -> list[Comparison]:
    """Return the rows of Table V, VI or VII beside ours, over the layouts."""
    rows = []
    for printed in {5: TABLE_5, 6: TABLE_6, 7: TABLE_7}[table]:
        name = _row_name(printed)
        case = (printed.sigma_range_m, printed.radius_m, printed.car)
        ours = [r.errors.get((printed.estimator, *case)) for r in results] if paper else []
        other = [r.errors.get(("second_order", *case)) for r in results] if best else []
        for quantity, value, part in _quantities(printed):
            figures = [[part(e) if e else None for e in some] for some in (ours, other)]
            rows.append(
                over_layouts(table, name, quantity, value, *figures, signed=quantity == PERCENT)
            )
    return rows


PERCENT = "improvement, %"
_Part = Callable[..., float | None]


def _quantities(printed: PaperErrors) -> list[tuple[str, float, _Part]]:
    return [
        ("traditional mean, m", printed.traditional_m[0], lambda e: e.traditional_m[0]),
        ("traditional SD, m", printed.traditional_m[1], lambda e: e.traditional_m[1]),
        ("proposed mean, m", printed.proposed_m[0], lambda e: e.proposed_m[0]),
        ("proposed SD, m", printed.proposed_m[1], lambda e: e.proposed_m[1]),
        (PERCENT, printed.percent, lambda e: e.percent),
    ]


def _row_name(printed: PaperErrors) -> str:
    car = f", car {printed.car}" if printed.car else ""
    zone = f"{printed.radius_m:g} m zone, " if not printed.car else ""
    return f"{zone}{ESTIMATOR_NAMES[printed.estimator]}, noise {printed.sigma_range_m:g} m{car}"


def compare_table_8(
    results: Sequence[LayoutResult], *, paper: bool = True, best: bool = True
) -> list[Comparison]:
    """Return the rows of Table VIII beside ours, over the layouts."""
    rows = []
    for printed in TABLE_8:
        name, car = f"car {printed.car}", printed.car
        met = [result.met.get(car) for result in results]
        ratio = [m.parked / m.path_km if m and m.path_km > 0 else None for m in met]
        ours = [_mean(result, car, ("gcpso", "ekf")) for result in results] if paper else []
        other = [_mean(result, car, ("second_order",)) for result in results] if best else []
        parked = [float(m.parked) if m else None for m in met]
        ways_km = [m.path_km if m else None for m in met]
        rows += [
            over_layouts(8, name, "parked cars met", printed.parked_met, parked),
            over_layouts(8, name, "way, km", printed.path_km, ways_km),
            over_layouts(8, name, "met per km", printed.met_per_km, ratio),
            over_layouts(8, name, PERCENT, printed.percent, ours, other, signed=True),
        ]
    return rows


def _mean(result: LayoutResult, car: int, estimators: Sequence[str]) -> float | None:
    """Return the mean improvement of a car over estimators and range noises."""
    found = [
        errors.percent
        for (estimator, _, _, number), errors in result.errors.items()
        if estimator in estimators and number == car
    ]
    values = [value for value in found if value is not None]
    return sum(values) / len(values) if values and len(values) == len(found) else None

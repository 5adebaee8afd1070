"""What the page must not let its reader believe."""

from __future__ import annotations

from covertool.report.page.blocks import Prose, Section
from covertool.report.page.study import ReportStudy


def limits_section(study: ReportStudy) -> Section:
    """Return the limits of what the page shows."""
    told = [
        "Radio is modelled as a disc: a parked car is heard anywhere within its radius and nowhere"
        " beyond. Walls, other cars, terrain and weather are left out, so real coverage is patchy"
        " where the map is smooth. Read the levels as what geometry allows.",
        "Every parked car counts as equipped, switched on and sure of its own place, unless a table"
        " says that only a share of the cars is equipped.",
        "Parked cars are those of one moment. At night, on Sundays or after a change of parking"
        " rules there are others.",
    ]
    if study.table("coverage_summary") is not None:
        told.append(
            "Each area that covertool computes comes with a closure residual, a certificate that"
            " no boundary was lost, doubled or moved on the way. It says nothing about whether the"
            " streets and the parked cars are where the study has them."
        )
    if study.table("positioning") is not None:
        told.append(
            "Position errors come from a simulation with the stated noise. Where GPS errors are"
            " independent from second to second, a car that filters GPS with its odometry can do"
            " better than either arm; compare that row. How cars happen to be parked can matter"
            " more than the noise, which the intervals show only when several layouts were run."
        )
    if study.table("occupancy") is not None:
        told.append(
            "Congestion is what the feed reports, on the streets that it reports on. The set of"
            " statuses that count as occupied decides the figures."
        )
    return Section("limits", "Limits", (Prose(tuple(told)),))

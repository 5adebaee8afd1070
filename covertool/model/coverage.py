"""Coverage levels of a transit area."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import pandas as pd

LEVELS = (0, 1, 2, 3)
"""Level 0 hears no stationary car, 1 exactly one, 2 exactly two, 3 three or more."""

LEVEL_LABELS = ("Level 0: none", "Level 1: one", "Level 2: two", "Level 3: three or more")
"""What legends and tables call them."""


@dataclass(frozen=True)
class RadiusCoverage:
    """The coverage of the transit area for one radius, one class, or a mix of radii.

    Attributes
    ----------
    radius_m : metres, or None when anchors of several radii are mixed
    device_class : A-D, or None
    origin : the anchors' origin when reported apart, or None for all together
    anchors : anchors used
    areas_m2 : areas of Levels 0, 1, 2, 3 in square metres; they sum to the transit area
    closure_m : greatest length of a level boundary's chord sum, which is zero for closed curves

    Examples
    --------
    >>> RadiusCoverage(15.0, "A", None, 2, (50.0, 40.0, 10.0, 0.0), 0.0).fractions
    (0.5, 0.4, 0.1, 0.0)
    """

    radius_m: float | None
    device_class: str | None
    origin: str | None
    anchors: int
    areas_m2: tuple[float, float, float, float]
    closure_m: float

    @property
    def fractions(self) -> tuple[float, float, float, float]:
        """Areas over their sum; NaN when the transit area is zero."""
        total = sum(self.areas_m2)
        if total <= 0:
            return (np.nan, np.nan, np.nan, np.nan)
        none, one, two, three = (area / total for area in self.areas_m2)
        return (none, one, two, three)


@dataclass(frozen=True)
class CoverageReport:
    """Coverage Levels 0-3 of a transit area, one entry for each radius asked for.

    Attributes
    ----------
    transit_area_m2 : in square metres
    anchors : how many there are
    results : one for each radius, and for each origin where there are several

    Examples
    --------
    >>> found = RadiusCoverage(15.0, "A", None, 2, (50.0, 40.0, 10.0, 0.0), 0.0)
    >>> CoverageReport(100.0, 2, (found,)).to_frame()["fraction"].tolist()
    [0.5, 0.4, 0.1, 0.0]
    """

    transit_area_m2: float
    anchors: int
    results: tuple[RadiusCoverage, ...]

    def to_frame(self) -> pd.DataFrame:
        """Return one row for each radius and level."""
        import pandas as pd

        return pd.DataFrame(
            [
                {
                    "device_class": result.device_class,
                    "radius_m": result.radius_m,
                    "origin": result.origin,
                    "anchors": result.anchors,
                    "level": level,
                    "area_m2": result.areas_m2[level],
                    "fraction": result.fractions[level],
                }
                for result in self.results
                for level in LEVELS
            ]
        )

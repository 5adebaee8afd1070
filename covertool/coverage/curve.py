"""Levels against the radius: exact at every node, with the slope there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from covertool.coverage.areas import level_areas
from covertool.coverage.radii import check_anchors
from covertool.errors import OptionError
from covertool.model import LEVELS, Anchors, Floats, TransitArea

if TYPE_CHECKING:
    import pandas as pd

_MEND = "write START:STOP:COUNT in metres, such as 5:200:40"


@dataclass(frozen=True)
class CoverageCurve:
    """Fractions of Levels 0 to 3 against the radius.

    Attributes
    ----------
    radius_m : (K,) radii in metres
    fractions : (K, 4) fractions of Levels 0 to 3
    slopes : (K, 4) their derivatives by the radius, per metre
    closure_m : greatest closure of the level boundaries over all radii
    """

    radius_m: Floats
    fractions: Floats
    slopes: Floats
    closure_m: float

    def to_frame(self) -> pd.DataFrame:
        """Return one row for each radius and level."""
        import pandas as pd

        return pd.DataFrame(
            {
                "radius_m": np.repeat(self.radius_m, len(LEVELS)),
                "level": np.tile(LEVELS, self.radius_m.size),
                "fraction": self.fractions.ravel(),
                "slope_per_m": self.slopes.ravel(),
            }
        )


def parse_radii(text: str) -> Floats:
    """Return the radii that ``START:STOP:COUNT`` names, evenly spaced, both ends included.

    Raises
    ------
    OptionError
        When the text has another form or names radii that are not positive and rising.

    Examples
    --------
    >>> parse_radii("5:15:3").tolist()
    [5.0, 10.0, 15.0]
    """
    try:
        start, stop, count = (cast(part) for cast, part in zip(
            (float, float, int), text.split(":"), strict=True))  # fmt: skip
    except ValueError:
        raise OptionError(f"a curve cannot be read from {text!r}", "curve", _MEND) from None
    if not (0 < start < stop < np.inf and count >= 2) and not (0 < start == stop and count == 1):
        raise OptionError(f"the radii of the curve {text!r} do not rise", "curve", _MEND)
    return np.linspace(start, stop, count)


def coverage_curve(
    anchors: Anchors, transit: TransitArea, radii_m: Sequence[float] | npt.ArrayLike
) -> CoverageCurve:
    """Return the exact fractions of Levels 0 to 3 for every radius, and their slopes.

    ``dA_k / dr`` is the length, inside the transit area, of the arcs that bound the places heard
    by at least k anchors; the slope of exactly k is the difference of two of them.

    Parameters
    ----------
    anchors, transit : in the same projected CRS
    radii_m : (K,) radii in metres

    Raises
    ------
    OptionError, GeometryError, CrsError
        When a radius, a coordinate or the CRS cannot be used.

    Examples
    --------
    >>> import shapely
    >>> from pyproj import CRS
    >>> square = TransitArea(shapely.MultiPolygon([shapely.box(0, 0, 10, 10)]), CRS(2157))
    >>> curve = coverage_curve(Anchors.from_points([5.0], [5.0], CRS(2157)), square, [2.0, 3.0])
    >>> print(curve.slopes[:, 1].round(6))
    [0.125664 0.188496]
    """
    check_anchors(anchors, transit)
    radii = np.asarray(radii_m, dtype=float).ravel()
    if not np.all(np.isfinite(radii) & (radii > 0)):
        raise OptionError("a radius of the curve is not positive", "curve", _MEND)
    found = [level_areas(anchors.x_m, anchors.y_m, r, transit.polygons) for r in radii]
    nodes = [(*node.areas_m2, *node.boundary_m, node.closure_m) for node in found]
    return curve_of(radii, np.array(nodes).reshape(-1, 8), transit.area_m2)


def curve_of(radii_m: Floats, nodes: Floats, transit_area_m2: float) -> CoverageCurve:
    """Return a curve for what `level_areas` found at its nodes.

    Parameters
    ----------
    radii_m : (K,) radii in metres
    nodes : (K, 8) areas of four levels, lengths of three levels' arcs, and the closure
    transit_area_m2 : area of the transit area
    """
    total = transit_area_m2 if transit_area_m2 > 0 else np.nan
    areas, growth, closure = nodes[:, :4], nodes[:, 4:7], nodes[:, 7]
    # Level 0 shrinks as level >= 1 grows; Level 3 is level >= 3.
    bounds = np.column_stack([np.zeros(len(nodes)), growth, np.zeros(len(nodes))])
    slopes = bounds[:, :-1] - bounds[:, 1:]
    return CoverageCurve(radii_m, areas / total, slopes / total, float(closure.max(initial=0.0)))

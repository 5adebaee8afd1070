"""What remains of the coverage when only a share of the parked cars is equipped."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import xlog1py, xlogy

from covertool.coverage.radii import Radius, check_anchors, radii_of
from covertool.coverage.scanlines import DepthProfile, depth_profile
from covertool.errors import OptionError
from covertool.model import Anchors, Floats, TransitArea


@dataclass(frozen=True)
class PenetrationPoint:
    """Expected coverage at one share of equipped cars and one radius.

    Attributes
    ----------
    share : probability with which each parked car is equipped, independently of the others
    radius_m : metres, or None when anchors of several radii are mixed
    device_class : A-D, or None
    expected : expected fractions of Levels 0, 1, 2, 3
    se : standard error of ``expected``: that of sampling the transit area by lines. It is not
        the spread of a single town's fractions, which depend on which cars are equipped.
    """

    share: float
    radius_m: float | None
    device_class: str | None
    expected: tuple[float, float, float, float]
    se: tuple[float, float, float, float]


def penetration(
    anchors: Anchors,
    transit: TransitArea,
    radii: Sequence[Radius],
    shares: Sequence[float],
    *,
    row_m: float = 0.5,
) -> tuple[PenetrationPoint, ...]:
    """Return the expected fractions of Levels 0 to 3 for shares of equipped cars.

    Where n anchors hear a place, the number k of equipped ones is binomial:
    ``P(k) = C(n, k) p^k (1 - p)^(n - k)``. Summed over the transit area by n, that is the
    expectation of every level.

    Parameters
    ----------
    anchors, transit : in the same projected CRS
    radii : metres, device classes, or None for each anchor's own
    shares : probabilities in [0, 1]
    row_m : height of the rows of lines on which depths are measured, in metres

    Raises
    ------
    OptionError
        When a share lies outside 0 to 1.

    Examples
    --------
    >>> import shapely
    >>> from pyproj import CRS
    >>> square = TransitArea(shapely.MultiPolygon([shapely.box(0, 0, 10, 10)]), CRS(2157))
    >>> two = Anchors.from_points([5.0, 5.0], [5.0, 5.0], CRS(2157))
    >>> point = penetration(two, square, [100.0], [0.5])[0]
    >>> [round(value, 6) for value in point.expected]
    [0.25, 0.5, 0.25, 0.0]
    """
    check_anchors(anchors, transit)
    check_shares(shares)
    points: list[PenetrationPoint] = []
    for radius in radii:
        named = radii_of(anchors, radius)
        profile = depth_profile(
            anchors.x_m, anchors.y_m, named.each_m, transit.polygons, row_m=row_m
        )
        points += points_of(profile, shares, named.radius_m, named.device_class)
    return tuple(points)


def check_shares(shares: Sequence[float]) -> None:
    """Raise OptionError when a share lies outside 0 to 1."""
    for share in shares:
        if not 0 <= share <= 1:
            raise OptionError(
                f"a share of {share:g} is not possible", "--penetration", "use shares from 0 to 1"
            )


def points_of(
    profile: DepthProfile, shares: Sequence[float], radius_m: float | None, device_class: str | None
) -> list[PenetrationPoint]:
    """Return the expectation for each share where the area at every depth is known."""
    points = []
    for share in shares:
        expected, error = profile.expect(level_chances(len(profile.fractions), share))
        points.append(
            PenetrationPoint(share, radius_m, device_class, _four(expected), _four(error))
        )
    return points


def joined(profiles: Sequence[DepthProfile], areas_m2: Sequence[float]) -> DepthProfile:
    """Return the profile of areas put together, each weighted by its size.

    Examples
    --------
    >>> heard = DepthProfile(np.array([0.0, 1.0]), np.array([[0.0, 1.0]] * 3))
    >>> unheard = DepthProfile(np.array([1.0]), np.array([[1.0]] * 3))
    >>> joined([heard, unheard], [1.0, 3.0]).fractions.tolist()
    [0.75, 0.25]
    """
    deepest = max(len(profile.fractions) for profile in profiles)
    fractions, replicates = np.zeros(deepest), np.zeros((len(profiles[0].replicates), deepest))
    for profile, area in zip(profiles, areas_m2, strict=True):
        depths = len(profile.fractions)
        fractions[:depths] += area * profile.fractions
        replicates[:, :depths] += area * profile.replicates
    total = sum(areas_m2)
    return DepthProfile(fractions / total, replicates / total)


def level_chances(depths: int, share: float) -> Floats:
    """Return (depths, 4): the chance of Levels 0 to 3 where 0, 1, 2, ... anchors are near.

    Examples
    --------
    >>> level_chances(3, 0.5).tolist()
    [[1.0, 0.0, 0.0, 0.0], [0.5, 0.5, 0.0, 0.0], [0.25, 0.5, 0.25, 0.0]]
    """
    n = np.arange(depths, dtype=float)
    chances = np.zeros((depths, 4))
    for level, ways in enumerate((np.ones(depths), n, np.abs(n * (n - 1)) / 2)):
        left = np.maximum(n - level, 0)
        chances[:, level] = ways * np.exp(xlogy(level, share) + xlog1py(left, -share))
    chances[:, 3] = np.maximum(1 - chances[:, :3].sum(axis=1), 0)
    chances[:3, 3] = 0.0
    return chances


def _four(values: Floats) -> tuple[float, float, float, float]:
    none, one, two, three = (float(value) for value in values)
    return (none, one, two, three)

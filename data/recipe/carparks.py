"""Car parks: aisles, cross aisles, the way in, and the bays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from data.recipe.curves import Points, heading_deg, left_of
from data.recipe.skeleton import CarPark, Street

BAY_LENGTH_M = 5.0
BAY_WIDTH_M = 2.5
PITCH_M = 16.2
"""From aisle to aisle: a 6 m aisle, a bay on both sides, and the stop between them."""


@dataclass(frozen=True)
class Bays:
    """Places where a car can stand: centre, heading, site, and the street or lot they belong to."""

    x_m: Points
    y_m: Points
    heading_deg: Points
    site: tuple[str, ...]
    group: tuple[str, ...]

    @classmethod
    def gather(cls, rows: list[tuple[float, float, float, str, str]]) -> Bays:
        """Return bays from rows of (x, y, heading, site, group)."""
        if not rows:
            return cls(np.empty(0), np.empty(0), np.empty(0), (), ())
        x, y, heading, site, group = zip(*rows, strict=True)
        return cls(np.array(x), np.array(y), np.array(heading), site, group)

    def __len__(self) -> int:
        return len(self.site)


def _axes(park: CarPark) -> tuple[Points, Points, Points]:
    angle = np.radians(park.angle_deg)
    along = np.array([np.cos(angle), np.sin(angle)])
    return np.array([park.x_m, park.y_m]), along, left_of(along)


def ground(park: CarPark) -> shapely.Polygon:
    """Return the paved ground of a car park."""
    centre, along, across = _axes(park)
    a = along * (park.length_m / 2 + 3.5)
    b = across * (park.aisles * PITCH_M / 2)
    return shapely.Polygon([centre + a + b, centre + a - b, centre - a - b, centre - a + b])


def aisles(park: CarPark) -> list[Street]:
    """Return the aisles of a car park and the two cross aisles that join them."""
    centre, along, across = _axes(park)
    half = along * park.length_m / 2
    rows = [centre + across * offset for offset in _offsets(park)]
    lines = [np.array([row - half, row + half]) for row in rows]
    if park.aisles > 1:
        lines += [np.array([rows[0] + end, rows[-1] + end]) for end in (half, -half)]
    return [Street(park.name, "aisle", line, "none") for line in lines]


def way_in(park: CarPark, streets: list[Street], blocked: shapely.Geometry) -> Street | None:
    """Return the shortest straight way from an end of an aisle to a street over free land."""
    centre, along, across = _axes(park)
    offsets = _offsets(park)
    ends = [
        centre + sign * along * park.length_m / 2 + across * offset
        for sign in (1, -1)
        for offset in (offsets[0], offsets[-1])
    ]
    xy = np.vstack([street.points for street in streets])
    inside = ground(park).buffer(-1.0)
    best: tuple[float, Points] | None = None
    for end in ends:
        gap = np.hypot(*(xy - end).T)
        for row in np.argsort(gap)[:60]:
            line = shapely.LineString([end, xy[row]])
            crosses = line.intersection(inside).length > 6.0 or line.intersects(blocked)
            if not crosses and (best is None or gap[row] < best[0]):
                best = (float(gap[row]), np.array([end, xy[row]]))
    return None if best is None else Street(f"{park.name} way in", "service", best[1], "none")


def bays(park: CarPark) -> Bays:
    """Return the bays on both sides of every aisle, nose to the aisle's side."""
    centre, along, across = _axes(park)
    count = int((park.length_m - 10.0) // BAY_WIDTH_M)
    rows = []
    for offset in _offsets(park):
        for side in (1.0, -1.0):
            for k in range(count):
                step = (k - (count - 1) / 2) * BAY_WIDTH_M
                place = centre + along * step + across * (offset + side * (3.0 + 2.5))
                heading = heading_deg(side * across)
                rows.append((place[0], place[1], heading, "lot", park.name))
    return Bays.gather(rows)


def _offsets(park: CarPark) -> Points:
    return np.asarray((np.arange(park.aisles) - (park.aisles - 1) / 2) * PITCH_M)

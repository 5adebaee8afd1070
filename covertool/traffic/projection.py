"""Between the coordinates of a SUMO net and metres in a working CRS, by pyproj."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pyproj import CRS

from covertool import crs as crs_door
from covertool.errors import CrsError
from covertool.model import Bounds, Floats


@dataclass(frozen=True)
class Projection:
    """How coordinates of a SUMO net become metres in a working CRS.

    SUMO adds ``offset_m`` to the coordinates of ``source`` to get those of the net. Its own tools
    transform with an old PROJ string; here the coordinates stay in the net's own CRS wherever
    covertool can compute in it.

    Attributes
    ----------
    source : the CRS of the net's own projection
    offset_m : what SUMO added to x and y
    crs : the working CRS of everything that covertool makes of the net

    Examples
    --------
    >>> place = Projection(CRS(2157), (-600000.0, -750000.0), CRS(2157))
    >>> x, y = place.to_crs(np.array([10.0]), np.array([20.0]))
    >>> print(float(x[0]), float(y[0]))
    600010.0 750020.0
    """

    source: CRS
    offset_m: tuple[float, float]
    crs: CRS

    @classmethod
    def of(
        cls, source: CRS, offset_m: tuple[float, float], bounds: Bounds, where: str
    ) -> Projection:
        """Return the projection of a net (or trace) that lies within ``bounds`` of its own.

        Raises
        ------
        CrsError
            For a CRS whose axes do not run east and north.
        """
        refuse_north_first(source, where)
        source = _registered(source)
        dx, dy = offset_m
        there = (bounds[0] - dx, bounds[1] - dy, bounds[2] - dx, bounds[3] - dy)
        return cls(source, offset_m, crs_door.working_crs(source, there))

    def to_crs(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Return coordinates of the net in the working CRS."""
        dx, dy = self.offset_m
        return crs_door.transform(np.asarray(x) - dx, np.asarray(y) - dy, self.source, self.crs)

    def to_net(self, x_m: Floats, y_m: Floats) -> tuple[Floats, Floats]:
        """Return coordinates of the working CRS in those of the net."""
        x, y = crs_door.transform(np.asarray(x_m), np.asarray(y_m), self.crs, self.source)
        return x + self.offset_m[0], y + self.offset_m[1]


def _registered(source: CRS) -> CRS:
    """Return the EPSG system that a PROJ string means, so that data of both share one CRS.

    Only on the ellipsoids whose datums coincide with WGS 84's: a string on another ellipsoid has
    no datum shift where the registered system has one, and SUMO computed with the string.
    """
    code = source.to_authority(min_confidence=70)
    ellipsoid = source.ellipsoid.name if source.ellipsoid is not None else ""
    if code is None or not ("GRS" in ellipsoid or "WGS 84" in ellipsoid):
        return source
    registered = CRS.from_authority(*code)
    return registered if crs_door.is_working(registered) else source


def refuse_north_first(source: CRS, where: str) -> None:
    """Refuse a projected CRS whose coordinates do not grow to the east and to the north."""
    directions = [axis.direction.lower() for axis in source.axis_info[:2]]
    if source.is_projected and directions != ["east", "north"]:
        raise CrsError(
            f"the axes of {crs_door.name(source)} run {' and '.join(directions)}, not east and "
            "north, so that SUMO's x and y would be mistaken",
            where,
            "use a system with east before north, such as the UTM zone of the place",
        )

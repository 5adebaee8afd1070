"""What stands and drives in a town: vehicles, anchors, the transit area, a study of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import shapely
from pyproj import CRS

from covertool.errors import GeometryError
from covertool.model.tables import Floats, Objects, Table, points_frame

if TYPE_CHECKING:
    import geopandas as gpd

SITES = ("on_street", "lot", "off_street", "carriageway")
ORIGINS = ("parked", "queue", "rsu")


@dataclass(frozen=True)
class DeviceClass:
    """A class of DSRC devices: its name, greatest output power and communication zone.

    Attributes
    ----------
    name : A to D
    max_power_dbm : greatest output power in dBm
    radius_m : communication zone in metres
    """

    name: str
    max_power_dbm: float
    radius_m: float


@dataclass(frozen=True)
class Vehicles(Table):
    """Vehicles seen from above, one row each, in a projected CRS in metres.

    Attributes
    ----------
    id : (N,) object array of str
    x_m, y_m : (N,) centre in metres
    heading_deg : (N,) clockwise from grid north; 0-180 when the front is unknown
    length_m, width_m : (N,) size in metres
    score : (N,) confidence, 0 to 1
    site : (N,) object array of one of ``SITES`` or None
    parked : (N,) object array of True, False or None
    image : (N,) object array of str, the image in which the car was seen
    image_x_px, image_y_px : (N,) centre in that image; x right, y down, the corner of the first
        pixel is (0, 0)
    crs : the projected or engineering CRS of the coordinates
    """

    id: Objects
    x_m: Floats
    y_m: Floats
    heading_deg: Floats
    length_m: Floats
    width_m: Floats
    score: Floats
    site: Objects
    parked: Objects
    image: Objects
    image_x_px: Floats
    image_y_px: Floats
    crs: CRS

    def footprints(self) -> Objects:
        """Return each car's oriented rectangle as an (N,) array of polygons.

        >>> car = Vehicles.empty(CRS(2157)).footprints()
        >>> car.shape
        (0,)
        """
        angle = np.radians(self.heading_deg)
        along = np.stack([np.sin(angle), np.cos(angle)], axis=-1) * (self.length_m / 2)[:, None]
        across = np.stack([np.cos(angle), -np.sin(angle)], axis=-1) * (self.width_m / 2)[:, None]
        centre = np.stack([self.x_m, self.y_m], axis=-1)
        corners = [centre + a * along + b * across for a, b in ((1, 1), (1, -1), (-1, -1), (-1, 1))]
        rings = np.stack([*corners, corners[0]], axis=1)
        polygons: Objects = np.asarray(shapely.polygons(rings), dtype=object).reshape(len(self))
        return polygons

    def to_frame(self) -> gpd.GeoDataFrame:
        """Return the vehicles as a GeoDataFrame of oriented rectangles."""
        import geopandas as gpd

        return gpd.GeoDataFrame(self.columns(), geometry=self.footprints(), crs=self.crs)

    @classmethod
    def empty(cls, crs: CRS) -> Vehicles:
        """Return a table without rows."""
        no, nothing = np.empty(0), np.empty(0, dtype=object)
        return cls(nothing, no, no, no, no, no, no, nothing, nothing, nothing, no, no, crs)


@dataclass(frozen=True)
class Anchors(Table):
    """Stationary vehicles and units that know where they are, one row each.

    Attributes
    ----------
    id : (N,) object array of str
    x_m, y_m : (N,) position in metres
    radius_m : (N,) communication radius in metres; NaN where the anchor names none
    device_class : (N,) object array of A, B, C, D or None
    sigma_m : (N,) standard deviation of the anchor's own position in metres; NaN when unknown
    origin : (N,) object array of one of ``ORIGINS``
    crs : the projected or engineering CRS of the coordinates
    """

    id: Objects
    x_m: Floats
    y_m: Floats
    radius_m: Floats
    device_class: Objects
    sigma_m: Floats
    origin: Objects
    crs: CRS

    @classmethod
    def from_points(
        cls, x_m: npt.ArrayLike, y_m: npt.ArrayLike, crs: CRS, *, origin: str = "parked"
    ) -> Anchors:
        """Return anchors at given points, numbered from 1, with no radius of their own.

        >>> len(Anchors.from_points([0.0, 10.0], [0.0, 0.0], CRS(2157)))
        2
        """
        x, y = np.asarray(x_m, dtype=float).ravel(), np.asarray(y_m, dtype=float).ravel()
        count = x.size
        return cls(
            id=np.array([str(i + 1) for i in range(count)], dtype=object),
            x_m=x,
            y_m=y,
            radius_m=np.full(count, np.nan),
            device_class=np.full(count, None, dtype=object),
            sigma_m=np.full(count, np.nan),
            origin=np.full(count, origin, dtype=object),
            crs=crs,
        )

    @classmethod
    def concatenate(cls, parts: list[Anchors]) -> Anchors:
        """Return the rows of several tables, in order, as one; they must share a CRS."""
        first = parts[0]
        if any(part.crs != first.crs for part in parts):
            raise GeometryError(
                "anchors of different CRSs cannot be joined", "anchors", "transform them first"
            )
        return cls(**cls.joined(parts), crs=first.crs)

    def to_frame(self) -> gpd.GeoDataFrame:
        """Return the anchors as a GeoDataFrame of points."""
        return points_frame(self.columns(), self.x_m, self.y_m, self.crs)


@dataclass(frozen=True)
class TransitArea:
    """Where cars drive: valid, disjoint polygons in a projected CRS in metres.

    Attributes
    ----------
    polygons : the parts
    crs : the projected or engineering CRS of the coordinates
    area_m2 : their area

    Raises
    ------
    GeometryError
        When the polygons are not valid or overlap.

    Examples
    --------
    >>> TransitArea(shapely.MultiPolygon([shapely.box(0, 0, 100, 10)]), CRS(2157)).area_m2
    1000.0
    """

    polygons: shapely.MultiPolygon
    crs: CRS
    area_m2: float = field(init=False)

    def __post_init__(self) -> None:
        if not self.polygons.is_valid:
            raise GeometryError(
                f"the transit area is not valid: {shapely.is_valid_reason(self.polygons)}",
                "transit area",
                "repair it with shapely.make_valid and unite it",
            )
        object.__setattr__(self, "area_m2", float(self.polygons.area))

    def to_frame(self) -> gpd.GeoDataFrame:
        """Return the transit area as a GeoDataFrame, one polygon a row."""
        import geopandas as gpd

        parts = list(self.polygons.geoms)
        ids = [str(i + 1) for i in range(len(parts))]
        areas = [float(part.area) for part in parts]
        return gpd.GeoDataFrame({"id": ids, "area_m2": areas}, geometry=parts, crs=self.crs)


@dataclass(frozen=True)
class Study:
    """What one study file holds; a part that it lacks is None.

    Examples
    --------
    >>> Study(Anchors.from_points([0.0], [0.0], CRS(2157)), None).transit is None
    True
    """

    anchors: Anchors | None
    transit: TransitArea | None
    vehicles: Vehicles | None = None

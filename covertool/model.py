"""The values that pass between the rooms: frozen, in metres, in one projected CRS."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from datetime import date
from typing import TYPE_CHECKING, Any, Protocol, Self

import numpy as np
import numpy.typing as npt
import shapely
from pyproj import CRS

from covertool.errors import GeometryError

if TYPE_CHECKING:
    import geopandas as gpd
    import pandas as pd

Floats = npt.NDArray[np.float64]
Objects = npt.NDArray[np.object_]
Bounds = tuple[float, float, float, float]

LEVELS = (0, 1, 2, 3)
"""Level 0 hears no stationary car, 1 exactly one, 2 exactly two, 3 three or more."""

SITES = ("on_street", "lot", "off_street", "carriageway")
ORIGINS = ("parked", "queue", "rsu")


@dataclass(frozen=True)
class DeviceClass:
    """A class of DSRC devices: its name, greatest output power and communication zone."""

    name: str
    max_power_dbm: float
    radius_m: float


class _Table:
    """Columns of equal length held as arrays: length, choice of rows, one check of both."""

    _not_columns: tuple[str, ...] = ("crs",)

    def columns(self) -> dict[str, npt.NDArray[Any]]:
        """Return the columns by name, in the order of the fields."""
        return {
            f.name: getattr(self, f.name)
            for f in fields(self)  # type: ignore[arg-type]
            if f.name not in self._not_columns
        }

    def __post_init__(self) -> None:
        sizes = {name: column.shape for name, column in self.columns().items()}
        if len(set(sizes.values())) > 1 or any(len(shape) != 1 for shape in sizes.values()):
            raise GeometryError(
                "columns differ in length", f"{type(self).__name__}: {sizes}", "pass equal lengths"
            )

    def __len__(self) -> int:
        return int(next(iter(self.columns().values())).size)

    def take(self, rows: npt.ArrayLike) -> Self:
        """Return the chosen rows (a mask or indices) as a new table."""
        chosen = np.asarray(rows)
        picked = {name: column[chosen] for name, column in self.columns().items()}
        return replace(self, **picked)  # type: ignore[type-var]


def _points_frame(
    columns: dict[str, npt.NDArray[Any]], x_m: Floats, y_m: Floats, crs: CRS
) -> gpd.GeoDataFrame:
    import geopandas as gpd

    return gpd.GeoDataFrame(columns, geometry=shapely.points(x_m, y_m), crs=crs)


@dataclass(frozen=True)
class Vehicles(_Table):
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
class Anchors(_Table):
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
        joined = {
            name: np.concatenate([part.columns()[name] for part in parts])
            for name in first.columns()
        }
        return cls(**joined, crs=first.crs)

    def to_frame(self) -> gpd.GeoDataFrame:
        """Return the anchors as a GeoDataFrame of points."""
        return _points_frame(self.columns(), self.x_m, self.y_m, self.crs)


@dataclass(frozen=True)
class TransitArea:
    """Where cars drive: valid, disjoint polygons in a projected CRS in metres."""

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
    """Coverage Levels 0-3 of a transit area, one entry for each radius asked for."""

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


@dataclass(frozen=True)
class Study:
    """What one study file holds; a part that it lacks is None."""

    anchors: Anchors | None
    transit: TransitArea | None
    vehicles: Vehicles | None = None


class AnchorSource(Protocol):
    """Anchors that can be read by bounding box, from a file or from memory; picklable."""

    @property
    def crs(self) -> CRS:
        """CRS of the coordinates."""
        ...

    @property
    def bounds(self) -> Bounds:
        """Least and greatest coordinates: x0, y0, x1, y1."""
        ...

    def read(self, bounds: Bounds | None = None) -> Anchors:
        """Return the anchors inside bounds (x0, y0, x1, y1; closed), or all of them."""
        ...


class RasterSource(Protocol):
    """A raster that can be read window by window; picklable, opened by the reader.

    Pixel coordinates run x to the right and y down; the corner of the first pixel is (0, 0).
    """

    @property
    def name(self) -> str:
        """Name for messages and for the image column."""
        ...

    @property
    def width(self) -> int:
        """Columns."""
        ...

    @property
    def height(self) -> int:
        """Rows."""
        ...

    @property
    def bands(self) -> int:
        """Bands without alpha."""
        ...

    @property
    def crs(self) -> CRS:
        """Working CRS of the metres."""
        ...

    def read(self, x0: int, y0: int, width: int, height: int) -> npt.NDArray[Any]:
        """Return (bands, height, width) of a window; outside the image it is padded with zeros."""
        ...

    def valid(self, x0: int, y0: int, width: int, height: int) -> npt.NDArray[np.bool_]:
        """Return (height, width): True where the pixel holds data (alpha, nodata, inside)."""
        ...

    def to_metres(self, x_px: Floats, y_px: Floats) -> tuple[Floats, Floats]:
        """Return pixel coordinates as metres in ``crs``."""
        ...

    def to_pixels(self, x_m: Floats, y_m: Floats) -> tuple[Floats, Floats]:
        """Return metres in ``crs`` as pixel coordinates."""
        ...

    def gsd_m(self, x_px: float, y_px: float) -> tuple[float, float]:
        """Return the ground size of a pixel along its x and y axis in metres at that place."""
        ...


@dataclass(frozen=True)
class Observations(_Table):
    """What was seen of the traffic on street segments, one row each.

    Attributes
    ----------
    segment_id : (N,) object array of str
    time : (N,) datetime64[us] in UTC, when it was seen, or the start of the interval
    until : (N,) datetime64[us] in UTC, the end of the interval; NaT for a moment
    status : (N,) object array of words of the status scale (free, slow, very_slow, stationary,
        closed, unknown)
    relative_speed : (N,) speed over free-flow speed; NaN when unknown
    speed_mps : (N,) metres per second; NaN when unknown
    queue_m : (N,) measured length of the queue in metres; NaN when unknown
    line : (N,) object array of WGS 84 LineStrings (lon, lat), or None where the source names
        only the segment
    """

    segment_id: Objects
    time: npt.NDArray[np.datetime64]
    until: npt.NDArray[np.datetime64]
    status: Objects
    relative_speed: Floats
    speed_mps: Floats
    queue_m: Floats
    line: Objects

    @classmethod
    def from_columns(
        cls,
        segment_id: npt.ArrayLike,
        time: npt.ArrayLike,
        status: npt.ArrayLike,
        **more: npt.ArrayLike,
    ) -> Observations:
        """Return observations from the columns that are known; the others are filled with gaps.

        >>> len(Observations.from_columns(["a"], ["2014-06-16T12:00"], ["slow"]))
        1
        """
        ids = np.asarray(segment_id, dtype=object)
        gaps: dict[str, Any] = {
            "until": np.full(ids.size, np.datetime64("NaT"), dtype="datetime64[us]"),
            "relative_speed": np.full(ids.size, np.nan),
            "speed_mps": np.full(ids.size, np.nan),
            "queue_m": np.full(ids.size, np.nan),
            "line": np.full(ids.size, None, dtype=object),
        }
        given = {name: np.asarray(column, gaps[name].dtype) for name, column in more.items()}
        times = np.asarray(time, dtype="datetime64[us]")
        return cls(ids, time=times, status=np.asarray(status, dtype=object), **(gaps | given))

    @classmethod
    def concatenate(cls, parts: list[Observations]) -> Observations:
        """Return the rows of several tables, in order, as one."""
        if not parts:
            return cls.from_columns([], [], [])
        names = parts[0].columns()
        return cls(**{n: np.concatenate([part.columns()[n] for part in parts]) for n in names})

    def to_frame(self) -> pd.DataFrame:
        """Return the observations as a table; times are in UTC."""
        import pandas as pd

        frame = pd.DataFrame({n: c for n, c in self.columns().items() if n != "line"})
        frame["time"] = frame["time"].dt.tz_localize("UTC")
        frame["until"] = frame["until"].dt.tz_localize("UTC")
        frame["line"] = shapely.to_wkb(self.line) if len(self) else self.line
        return frame


@dataclass(frozen=True)
class OccupancyCell:
    """One weekday and window: how much street length was flagged and how much queues fill.

    Percentages are of the length known and not closed; None for a blank cell. ``observed_fraction``
    is the share of the length of which anything was known, over the days looked at.
    """

    day: str
    window: str
    percent: float | None
    filled_percent: float | None
    days: int
    observed_fraction: float
    ci95: tuple[float, float] | None = None


@dataclass(frozen=True)
class OccupancyDay:
    """One date and window: percentages are None where too little was observed."""

    date: date
    day: str
    window: str
    percent: float | None
    filled_percent: float | None
    observed_fraction: float


@dataclass(frozen=True)
class OccupancyMean:
    """A mean over a group of cells or days, with ``text`` rounded half up to two decimals."""

    group: str
    window: str
    percent: float | None
    filled_percent: float | None
    count: int
    text: str
    ci95: tuple[float, float] | None = None


@dataclass(frozen=True)
class OccupancyTable:
    """Flagged street length by weekday and window, as in the paper's Table I."""

    cells: tuple[OccupancyCell, ...]
    means: tuple[OccupancyMean, ...]
    days: tuple[OccupancyDay, ...] = ()

    def to_frame(self) -> pd.DataFrame:
        """Return one row for each cell."""
        import pandas as pd

        return pd.DataFrame([vars(cell) for cell in self.cells])


@dataclass(frozen=True)
class Trace(_Table):
    """True positions and velocities of moving cars at equal time steps, one row a car and step.

    Rows come in any order; a car is in the trace from its first to its last row.

    Attributes
    ----------
    time_s : (N,) seconds; whole multiples of ``step_s`` apart
    vehicle : (N,) object array of str
    x_m, y_m : (N,) centre of the car in metres
    vx, vy : (N,) velocity in metres per second at that time
    step_s : seconds between two steps
    """

    time_s: Floats
    vehicle: Objects
    x_m: Floats
    y_m: Floats
    vx: Floats
    vy: Floats
    step_s: float = 1.0

    _not_columns = ("step_s",)

    def to_frame(self) -> pd.DataFrame:
        """Return the trace as a table, one row a car and step."""
        import pandas as pd

        return pd.DataFrame(self.columns())


@dataclass(frozen=True)
class PositioningResult:
    """The position errors of one arm, estimator, range noise and zone, of one car or of all.

    Attributes
    ----------
    arm : traditional, proposed, gps or gps_odometry
    estimator, preset, sigma_range_m, radius_m : None for the arms that do not range
    vehicle : a car's id, or ``all``
    samples : car-steps over all runs, layouts and traffic seeds
    diverged : cars that diverged, counted once a run; when there are any, the errors are None
    mean_error_m, sd_error_m : of the pooled absolute error (what the paper prints)
    rmse_m, median_error_m, p95_error_m : of the same pooled absolute error
    bound_rmse_m : root of the mean posterior Cramér-Rao bound; None when it was not computed
    nees : mean normalised squared error, 2 for an honest filter; None without a covariance
    """

    arm: str
    estimator: str | None
    preset: str | None
    sigma_range_m: float | None
    radius_m: float | None
    vehicle: str
    samples: int
    diverged: int
    mean_error_m: float | None
    sd_error_m: float | None
    rmse_m: float | None
    median_error_m: float | None
    p95_error_m: float | None
    bound_rmse_m: float | None = None
    nees: float | None = None

    @property
    def rmse_over_bound(self) -> float | None:
        """RMSE over its lower bound; None when either is unknown."""
        if self.rmse_m is None or not self.bound_rmse_m:
            return None
        return self.rmse_m / self.bound_rmse_m


@dataclass(frozen=True)
class PositioningImprovement:
    """What parked cars take off the mean error: 100 (1 - proposed / traditional), in percent.

    ``ci95`` is its 95 % bootstrap interval, nested over layouts, traffic seeds and runs; both are
    None when a car of either arm diverged.
    """

    estimator: str
    preset: str
    sigma_range_m: float
    radius_m: float
    vehicle: str
    percent: float | None
    ci95: tuple[float, float] | None


@dataclass(frozen=True)
class PositioningReport:
    """Position errors of every arm, estimator, range noise and zone, and what parked cars save.

    Attributes
    ----------
    vehicles, anchors, steps : cars, anchors and time steps of the first scenario
    scenarios, runs : pairs of traffic and parked layout, and noise runs of each
    seed : of the noise
    results, improvements : the tables
    options : the options as plain values
    battery_hours, mean_stay_h : how long a parked car can serve, and how long it stays on average
    """

    vehicles: int
    anchors: int
    steps: int
    scenarios: int
    runs: int
    seed: int
    results: tuple[PositioningResult, ...]
    improvements: tuple[PositioningImprovement, ...]
    options: dict[str, Any]
    battery_hours: float
    mean_stay_h: float

    def to_frame(self) -> pd.DataFrame:
        """Return one row for each result."""
        import pandas as pd

        return pd.DataFrame(
            [vars(result) | {"rmse_over_bound": result.rmse_over_bound} for result in self.results]
        )

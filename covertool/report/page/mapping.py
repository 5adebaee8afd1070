"""The layers of the map: what is drawn, in which colours, and what its pop-ups say."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from covertool.model import Floats, Objects
from covertool.report.page import theme
from covertool.report.page.popups import (
    Columns,
    Values,
    column,
    metres,
    plain,
    spaced,
    square_metres,
    texts,
)
from covertool.report.page.study import LEVEL_LAYERS, ReportStudy, radius_names

if TYPE_CHECKING:
    import geopandas as gpd

    from covertool.report.page.theme import Pair

LEVEL_NAMES = {
    0: "Level 0: no parked car",
    1: "Level 1: one parked car",
    2: "Level 2: two parked cars",
    3: "Level 3: three or more",
}


@dataclass(frozen=True)
class MapLayer:
    """One switchable layer of the map.

    Attributes
    ----------
    key : name of the layer's switch; layers of several radii share it
    label : what the switch says
    form : area, outline, line, car or mark
    shapes : (N,) geometries in the map's CRS
    values : pop-up texts by heading, N each
    colour : light and dark
    shown : whether the page opens with it
    radius : the radius that it belongs to, None when it belongs to all
    width : of lines, in pixels
    turned : of cars: heading in degrees, length and width in metres
    """

    key: str
    label: str
    form: str
    shapes: Objects
    values: Values
    colour: Pair
    shown: bool = True
    radius: str | None = None
    width: float = 1.0
    opacity: float = 1.0
    turned: tuple[Any, Any, Any] | None = field(default=None, repr=False)


def map_layers(study: ReportStudy, layers: Mapping[str, gpd.GeoDataFrame]) -> list[MapLayer]:
    """Return the layers from the bottom up; ``layers`` are the study's, in one CRS."""
    drawn: list[MapLayer] = []
    for name, make in _MAKERS.items():
        if name in layers:
            drawn += make(layers[name], study)
    return _cars_once(drawn)


def _cars_once(drawn: list[MapLayer]) -> list[MapLayer]:
    """Return the layers with parked cars drawn once.

    Where the vehicles are the anchors, the vehicles' rectangles are drawn; where they are not, the
    anchors, which is what coverage counts, and the vehicles as a layer to switch on.
    """
    cars = next((layer for layer in drawn if layer.key == "cars"), None)
    vehicles = next((layer for layer in drawn if layer.key == "vehicles"), None)
    if cars is None or vehicles is None:
        return drawn
    if sorted(cars.values.get("Anchor", ["?"])) != sorted(vehicles.values.get("Car", [])):
        return drawn
    same = replace(vehicles, key=cars.key, label=cars.label, shown=True)
    return [same if layer is cars else layer for layer in drawn if layer is not vehicles]


def _buildings(frame: gpd.GeoDataFrame, _: ReportStudy) -> list[MapLayer]:
    values = texts(frame, {"kind": ("Kind", str), "height_m": ("Height", metres)})
    return [MapLayer("buildings", "Buildings", "area", _shapes(frame), values, theme.BUILDING)]


def _transit(frame: gpd.GeoDataFrame, _: ReportStudy) -> list[MapLayer]:
    values = texts(frame, {"area_m2": ("Whole area", square_metres)})
    label = "Transit area, not covered"
    return [MapLayer("transit", label, "area", _shapes(frame), values, theme.TRANSIT, opacity=0.75)]


def _level(level: int) -> Callable[[gpd.GeoDataFrame, ReportStudy], list[MapLayer]]:
    def make(frame: gpd.GeoDataFrame, _: ReportStudy) -> list[MapLayer]:
        made = []
        names = np.array(radius_names(frame), dtype=object)
        for name in dict.fromkeys(names):
            rows = frame[names == name]
            shapes, row = shapely.get_parts(_shapes(rows), return_index=True)
            head = "Level in this tile" if "tile" in rows else "Whole level"
            whole = texts(rows, {"area_m2": (head, square_metres)})
            values = {"Radius": [str(name)] * len(shapes)}
            values["This patch"] = [square_metres(area) for area in shapely.area(shapes)]
            values |= {head: [texts[i] for i in row] for head, texts in whole.items()}
            made.append(
                MapLayer(
                    f"level{level}",
                    LEVEL_NAMES[level],
                    "area",
                    shapes,
                    values,
                    theme.LEVELS[level],
                    radius=str(name),
                )
            )
        return made

    return make


def _zones(frame: gpd.GeoDataFrame, study: ReportStudy) -> list[MapLayer]:
    columns = [c for c in frame.columns if c != frame.geometry.name]
    values = {spaced(c).capitalize(): [plain(v) for v in frame[c]] for c in columns[:4]}
    return [MapLayer("zones", "Zones", "outline", _shapes(frame), values, theme.INK)]


def _segments(frame: gpd.GeoDataFrame, study: ReportStudy) -> list[MapLayer]:
    values = texts(
        frame,
        {
            "name": ("Street", str),
            "segment_id": ("Segment", str),
            "kind": ("Kind", str),
            "length_m": ("Length", metres),
            "free_flow_kmh": ("Free flow", lambda v: f"{v:g} km/h"),
        },
    )
    return [
        MapLayer(
            "segments",
            "Street segments",
            "line",
            _shapes(frame),
            values,
            theme.MUTED,
            shown=False,
            width=1.5,
        )
    ]


_CONGESTION = (
    ("unknown", "unknown", theme.UNKNOWN, 1.5),
    ("closed", "closed", theme.CLOSED, 2.5),
    ("free", "free", theme.FREE, 2.0),
    ("occupied", "occupied", theme.OCCUPIED, 4.0),
)


def _congestion(frame: gpd.GeoDataFrame, _: ReportStudy) -> list[MapLayer]:
    columns: Columns = {
        "segment_id": ("Segment", str),
        "status": ("Status", str),
        "queue_m": ("Queue", metres),
        "length_m": ("Length", metres),
        "day": ("Day", str),
        "window": ("Window", str),
    }
    made = []
    kinds = np.array(column(frame, "kind", "unknown"), dtype=object)
    for kind, label, colour, width in _CONGESTION:
        rows = frame[kinds == kind]
        if len(rows):
            made.append(
                MapLayer(
                    f"congestion-{kind}",
                    f"Street {label}",
                    "line",
                    _shapes(rows),
                    texts(rows, columns),
                    colour,
                    shown=False,
                    width=width,
                )
            )
    return made


_TRACK_COLUMNS: Columns = {
    "vehicle": ("Car", str),
    "mean_error_m": ("Mean error", metres),
    "traditional_m": ("Without parked cars", metres),
    "percent": ("Taken off", lambda v: f"{v:.1f} %"),
    "met": ("Parked cars met", plain),
    "met_per_km": ("Met per km", plain),
    "estimator": ("Estimator", str),
    "radius_m": ("Zone", metres),
    "sigma_range_m": ("Range noise", metres),
}


def _trajectories(frame: gpd.GeoDataFrame, _: ReportStudy) -> list[MapLayer]:
    """Return one layer for each class of mean error, the largest error on top."""
    errors = np.full(len(frame), np.nan)
    if "mean_error_m" in frame:
        errors = frame["mean_error_m"].to_numpy(dtype=float, na_value=np.nan)
    classes = [("tracks", "Tracks of cars, error not known", theme.MUTED, np.isnan(errors))]
    edges = _round_edges(errors)
    # The smallest errors have the last colour, however many classes there are.
    for i, (low, high) in enumerate(pairwise(edges)):
        label = f"Track, mean error {low:g} to {high:g} m"
        inside = (errors >= low) & (errors < high)
        classes.append((f"tracks-{i}", label, theme.ERRORS[len(theme.ERRORS) - 1 - i], inside))
    return [
        MapLayer(key, label, "line", _shapes(frame[rows]), texts(frame[rows], _TRACK_COLUMNS),
                 colour, shown=False, width=1.8)
        for key, label, colour, rows in classes
        if rows.any()
    ]  # fmt: skip


def _round_edges(errors: Floats) -> list[float]:
    """Return round edges of up to five classes that hold all the errors.

    >>> _round_edges(np.array([0.4, 9.9]))
    [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]
    """
    top = float(np.nanmax(errors, initial=0.0))
    most = len(theme.ERRORS)
    step = next((s for s in (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0) if s * most > top), top)
    count = min(int(top // step) + 1, most)
    edges = [step * i for i in range(count + 1)]
    return [*edges[:-1], float(np.nextafter(top, np.inf))] if edges[-1] <= top else edges


def _vehicles(frame: gpd.GeoDataFrame, _: ReportStudy) -> list[MapLayer]:
    """Return the parked vehicles: turned rectangles, or points where no heading is known."""
    parked = column(frame, "parked", True)
    rows = frame[[bool(value) if value is not None else True for value in parked]]
    if not len(rows):
        return []
    columns: Columns = {"id": ("Car", str), "site": ("Site", spaced)}
    sizes = [
        rows[name].to_numpy(dtype=float, na_value=np.nan)
        for name in ("heading_deg", "length_m", "width_m")
        if name in rows
    ]
    whole = len(sizes) == 3 and all(np.isfinite(values).all() for values in sizes)
    centres: Objects = np.asarray(shapely.centroid(_shapes(rows)), dtype=object)
    return [
        MapLayer("vehicles", "Vehicles in the imagery", "car" if whole else "mark", centres,
                 texts(rows, columns), theme.PARKED, shown=False,
                 turned=(sizes[0], sizes[1], sizes[2]) if whole else None)
    ]  # fmt: skip


_ORIGINS = {
    "parked": ("cars", "Parked cars", theme.PARKED),
    "queue": ("queue", "Cars in queues", theme.QUEUED),
    "rsu": ("rsu", "Roadside units", theme.ROADSIDE),
}


def _anchors(frame: gpd.GeoDataFrame, _: ReportStudy) -> list[MapLayer]:
    origins = np.array([str(v) for v in column(frame, "origin", "parked")], dtype=object)
    columns: Columns = {
        "id": ("Anchor", str),
        "radius_m": ("Radius", metres),
        "device_class": ("Device class", str),
        "sigma_m": ("Own error", metres),
    }
    made = []
    for origin, (key, label, colour) in _ORIGINS.items():
        rows = frame[origins == origin]
        if len(rows):
            made.append(MapLayer(key, label, "mark", _shapes(rows), texts(rows, columns), colour))
    return made


_MAKERS: Mapping[str, Callable[[gpd.GeoDataFrame, ReportStudy], list[MapLayer]]] = {
    "buildings": _buildings,
    "transit": _transit,
    **{name: _level(level) for level, name in LEVEL_LAYERS.items()},
    "zones": _zones,
    "segments": _segments,
    "congestion": _congestion,
    "trajectories": _trajectories,
    "vehicles": _vehicles,
    "anchors": _anchors,
}


def _shapes(frame: gpd.GeoDataFrame) -> Objects:
    return np.asarray(frame.geometry.array, dtype=object)

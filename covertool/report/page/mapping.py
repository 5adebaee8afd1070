"""The layers of the map: what is drawn, in which colours, and what its pop-ups say."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import shapely

from covertool.model import Objects
from covertool.report.page import theme
from covertool.report.page.maplayer import MapLayer, shapes_of
from covertool.report.page.popups import (
    Columns,
    column,
    metres,
    plain,
    spaced,
    square_metres,
    texts,
)
from covertool.report.page.study import LEVEL_LAYERS, ReportStudy, radius_names
from covertool.report.page.tracks import track_layers

if TYPE_CHECKING:
    import geopandas as gpd

LEVEL_NAMES = {
    0: "Level 0: no parked car",
    1: "Level 1: one parked car",
    2: "Level 2: two parked cars",
    3: "Level 3: three or more",
}


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
    return [MapLayer("buildings", "Buildings", "area", shapes_of(frame), values, theme.BUILDING)]


def _transit(frame: gpd.GeoDataFrame, _: ReportStudy) -> list[MapLayer]:
    values = texts(frame, {"area_m2": ("Whole area", square_metres)})
    label = "Transit area, not covered"
    return [
        MapLayer("transit", label, "area", shapes_of(frame), values, theme.TRANSIT, opacity=0.75)
    ]


def _level(level: int) -> Callable[[gpd.GeoDataFrame, ReportStudy], list[MapLayer]]:
    """Return what makes the layers of a level, one for each radius."""

    def make(frame: gpd.GeoDataFrame, _: ReportStudy) -> list[MapLayer]:
        """Return the patches of one level, radius by radius."""
        made = []
        names = np.array(radius_names(frame), dtype=object)
        for name in dict.fromkeys(names):
            rows = frame[names == name]
            shapes, row = shapely.get_parts(shapes_of(rows), return_index=True)
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
    return [MapLayer("zones", "Zones", "outline", shapes_of(frame), values, theme.INK)]


def _segments(frame: gpd.GeoDataFrame, study: ReportStudy) -> list[MapLayer]:
    """Return the street segments as a layer to switch on."""
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
            shapes_of(frame),
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
    """Return one layer for each kind of street, the occupied ones on top."""
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
                    shapes_of(rows),
                    texts(rows, columns),
                    colour,
                    shown=False,
                    width=width,
                )
            )
    return made


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
    centres: Objects = np.asarray(shapely.centroid(shapes_of(rows)), dtype=object)
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
    """Return one layer for each origin of anchors."""
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
            made.append(MapLayer(key, label, "mark", shapes_of(rows), texts(rows, columns), colour))
    return made


_MAKERS: Mapping[str, Callable[[gpd.GeoDataFrame, ReportStudy], list[MapLayer]]] = {
    "buildings": _buildings,
    "transit": _transit,
    **{name: _level(level) for level, name in LEVEL_LAYERS.items()},
    "zones": _zones,
    "segments": _segments,
    "congestion": _congestion,
    "trajectories": track_layers,
    "vehicles": _vehicles,
    "anchors": _anchors,
}

"""The values that pass between the rooms: frozen, in metres, in one projected CRS."""

from covertool.model.congestion import (
    Observations,
    OccupancyCell,
    OccupancyDay,
    OccupancyMean,
    OccupancyTable,
)
from covertool.model.coverage import LEVELS, CoverageReport, RadiusCoverage
from covertool.model.positioning import (
    CarDensity,
    CarErrors,
    LayoutImprovement,
    PositioningImprovement,
    PositioningReport,
    PositioningResult,
    PositionTracks,
    Trace,
)
from covertool.model.sources import AnchorSource, RasterSource
from covertool.model.tables import Bounds, Floats, Integers, Objects
from covertool.model.town import ORIGINS, SITES, Anchors, DeviceClass, Study, TransitArea, Vehicles

__all__ = [
    "LEVELS",
    "ORIGINS",
    "SITES",
    "AnchorSource",
    "Anchors",
    "Bounds",
    "CarDensity",
    "CarErrors",
    "CoverageReport",
    "DeviceClass",
    "Floats",
    "Integers",
    "LayoutImprovement",
    "Objects",
    "Observations",
    "OccupancyCell",
    "OccupancyDay",
    "OccupancyMean",
    "OccupancyTable",
    "PositionTracks",
    "PositioningImprovement",
    "PositioningReport",
    "PositioningResult",
    "RadiusCoverage",
    "RasterSource",
    "Study",
    "Trace",
    "TransitArea",
    "Vehicles",
]

"""How much of a town's road would parked cars cover, and what would that save in metres?

What a notebook needs is here; each name is imported when it is first used:

>>> import covertool
>>> covertool.coverage_levels.__name__
'coverage_levels'
"""

from __future__ import annotations

import importlib
from typing import Any

__version__ = "0.1.0"

_PUBLIC = {
    "read_study": "covertool.gis.read",
    "read_anchors": "covertool.gis.read",
    "read_transit": "covertool.gis.read",
    "write_layers": "covertool.gis.write",
    "extract_vehicles": "covertool.extract.vehicles",
    "coverage_levels": "covertool.coverage",
    "occupancy_table": "covertool.congestion.occupancy",
    "simulate": "covertool.traffic.simulation",
    "export": "covertool.report.export",
}


def __getattr__(name: str) -> Any:
    """Return a public name from its room; heavy libraries load only now."""
    if name in _PUBLIC:
        return getattr(importlib.import_module(_PUBLIC[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """Return the public names."""
    return sorted([*_PUBLIC, "__version__"])

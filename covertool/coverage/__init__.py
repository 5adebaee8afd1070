"""Discs to coverage levels."""

from covertool.coverage.areas import LevelAreas, level_areas
from covertool.coverage.curve import CoverageCurve, coverage_curve
from covertool.coverage.levels import coverage_levels
from covertool.coverage.regions import level_regions

__all__ = [
    "CoverageCurve",
    "LevelAreas",
    "coverage_curve",
    "coverage_levels",
    "level_areas",
    "level_regions",
]

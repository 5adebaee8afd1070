"""Discs to coverage levels."""

from covertool.coverage.areas import LevelAreas, level_areas
from covertool.coverage.levels import coverage_levels
from covertool.coverage.regions import level_regions

__all__ = ["LevelAreas", "coverage_levels", "level_areas", "level_regions"]

"""Discs to coverage levels."""

from covertool.coverage.areas import LevelAreas, coverage_levels, level_areas

__all__ = ["LevelAreas", "coverage_levels", "level_areas"]

"""Discs to coverage levels."""

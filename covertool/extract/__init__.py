"""Imagery to vehicles; masks and OSM to the transit area."""

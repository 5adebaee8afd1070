"""Observations to the occupancy table and queue anchors."""

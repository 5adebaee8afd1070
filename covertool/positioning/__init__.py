"""Trace and anchors to position errors."""

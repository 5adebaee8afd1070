"""Detectors of cars in top-view imagery, behind one protocol."""

"""What pytest leaves alone here."""

collect_ignore = ["qgis_render.py"]
"""Run by Debian's own Python, which has PyQGIS, and not by this environment's."""

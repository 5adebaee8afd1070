"""What the rooms read from without opening a path."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
from pyproj import CRS

from covertool.model.tables import Bounds, Floats
from covertool.model.town import Anchors

COARSEST_GSD_M = 0.35
"""At 0.35 m a car is 5 pixels wide; beyond it a car and its shadow can no longer be told apart."""


class AnchorSource(Protocol):
    """Anchors that can be read by bounding box, from a file or from memory; picklable."""

    @property
    def crs(self) -> CRS:
        """CRS of the coordinates."""
        ...

    @property
    def bounds(self) -> Bounds:
        """Least and greatest coordinates: x0, y0, x1, y1."""
        ...

    def read(self, bounds: Bounds | None = None) -> Anchors:
        """Return the anchors inside bounds (x0, y0, x1, y1; closed), or all of them."""
        ...


class RasterSource(Protocol):
    """A raster that can be read window by window; picklable, opened by the reader.

    Pixel coordinates run x to the right and y down; the corner of the first pixel is (0, 0).
    """

    @property
    def name(self) -> str:
        """Name for messages and for the image column."""
        ...

    @property
    def width(self) -> int:
        """Columns."""
        ...

    @property
    def height(self) -> int:
        """Rows."""
        ...

    @property
    def bands(self) -> int:
        """Bands without alpha."""
        ...

    @property
    def crs(self) -> CRS:
        """Working CRS of the metres."""
        ...

    def read(self, x0: int, y0: int, width: int, height: int) -> npt.NDArray[Any]:
        """Return (bands, height, width) of a window; outside the image it is padded with zeros."""
        ...

    def valid(self, x0: int, y0: int, width: int, height: int) -> npt.NDArray[np.bool_]:
        """Return (height, width): True where the pixel holds data (alpha, nodata, inside)."""
        ...

    def to_metres(self, x_px: Floats, y_px: Floats) -> tuple[Floats, Floats]:
        """Return pixel coordinates as metres in ``crs``."""
        ...

    def to_pixels(self, x_m: Floats, y_m: Floats) -> tuple[Floats, Floats]:
        """Return metres in ``crs`` as pixel coordinates."""
        ...

    def gsd_m(self, x_px: float, y_px: float) -> tuple[float, float]:
        """Return the ground size of a pixel along its x and y axis in metres at that place."""
        ...

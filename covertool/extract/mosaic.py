"""Images on one pixel grid seen as one image: seams between files become seams of windows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from pyproj import CRS

from covertool import crs as crs_door
from covertool.errors import OptionError
from covertool.model import Floats, Objects, RasterSource

_OFF_GRID_PX = 0.1


@dataclass(frozen=True)
class Mosaic:
    """A raster made of rasters whose pixels fall on one grid; the first on top where they overlap.

    Attributes
    ----------
    members : the rasters
    offsets : (x, y) of each member's first pixel in the mosaic
    """

    members: tuple[RasterSource, ...]
    offsets: tuple[tuple[int, int], ...]

    @property
    def name(self) -> str:
        """Return the first member's name."""
        return self.members[0].name

    @property
    def width(self) -> int:
        """Return the mosaic's width in pixels."""
        return max(x + m.width for m, (x, _) in zip(self.members, self.offsets, strict=True))

    @property
    def height(self) -> int:
        """Return the mosaic's height in pixels."""
        return max(y + m.height for m, (_, y) in zip(self.members, self.offsets, strict=True))

    @property
    def bands(self) -> int:
        """Return the number of bands that all members have."""
        return self.members[0].bands

    @property
    def crs(self) -> CRS:
        """Return the CRS of the metres."""
        return self.members[0].crs

    def read(self, x0: int, y0: int, width: int, height: int) -> npt.NDArray[Any]:
        """Return (bands, height, width) of a window; what is not valid means nothing."""
        out: npt.NDArray[Any] | None = None
        for member, x, y, here in self._under(x0, y0, width, height):
            values = member.read(x0 - x, y0 - y, width, height)
            if out is None:
                out = values
            else:
                np.copyto(out, values, where=here)
        return self.members[0].read(-width, -height, width, height) if out is None else out

    def valid(self, x0: int, y0: int, width: int, height: int) -> npt.NDArray[np.bool_]:
        """Return (height, width): True where a member holds data."""
        out = np.zeros((height, width), dtype=bool)
        for _, _, _, here in self._under(x0, y0, width, height):
            out |= here
        return out

    def to_metres(self, x_px: Floats, y_px: Floats) -> tuple[Floats, Floats]:
        """Return mosaic pixel coordinates as metres in ``crs``."""
        x, y = self.offsets[0]
        return self.members[0].to_metres(x_px - x, y_px - y)

    def to_pixels(self, x_m: Floats, y_m: Floats) -> tuple[Floats, Floats]:
        """Return metres in ``crs`` as mosaic pixel coordinates."""
        x, y = self.offsets[0]
        column, row = self.members[0].to_pixels(x_m, y_m)
        return column + x, row + y

    def gsd_m(self, x_px: float, y_px: float) -> tuple[float, float]:
        """Return the ground size of a pixel along its axes in metres."""
        x, y = self.offsets[0]
        return self.members[0].gsd_m(x_px - x, y_px - y)

    def locate(self, x_px: Floats, y_px: Floats) -> tuple[Objects, Floats, Floats]:
        """Return for each place the name of its topmost member, and the place in that member."""
        name = np.full(x_px.shape, self.name, dtype=object)
        x, y = x_px - self.offsets[0][0], y_px - self.offsets[0][1]
        for member, (left, top) in list(zip(self.members, self.offsets, strict=True))[::-1]:
            inside = (x_px >= left) & (x_px < left + member.width)
            inside &= (y_px >= top) & (y_px < top + member.height)
            name[inside] = member.name
            x[inside], y[inside] = x_px[inside] - left, y_px[inside] - top
        return name, x, y

    def _under(
        self, x0: int, y0: int, width: int, height: int
    ) -> list[tuple[RasterSource, int, int, npt.NDArray[np.bool_]]]:
        """Return the members in a window, their offsets, and where each gives the pixel."""
        taken = np.zeros((height, width), dtype=bool)
        found = []
        for member, (x, y) in zip(self.members, self.offsets, strict=True):
            beside = x0 >= x + member.width or x >= x0 + width
            if beside or y0 >= y + member.height or y >= y0 + height:
                continue
            here = member.valid(x0 - x, y0 - y, width, height) & ~taken
            taken |= here
            found.append((member, x, y, here))
        return found


def mosaics(rasters: Sequence[RasterSource]) -> list[Mosaic]:
    """Return the rasters joined wherever they share a CRS, a band count and a pixel grid.

    Raises
    ------
    OptionError
        When several images have no place on Earth, so that they would all lie on one another.
    """
    if len(rasters) > 1 and any(crs_door.is_image_plane(raster.crs) for raster in rasters):
        raise OptionError(
            "several images without georeference would lie on one another",
            ", ".join(raster.name for raster in rasters[:5]),
            "extract them one by one, each into its own study",
        )
    groups: list[list[tuple[RasterSource, int, int]]] = []
    for raster in rasters:
        for group in groups:
            offset = _offset(group[0][0], raster)
            if offset is not None:
                group.append((raster, *offset))
                break
        else:
            groups.append([(raster, 0, 0)])
    return [_joined(group) for group in groups]


def _joined(group: list[tuple[RasterSource, int, int]]) -> Mosaic:
    left, top = min(x for _, x, _ in group), min(y for _, _, y in group)
    return Mosaic(
        tuple(raster for raster, _, _ in group), tuple((x - left, y - top) for _, x, y in group)
    )


def _offset(first: RasterSource, other: RasterSource) -> tuple[int, int] | None:
    """Return the other's first pixel on the first's grid, or None when the grids differ."""
    if first.crs != other.crs or first.bands != other.bands:
        return None
    if first.read(0, 0, 1, 1).dtype != other.read(0, 0, 1, 1).dtype:
        return None
    columns = np.array([0.0, other.width, 0.0])
    rows = np.array([0.0, 0.0, other.height])
    x, y = first.to_pixels(*other.to_metres(columns, rows))
    dx, dy = np.rint(x[0]), np.rint(y[0])
    off = np.max(np.abs([x - columns - dx, y - rows - dy]))
    return (int(dx), int(dy)) if off <= _OFF_GRID_PX else None

"""Rasters with bright rectangles of known place, and a detector that finds bright rectangles."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import rasterio
from pyproj import CRS
from rasterio.transform import Affine

from covertool.crs import transform
from covertool.extract.detectors.protocol import MIN_HALO_PX, Detections
from covertool.gis.geotiff import GeoRaster, open_raster


@dataclass(frozen=True)
class BrightBoxes:
    """Finds every connected patch brighter than 150 as one rectangle; a long one is a truck."""

    name: str = "bright boxes"
    gsd_m: float = 0.2
    halo_px: int = MIN_HALO_PX
    threshold: float = 0.5

    def detect(self, rgb, valid):
        bright = ((rgb.min(axis=2) > 150) & valid).astype(np.uint8)
        outlines, _ = cv2.findContours(bright, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        rows = []
        for outline in outlines:
            corners = cv2.boxPoints(cv2.minAreaRect(outline))
            sides = np.diff(corners[[0, 1, 2]], axis=0)
            lengths = np.hypot(*sides.T)
            if lengths.min() < 3:
                continue
            x, y = sides[lengths.argmax()]
            heading = np.degrees(np.arctan2(x, -y))
            centre = corners.mean(axis=0) + 0.5
            rows.append((*centre, heading, lengths.max() + 1, lengths.min() + 1, 0.9))
        table = np.array(rows).reshape(-1, 6)
        kinds = np.where(table[:, 3] * self.gsd_m > 6.5, "truck", "car")
        return Detections.of_cars(*table.T, kinds)


def paint(
    path: Path,
    cars,
    *,
    size=(400, 300),
    affine=Affine(0.2, 0, 600_000, 0, -0.2, 750_060),
    crs="EPSG:2157",
    metres="EPSG:2157",
    dtype="uint8",
    bands=3,
    dark=60,
    bright=230,
    nodata=None,
) -> GeoRaster:
    """Write a raster with cars (x_m, y_m, heading, length, width) in the CRS ``metres``."""
    width, height = size
    picture = np.full((height, width), float(dark))
    columns, rows = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    map_x, map_y = affine @ (columns, rows)
    x, y = transform(map_x.ravel(), map_y.ravel(), CRS(crs), CRS(metres))
    x, y = x.reshape(height, width), y.reshape(height, width)
    for cx, cy, heading, length, broad in cars:
        turn = np.radians(heading)
        along = (x - cx) * np.sin(turn) + (y - cy) * np.cos(turn)
        across = (x - cx) * np.cos(turn) - (y - cy) * np.sin(turn)
        picture[(np.abs(along) <= length / 2) & (np.abs(across) <= broad / 2)] = bright
    with rasterio.open(
        path, "w", driver="GTiff", width=width, height=height, count=bands, dtype=dtype,
        crs=crs, transform=affine, nodata=nodata,
    ) as out:  # fmt: skip
        for band in range(bands):
            out.write(picture.astype(dtype), band + 1)
    return open_raster(path)


def write_mask(path: Path, on, *, affine=Affine(0.5, 0, 0, 0, -0.5, 0), crs="EPSG:2157", **more):
    """Write a mask, (H, W) or (bands, H, W), and open it."""
    planes = np.atleast_3d(np.asarray(on)) if np.ndim(on) == 2 else np.moveaxis(on, 0, 2)
    height, width, count = planes.shape
    with rasterio.open(
        path, "w", driver="GTiff", width=width, height=height, count=count, dtype=planes.dtype,
        crs=crs, transform=affine, **more,
    ) as out:  # fmt: skip
        out.write(np.moveaxis(planes, 2, 0))
    return open_raster(path)

"""Megapixels of the 0.20 m working image that the shipped detector reads a second on one core."""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import rasterio
from rasterio.transform import Affine

from covertool.extract.detectors.network import NetworkDetector
from covertool.extract.vehicles import extract_vehicles
from covertool.gis.geotiff import open_raster

Pixels = npt.NDArray[np.uint8]


def picture(side: int) -> Pixels:
    """Return a square picture of noise and boxes."""
    rng = np.random.default_rng(0)
    rgb = rng.integers(90, 130, (side, side, 3), dtype=np.uint8)
    for x, y in rng.integers(20, side - 20, (side * side // 4000, 2)).tolist():
        tone = rng.integers(0, 255, 3).tolist()
        cv2.rectangle(rgb, (x, y), (x + 22, y + 9), tone, cv2.FILLED)
    return rgb


def least_seconds(work: Callable[[], object], repeats: int) -> float:
    """Return the least of several runs after a first one that does not count.

    CPU seconds are counted, not those of the clock: other work on the machine weighs less.
    """
    work()
    seconds = []
    for _ in range(repeats):
        started = time.process_time()
        work()
        seconds.append(time.process_time() - started)
    return min(seconds)


def detector_rate(detector: NetworkDetector, rgb: Pixels, repeats: int) -> float:
    """Return megapixels a second of the detector alone, on one picture in memory."""
    valid = np.ones(rgb.shape[:2], dtype=bool)
    return rgb[..., 0].size / least_seconds(lambda: detector.detect(rgb, valid), repeats) / 1e6


def image_rate(detector: NetworkDetector, side: int, repeats: int) -> float:
    """Return megapixels a second of a GeoTIFF, from opening it to vehicles on the map."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "image.tif"
        with rasterio.open(
            path, "w", driver="GTiff", width=side, height=side, count=3, dtype="uint8",
            crs="EPSG:2157", transform=Affine(0.2, 0, 600_000, 0, -0.2, 750_000), tiled=True,
        ) as out:  # fmt: skip
            out.write(np.moveaxis(picture(side), 2, 0))
        seconds = least_seconds(lambda: extract_vehicles(open_raster(path), detector), repeats)
        return side * side / seconds / 1e6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--side", type=int, default=1152, help="side of the picture in pixels")
    parser.add_argument("--image-side", type=int, default=3072, help="side of the GeoTIFF")
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    cv2.setNumThreads(1)
    plain, thorough = NetworkDetector.shipped(), NetworkDetector.shipped(tta=True)
    rgb = picture(options.side)
    once = detector_rate(plain, rgb, options.repeats)
    four = detector_rate(thorough, rgb, options.repeats)
    whole = image_rate(plain, options.image_side, options.repeats)
    print(f"OpenCV {cv2.__version__}, one core, megapixels a second:")
    print(f"detector alone {once:.2f}, with --tta {four:.2f}, ratio {once / four:.1f}")
    print(f"a {options.image_side}-pixel GeoTIFF with windows, halos and all {whole:.2f}")


if __name__ == "__main__":
    main()

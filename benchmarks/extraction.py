"""Megapixels of the 0.20 m working image that the shipped detector reads a second on one core."""

from __future__ import annotations

import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import rasterio
from rasterio.transform import Affine

from benchmarks.rows import Row, main, seconds, side_by_side
from covertool.extract.detectors.network import NetworkDetector
from covertool.extract.detectors.yolo_obb import YoloObbDetector
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


def detecting(detector: NetworkDetector, rgb: Pixels) -> Callable[[], object]:
    """Return the work of the detector alone, on one picture in memory."""
    return partial(detector.detect, rgb, np.ones(rgb.shape[:2], dtype=bool))


def write_image(path: Path, side: int) -> None:
    """Write the picture as a GeoTIFF of 0.20 m."""
    with rasterio.open(
        path, "w", driver="GTiff", width=side, height=side, count=3, dtype="uint8",
        crs="EPSG:2157", transform=Affine(0.2, 0, 600_000, 0, -0.2, 750_000), tiled=True,
    ) as out:  # fmt: skip
        out.write(np.moveaxis(picture(side), 2, 0))


def rows(quick: bool) -> Iterator[Row]:
    """Yield rates and ratios; all seconds are of the processor, on one thread."""
    side, turns = (1152, 2) if quick else (3072, 5)
    cv2.setNumThreads(1)
    plain, thorough = NetworkDetector.shipped(), NetworkDetector.shipped(tta=True)
    once = detecting(plain, picture(1152))
    once()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "image.tif"
        write_image(path, side)

        def whole() -> object:
            return extract_vehicles(open_raster(path), plain)

        alone = [seconds(once, time.process_time) for _ in range(turns)]
        image = [seconds(whole, time.process_time) for _ in range(turns)]
    rate = tuple(1152**2 / 1e6 / taken for taken in alone)
    yield Row("network on a picture of 1152 pixels", "", rate, "MP/s", limit=4)
    share = tuple((side**2 / 1152**2) * a / b for a, b in zip(alone, image, strict=True))
    name = f"GeoTIFF of {side} pixels to vehicles on the map"
    yield Row(name, "", tuple(side**2 / 1e6 / taken for taken in image), "MP/s")
    yield Row(f"{name}, per pixel", "the network alone", share)
    yield side_by_side(
        "network on a picture of 1152 pixels", "the same with --tta", once,
        detecting(thorough, picture(1152)), turns, clock=time.process_time,
    )  # fmt: skip
    yield from own_model(once, turns)


def own_model(once: Callable[[], object], turns: int) -> Iterator[Row]:
    """Yield the ratio to a YOLO-OBB model, when the environment names its file.

    COVERTOOL_BENCH_YOLO=FILE:GSD, the ONNX file and the metres of its pixels.
    """
    given = os.environ.get("COVERTOOL_BENCH_YOLO")
    if given is None:
        print("no YOLO-OBB model given (COVERTOOL_BENCH_YOLO=FILE:GSD)", file=sys.stderr)
        return
    path, _, gsd_m = given.rpartition(":")
    model = YoloObbDetector(Path(path).read_bytes(), Path(path).name, float(gsd_m))
    peer = detecting(model, picture(1152))
    peer()
    name = f"YOLO-OBB {Path(path).name} at {gsd_m} m, the same picture"
    yield side_by_side(
        "network on a picture of 1152 pixels", name, once, peer, turns, clock=time.process_time
    )


if __name__ == "__main__":
    main(rows, __doc__)

"""Megapixels of the 0.20 m working image that the shipped detector reads a second on one core."""

from __future__ import annotations

import argparse
import time

import cv2
import numpy as np

from covertool.extract.detectors.network import NetworkDetector


def megapixels_a_second(detector: NetworkDetector, side: int, repeats: int) -> float:
    """Return the best of several runs over one square picture of noise and boxes.

    CPU seconds are counted, not those of the clock: other work on the machine weighs less.
    """
    rng = np.random.default_rng(0)
    rgb = rng.integers(90, 130, (side, side, 3), dtype=np.uint8)
    for x, y in rng.integers(20, side - 20, (side * side // 4000, 2)).tolist():
        tone = rng.integers(0, 255, 3).tolist()
        cv2.rectangle(rgb, (x, y), (x + 22, y + 9), tone, cv2.FILLED)
    valid = np.ones((side, side), dtype=bool)
    detector.detect(rgb, valid)
    seconds = []
    for _ in range(repeats):
        started = time.process_time()
        detector.detect(rgb, valid)
        seconds.append(time.process_time() - started)
    return side * side / min(seconds) / 1e6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--side", type=int, default=1152, help="side of the picture in pixels")
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    cv2.setNumThreads(1)
    plain, thorough = NetworkDetector.shipped(), NetworkDetector.shipped(tta=True)
    once = megapixels_a_second(plain, options.side, options.repeats)
    four = megapixels_a_second(thorough, options.side, options.repeats)
    print(f"plain {once:.2f} MP/s, with --tta {four:.2f} MP/s, ratio {once / four:.1f}")


if __name__ == "__main__":
    main()

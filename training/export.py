"""Fold, export and check the trained network; choose its thresholds on rendered tiles."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
import onnx
import torch
from model import REFERENCE_LENGTH_PX, REFERENCE_WIDTH_PX, CarNet
from scipy.spatial import cKDTree
from torch import nn
from torch.nn.utils.fusion import fuse_conv_bn_eval

from covertool.extract.detectors.network import NetworkDetector
from data import DOUBTFUL_FROM, MEAN, SCALE, Tile, read_tiles

GSD_M = 0.20
MATCH_PX = 1.5 / GSD_M


def folded(network: CarNet) -> CarNet:
    """Return the network with each batch normalisation folded into its convolution."""
    network.eval()
    for module in network.modules():
        if isinstance(module, nn.Sequential):
            for place in range(len(module) - 1):
                first, second = module[place], module[place + 1]
                if isinstance(first, nn.Conv2d) and isinstance(second, nn.BatchNorm2d):
                    module[place] = fuse_conv_bn_eval(first, second)
                    module[place + 1] = nn.Identity()
    return network


def write_onnx(network: CarNet, path: Path) -> None:
    """Write the network as ONNX with a free height and width."""
    sample = torch.zeros(1, 3, 256, 256)
    free = {2: "height", 3: "width"}
    torch.onnx.export(
        network,
        (sample,),
        str(path),
        dynamo=False,
        opset_version=13,
        input_names=["image"],
        output_names=["maps"],
        dynamic_axes={"image": free, "maps": {2: "rows", 3: "columns"}},
    )
    onnx.checker.check_model(onnx.load(path))


def pairs(detector: NetworkDetector, tiles: list[Tile]) -> tuple[list[tuple[float, int]], int]:
    """Return (score, 1 for a hit, 0 for a false alarm) of all detections, and the true cars.

    A detection of a car at a doubtful or a heavy vehicle counts neither way.
    """
    scored: list[tuple[float, int]] = []
    cars = 0
    for image, labels in tiles:
        found = detector.detect(image, np.ones(image.shape[:2], dtype=bool))
        found = found.take(found.kind == "car")
        certain = (labels[:, 5] == 0) & (labels[:, 6] < DOUBTFUL_FROM)
        truth, doubtful = labels[certain], labels[~certain]
        cars += len(truth)
        taken: set[int] = set()
        tree = cKDTree(truth[:, :2]) if len(truth) else None
        for x, y, score in zip(found.x_px, found.y_px, found.score, strict=True):
            near = tree.query_ball_point((x, y), MATCH_PX) if tree else []
            free = [i for i in near if i not in taken]
            if free:
                taken.add(min(free, key=lambda i: np.hypot(*(truth[i, :2] - (x, y)))))
                scored.append((score, 1))
            elif not _excused(x, y, doubtful, image.shape[0]):
                scored.append((score, 0))
    return sorted(scored, reverse=True), cars


def _excused(x: float, y: float, doubtful: np.ndarray, side: int) -> bool:
    if min(x, y, side - x, side - y) < 0.8 / GSD_M:
        return True
    near = np.hypot(doubtful[:, 0] - x, doubtful[:, 1] - y)
    return bool((near < np.maximum(doubtful[:, 3] / 2, MATCH_PX)).any())


def best_threshold(detector: NetworkDetector, tiles: list[Tile]) -> tuple[float, float]:
    """Return the score threshold of the highest F1 on rendered tiles, and that F1."""
    scored, cars = pairs(detector, tiles)
    hits = np.cumsum([hit for _, hit in scored])
    f1 = 2 * hits / (np.arange(1, len(scored) + 1) + cars)
    best = int(np.argmax(f1))
    return round(float(scored[best][0]), 3), float(f1[best])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("weights", type=Path)
    parser.add_argument("validation", type=Path, help="folder of rendered tiles kept apart")
    parser.add_argument("--into", type=Path, required=True, help="folder of cars.onnx, cars.json")
    options = parser.parse_args()
    saved = torch.load(options.weights, weights_only=True)
    network = CarNet()
    network.load_state_dict(saved["weights"])
    write_onnx(folded(network), options.into / "cars.onnx")
    tiles = read_tiles([options.validation])
    card = {
        "name": "covertool cars",
        "gsd_m": GSD_M,
        "threshold": 0.5,
        "tta_threshold": 0.5,
        "mean": MEAN,
        "scale": SCALE,
        "length_px": REFERENCE_LENGTH_PX,
        "width_px": REFERENCE_WIDTH_PX,
    }
    for key, tta in (("threshold", False), ("tta_threshold", True)):
        detector = NetworkDetector(
            (options.into / "cars.onnx").read_bytes(),
            str(card["name"]), GSD_M, 0.5, 0.5, MEAN, SCALE,
            REFERENCE_LENGTH_PX, REFERENCE_WIDTH_PX, tta=tta,
        )  # fmt: skip
        card[key], f1 = best_threshold(detector, tiles)
        print(f"{key} {card[key]} with F1 {f1:.3f} on {len(tiles)} rendered tiles")
    (options.into / "cars.json").write_text(json.dumps(card, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

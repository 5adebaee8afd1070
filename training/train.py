"""Train the car network on rendered tiles and keep the averaged weights."""

from __future__ import annotations

import argparse
import copy
import time
from pathlib import Path

import cv2
import numpy as np
import torch
from model import ANGLE, HEAT, OFFSET, CarNet
from torch import Tensor
from torch.nn import functional
from torch.utils.data import DataLoader

from data import Crops, read_tiles


def heat_loss(logits: Tensor, heat: Tensor, counts: Tensor) -> Tensor:
    """Return the focal loss of centre heatmaps (penalty reduced near centres), per centre."""
    chance = torch.sigmoid(logits).clamp(1e-5, 1 - 1e-5)
    centre = (heat >= 0.999).float()
    hit = centre * (1 - chance) ** 2 * torch.log(chance)
    miss = (1 - centre) * (1 - heat) ** 4 * chance**2 * torch.log(1 - chance)
    return -((hit + miss) * counts).sum() / centre.sum().clamp(min=1)


def shape_loss(maps: Tensor, shape: Tensor, weight: Tensor) -> Tensor:
    """Return the weighted errors of offset, size and angle."""
    total = weight.sum().clamp(min=1)
    errors = functional.smooth_l1_loss(maps, shape, beta=0.1, reduction="none") * weight
    offset, size, angle = (
        errors[:, part].sum() / total for part in (slice(0, 2), slice(2, 4), slice(4, 6))
    )
    return offset + 0.7 * size + 0.7 * angle


def learning_rate(step: int, steps: int, peak: float) -> float:
    """Return a rate that warms up over 4 % of the steps and falls along a cosine."""
    warm = max(1, steps // 25)
    if step < warm:
        return peak * (step + 1) / warm
    return peak * 0.5 * (1 + np.cos(np.pi * (step - warm) / (steps - warm))) + peak * 0.004


def save(network: CarNet, path: Path, **facts: object) -> None:
    """Write the weights and what they were made from, atomically."""
    partial = path.with_suffix(".part")
    torch.save({"weights": network.state_dict(), **facts}, partial)
    partial.replace(path)


def load(network: CarNet, path: Path) -> int:
    """Fill a network with saved weights; return the steps that they have seen."""
    saved = torch.load(path, weights_only=True)
    network.load_state_dict(saved["weights"])
    return int(saved["steps"])


def train(options: argparse.Namespace) -> None:
    """Run the training loop."""
    torch.manual_seed(options.seed)
    torch.set_num_threads(options.threads)
    cv2.setNumThreads(1)
    tiles = read_tiles(options.tiles)
    network = CarNet().to(memory_format=torch.channels_last)
    done = load(network, options.weights) if options.resume else 0
    averaged = copy.deepcopy(network)
    optimiser = torch.optim.AdamW(network.parameters(), lr=options.rate, weight_decay=1e-3)
    crops = Crops(tiles, options.steps * options.batch, options.side, options.seed + done)
    # A process of its own makes the crops: a thread would wait for the interpreter's lock.
    batches = DataLoader(crops, options.batch, num_workers=1, prefetch_factor=6)
    started, smooth = time.monotonic(), np.zeros(2)
    for step, (image, heat, shape, weight) in enumerate(batches):
        for group in optimiser.param_groups:
            group["lr"] = learning_rate(step, options.steps, options.rate)
        with torch.autocast("cpu", torch.bfloat16, enabled=options.bfloat16):
            maps = network(image.contiguous(memory_format=torch.channels_last)).float()
        centres = heat_loss(maps[:, HEAT], heat, weight[:, :1])
        shapes = shape_loss(maps[:, OFFSET.start : ANGLE.stop], shape, weight[:, 1:])
        optimiser.zero_grad(set_to_none=True)
        (centres + shapes).backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 5.0)
        optimiser.step()
        _average(averaged, network, min(0.998, (step + 1) / (step + 20)))
        smooth = 0.98 * smooth + 0.02 * np.array([centres.item(), shapes.item()])
        if (step + 1) % 100 == 0:
            seconds = time.monotonic() - started
            losses = smooth / (1 - 0.98 ** (step + 1))
            print(
                f"{step + 1} {seconds:.0f} s heat {losses[0]:.3f} shape {losses[1]:.3f}", flush=True
            )
        if (step + 1) % 500 == 0 or step + 1 == options.steps:
            save(
                averaged,
                options.weights,
                seed=options.seed,
                steps=done + step + 1,
                tiles=len(tiles),
            )


def _average(averaged: CarNet, network: CarNet, keep: float) -> None:
    with torch.no_grad():
        ours = averaged.state_dict()
        for name, value in network.state_dict().items():
            if value.dtype.is_floating_point:
                ours[name].lerp_(value, 1 - keep)
            else:
                ours[name].copy_(value)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tiles", type=Path, nargs="+", help="folders of rendered tiles")
    parser.add_argument("--weights", type=Path, default=Path("car.pt"))
    parser.add_argument("--steps", type=int, default=12000)
    parser.add_argument("--resume", action="store_true", help="go on from --weights")
    parser.add_argument("--batch", type=int, default=8)
    parser.add_argument("--side", type=int, default=256, help="side of the crops in pixels")
    parser.add_argument("--rate", type=float, default=2.5e-3)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--bfloat16", action="store_true", help="faster where the CPU has AMX")
    train(parser.parse_args())


if __name__ == "__main__":
    main()

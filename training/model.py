"""The network: a small U of 3 x 3 convolutions with stride 4 and one output of eight channels."""

from __future__ import annotations

import torch
from torch import Tensor, nn

STRIDE = 4
REFERENCE_LENGTH_PX, REFERENCE_WIDTH_PX = 22.0, 9.2
"""Sizes are predicted as logarithms of the ratio to these (4.4 m x 1.84 m at 0.20 m)."""

HEAT, OFFSET, SIZE, ANGLE = slice(0, 2), slice(2, 4), slice(4, 6), slice(6, 8)
"""Channels: centre logits of car, truck; offset in cells; log size; cos, sin of twice theta."""


def _unit(inputs: int, outputs: int, stride: int = 1, kernel: int = 3) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, kernel, stride, kernel // 2, bias=False),
        nn.BatchNorm2d(outputs),
        nn.ReLU(inplace=True),
    )


class Residual(nn.Module):
    """Two convolutions beside an identity."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.first = _unit(channels, channels)
        self.second = nn.Sequential(
            nn.Conv2d(channels, channels, 3, 1, 1, bias=False), nn.BatchNorm2d(channels)
        )

    def forward(self, x: Tensor) -> Tensor:
        return torch.relu(x + self.second(self.first(x)))


class CarNet(nn.Module):
    """Image (N, 3, H, W), normalised, to (N, 8, H/4, W/4); H and W are multiples of 16."""

    def __init__(self, widths: tuple[int, int, int, int] = (16, 28, 56, 96)) -> None:
        super().__init__()
        stem, fine, middle, coarse = widths
        self.stem = nn.Sequential(_unit(3, stem, 2), _unit(stem, fine, 2), Residual(fine))
        self.down = nn.Sequential(_unit(fine, middle, 2), Residual(middle))
        self.bottom = nn.Sequential(
            _unit(middle, coarse, 2),
            Residual(coarse),
            Residual(coarse),
            _unit(coarse, middle, 1, 1),
        )
        self.join_middle = nn.Sequential(_unit(middle, middle), _unit(middle, fine, 1, 1))
        self.join_fine = _unit(fine, fine)
        self.head = nn.Conv2d(fine, 8, 1)
        self.grow = nn.Upsample(scale_factor=2, mode="nearest")
        with torch.no_grad():
            assert self.head.bias is not None
            self.head.bias[HEAT] = -4.0

    def forward(self, x: Tensor) -> Tensor:
        fine = self.stem(x)
        middle = self.down(fine)
        middle = middle + self.grow(self.bottom(middle))
        joined: Tensor = self.head(self.join_fine(fine + self.grow(self.join_middle(middle))))
        return joined

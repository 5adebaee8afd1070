"""Colours and textures: paint, asphalt, paving, green, roofs."""

from __future__ import annotations

import colorsys

import cv2
import numpy as np

from renderer.canvas import Image

Rng = np.random.Generator


def grey(rng: Rng, low: float, high: float, tint: float = 0.02) -> Image:
    """Return a grey between two levels with a slight tint."""
    return np.clip(rng.uniform(low, high) + rng.normal(0, tint, 3), 0, 1).astype(np.float32)


def hsv(hue: float, saturation: float, value: float) -> Image:
    """Return a colour of given hue, saturation and value, each 0 to 1."""
    return np.array(colorsys.hsv_to_rgb(hue % 1, saturation, value), np.float32)


def car_paint(rng: Rng) -> Image:
    """Return the paint of a car: mostly black, white, grey and silver, some blue and red."""
    kind = rng.choice(
        ["black", "white", "grey", "silver", "blue", "red", "other"],
        p=[0.23, 0.21, 0.14, 0.13, 0.12, 0.10, 0.07],
    )
    if kind == "black":
        return grey(rng, 0.02, 0.14, 0.012)
    if kind == "white":
        return grey(rng, 0.78, 1.0, 0.015)
    if kind == "grey":
        return grey(rng, 0.15, 0.42, 0.015)
    if kind == "silver":
        return grey(rng, 0.45, 0.74, 0.015)
    if kind == "blue":
        return hsv(rng.uniform(0.55, 0.68), rng.uniform(0.35, 0.85), rng.uniform(0.15, 0.6))
    if kind == "red":
        return hsv(rng.uniform(-0.04, 0.02), rng.uniform(0.6, 0.9), rng.uniform(0.3, 0.85))
    return hsv(rng.uniform(0, 1), rng.uniform(0.2, 0.9), rng.uniform(0.2, 0.9))


def noise(rng: Rng, side: int, grain_px: float, octaves: int = 1) -> Image:
    """Return a (side, side) field of smooth noise with deviation near 1."""
    field = np.zeros((side, side), np.float32)
    for octave in range(octaves):
        cells = max(2, int(side / (grain_px / 2**octave)) + 2)
        coarse = rng.standard_normal((min(cells, side), min(cells, side)), np.float32)
        wide = cv2.resize(coarse, (side, side), interpolation=cv2.INTER_LINEAR)
        field += wide / 2**octave
    return field / max(float(field.std()), 1e-6)


def textured(rng: Rng, side: int, colour: Image, grains: dict[float, float]) -> Image:
    """Return a (side, side, 3) texture: a colour with noise of {grain in pixels: deviation}."""
    relief = np.zeros((side, side), np.float32)
    for grain, deviation in grains.items():
        relief += noise(rng, side, grain) * np.float32(deviation)
    return relief[..., None] + colour.astype(np.float32)


def asphalt(rng: Rng, side: int) -> Image:
    """Return asphalt, from fresh black to bright concrete, with patches and stains."""
    base = grey(rng, 0.18, 0.68, 0.018)
    texture = textured(
        rng, side, base, {3: rng.uniform(0.004, 0.025), 60: 0.012, 200: rng.uniform(0.005, 0.03)}
    )
    if rng.random() < 0.2:
        damp = np.clip(noise(rng, side, rng.uniform(60, 200), 2), 0, 1.5)[..., None]
        texture = texture * (1 - rng.uniform(0.1, 0.4) * np.minimum(damp, 1))
    return texture


def paving(rng: Rng, side: int) -> Image:
    """Return paving: grey, sandy or red slabs, with joints on some."""
    hue, saturation = rng.choice([0.08, 0.02, 0.6]), rng.uniform(0, 0.28)
    base = hsv(hue + rng.normal(0, 0.02), saturation, rng.uniform(0.4, 0.88))
    texture = textured(rng, side, base, {3: rng.uniform(0.005, 0.03), 80: 0.02})
    if rng.random() < 0.4:
        pitch = int(rng.integers(4, 14))
        texture[::pitch] *= rng.uniform(0.86, 0.97)
        texture[:, :: int(pitch * rng.integers(1, 3))] *= rng.uniform(0.86, 0.97)
    return texture


def green(rng: Rng, side: int) -> Image:
    """Return grass, meadow or dry ground; half of it rough: bald patches, tufts, low plants."""
    base = hsv(rng.normal(0.23, 0.05), rng.uniform(0.15, 0.6), rng.uniform(0.2, 0.65))
    grains = {3: rng.uniform(0.01, 0.04), 12: 0.02, 90: rng.uniform(0.01, 0.05)}
    texture = textured(rng, side, base, grains)
    if rng.random() < 0.5:
        other = hsv(rng.normal(0.08, 0.05), rng.uniform(0.15, 0.5), rng.uniform(0.2, 0.7))
        bald = np.clip(noise(rng, side, rng.uniform(15, 120), 3) - rng.uniform(-0.5, 1), 0, 1)
        texture += bald[..., None] * (other - texture)
    if rng.random() < 0.4:
        tufts = np.clip(noise(rng, side, rng.uniform(6, 18), 2), -1.5, 1.5)[..., None]
        texture = texture * (1 + rng.uniform(0.1, 0.35) * tufts)
    return texture


def soil(rng: Rng, side: int) -> Image:
    """Return bare soil or gravel."""
    base = hsv(rng.normal(0.09, 0.02), rng.uniform(0.08, 0.4), rng.uniform(0.35, 0.8))
    return textured(rng, side, base, {3: rng.uniform(0.02, 0.05), 20: 0.02, 120: 0.03})


def water(rng: Rng, side: int) -> Image:
    """Return water with ripples."""
    base = hsv(rng.uniform(0.35, 0.65), rng.uniform(0.1, 0.6), rng.uniform(0.12, 0.5))
    return textured(rng, side, base, {5: rng.uniform(0.003, 0.03), 60: 0.015})


def roof_colour(rng: Rng) -> Image:
    """Return the colour of a roof: tiles, slate, bitumen, gravel or metal."""
    kind = rng.random()
    if kind < 0.4:
        return hsv(rng.normal(0.03, 0.02), rng.uniform(0.3, 0.75), rng.uniform(0.3, 0.85))
    return grey(rng, 0.12, 0.85, 0.03)

"""Roofs as they are in Ireland: grey slate and brown tiles, the same along a street."""

from __future__ import annotations

import numpy as np
from renderer.canvas import Canvas
from renderer.palette import Rng, hsv

_SLATE, _CONCRETE_TILE, _CLAY_TILE = range(3)
_SHARES = (0.5, 0.3, 0.2)


def house_roof(street: Rng, house: Rng) -> np.ndarray:
    """Return a roof's colour: the material is the street's, the tone a little the house's own."""
    material = street.choice(3, p=_SHARES)
    tone = float(street.uniform(-0.03, 0.03) + house.normal(0.0, 0.02))
    if material == _SLATE:
        return hsv(0.6, 0.06, 0.40 + tone)
    if material == _CONCRETE_TILE:
        return hsv(0.06, 0.18, 0.42 + tone)
    return hsv(0.03, 0.36, 0.46 + tone)


def flat_roof(house: Rng) -> np.ndarray:
    """Return the colour of a flat roof: bitumen, gravel or metal."""
    return hsv(0.58, 0.04, float(house.uniform(0.45, 0.72)))


def recolour(canvas: Canvas, outline_m: np.ndarray, colour: np.ndarray) -> None:
    """Give a drawn roof another colour; its light, tiles and furniture stay, without their hues."""
    found = canvas.mask(outline_m)
    if found is None:
        return
    window, stencil = found
    part = canvas.image[window]
    grey = part.astype(np.float32).mean(axis=2)
    middle = max(float(np.median(grey[stencil > 127])) if (stencil > 127).any() else 1.0, 1.0)
    relief = np.clip(grey / middle, 0.45, 1.4)[..., None]
    weight = (stencil / np.float32(255))[..., None]
    part[...] = np.clip(part + weight * (255 * relief * colour - part), 0, 255)

"""The camera: source GSD, blur, haze, tone, noise, JPEG, false colour, and the working GSD."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from renderer.canvas import Image
from renderer.palette import Rng, noise

WORKING_GSD_M = 0.20


def _resize(image: Image, side: int) -> Image:
    """Resample to a square of a given side: by area when shrinking, linearly when growing."""
    shrinks = side < image.shape[0]
    how = cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
    return cv2.resize(image, (side, side), interpolation=how)


def _haze(image: Image, rng: Rng) -> Image:
    """Mix in the light of the air, more in some places."""
    amount = rng.uniform(0.05, 0.45) if rng.random() < 0.4 else rng.uniform(0, 0.06)
    air = np.float32(rng.uniform(0.6, 0.95)) * np.float32([0.95, 0.98, 1.0])
    veil = amount * np.clip(1 + 0.15 * noise(rng, image.shape[0], 300), 0, 2)[..., None]
    return image * (1 - veil) + air * veil


def _tone(image: Image, rng: Rng) -> Image:
    """Change exposure, contrast, gamma, white balance and saturation."""
    image = np.clip(image, 0, 1) ** np.float32(rng.uniform(0.65, 1.45))
    level = float(image.mean())
    exposed = rng.uniform(0.27, 0.60) if rng.random() < 0.9 else rng.uniform(0.12, 0.75)
    gain = np.float32((exposed / max(level, 0.02)) ** rng.uniform(0.6, 1.0))
    image = (image - level) * np.float32(rng.uniform(0.65, 1.25)) * gain + level * gain
    cast = rng.normal(0, 0.05, 3).astype(np.float32)
    image = image * (1 + cast)
    luma = image @ np.float32([0.3, 0.59, 0.11])
    return luma[..., None] + (image - luma[..., None]) * np.float32(rng.uniform(0.35, 1.35))


def _bands(image: Image, rng: Rng) -> Image:
    """Sometimes make the picture grey, or false colour (near infrared shown as red)."""
    kind = rng.random()
    if kind < 0.07:
        luma = image @ np.float32([0.3, 0.59, 0.11])
        return np.repeat(luma[..., None], 3, axis=2)
    if kind < 0.15:
        leafy = np.clip(image[..., 1] - 0.5 * (image[..., 0] + image[..., 2]), 0, 1)
        infrared = np.clip(image.mean(axis=2) + rng.uniform(2, 6) * leafy, 0, 1)
        return np.stack([infrared, image[..., 0], image[..., 1]], axis=2)
    return image


def _sharpen(image: Image, rng: Rng) -> Image:
    """Overshoot edges as consumer cameras do."""
    soft = cv2.GaussianBlur(image, (0, 0), rng.uniform(0.7, 1.6))
    return image + np.float32(rng.uniform(0.3, 1.6)) * (image - soft)


def photograph(
    image: Image, scene_gsd_m: float, output_gsd_m: float, rng: Rng
) -> tuple[npt.NDArray[np.uint8], float]:
    """Return the drawn scene as a camera delivers it, resampled to about a given GSD, and that GSD.

    The GSD returned is the exact one: whole pixels fit the picture.
    """
    extent_m = image.shape[0] * scene_gsd_m
    source_gsd_m = float(
        rng.choice([rng.uniform(0.1, 0.14), rng.uniform(0.12, 0.2), rng.uniform(0.2, 0.3)])
    )
    image = cv2.GaussianBlur(image, (0, 0), rng.uniform(0.25, 1.0) * source_gsd_m / scene_gsd_m)
    image = _resize(image, round(extent_m / source_gsd_m))
    image = _bands(_tone(_haze(image, rng), rng), rng)
    if rng.random() < 0.45:
        image = _sharpen(image, rng)
    if rng.random() < 0.15:
        kernel = np.zeros((5, 5), np.float32)
        kernel[2, 1:4] = 1 / 3
        image = cv2.filter2D(image, -1, kernel if rng.random() < 0.5 else kernel.T)
    grain = rng.standard_normal((*image.shape[:2], 1), np.float32) * rng.uniform(0, 0.02)
    speckle = rng.standard_normal(image.shape, np.float32) * rng.uniform(0, 0.012)
    picture = np.clip((image + grain + speckle) * 255, 0, 255).astype(np.uint8)
    if rng.random() < 0.75:
        quality = [int(cv2.IMWRITE_JPEG_QUALITY), int(rng.integers(35, 96))]
        _, packed = cv2.imencode(".jpg", picture, quality)
        picture = cv2.imdecode(packed, cv2.IMREAD_COLOR)
    side = round(extent_m / output_gsd_m)
    how = cv2.INTER_AREA if side < picture.shape[0] else cv2.INTER_LINEAR
    return cv2.resize(picture, (side, side), interpolation=how), extent_m / side

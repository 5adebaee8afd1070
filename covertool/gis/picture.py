"""Pictures without a place on the map, written whole as PNG."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from covertool.errors import ComputationError
from covertool.gis import guard
from covertool.gis.formats import Format

PICTURE_FORMATS = (Format("PNG", "PNG", (".png",)),)


def write_picture(path: str | Path, rgb: npt.NDArray[np.uint8], *, overwrite: bool = False) -> None:
    """Write (H, W, 3) colours as a PNG.

    Raises
    ------
    FileError
        When the path cannot be written or its extension is not .png.
    """
    import cv2

    checked, _ = guard.output_file(path, PICTURE_FORMATS, overwrite=overwrite)
    done, encoded = cv2.imencode(".png", cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR))
    if not done:
        raise ComputationError("the picture cannot be encoded", str(checked), "draw it smaller")
    with guard.replacing(checked) as temporary:
        temporary.write_bytes(encoded.tobytes())

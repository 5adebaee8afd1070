"""The user's own detector: a YOLO-OBB network exported to ONNX, at the GSD that the user names.

Its output is ``[1, 4 + nc + 1, N]``: for each of N candidates the centre, the width and the height
in pixels of the network's input, a score for each of nc classes, and the angle in radians by which
the width axis is turned clockwise from the picture's x axis. The classes' names stand in the
file's metadata.
https://docs.ultralytics.com/tasks/obb/
"""

from __future__ import annotations

import ast
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from covertool.errors import FileError
from covertool.extract.detectors.blocks import Block, blocks
from covertool.extract.detectors.nms import without_doubles
from covertool.extract.detectors.onnx_metadata import onnx_metadata
from covertool.extract.detectors.protocol import MIN_HALO_PX, Detections, Mask, Pixels

_CARS = ("car", "vehicle", "van", "auto", "suv", "pickup")
_TRUCKS = ("truck", "large vehicle", "large-vehicle", "large_vehicle", "lorry", "trailer")
_BUSES = ("bus", "coach")
_FLOOR = 0.05
_DEFAULT_INPUT_PX = 1024
_FILL = 114


def kind_of(name: str) -> str | None:
    """Return what a class of this name counts as: ``car``, ``truck``, ``bus``, or None.

    >>> [kind_of(name) for name in ("small vehicle", "Large-Vehicle", "bus", "plane")]
    ['car', 'truck', 'bus', None]
    """
    plain = name.strip().lower()
    for kind, words in (("bus", _BUSES), ("truck", _TRUCKS), ("car", _CARS)):
        if any(word in plain for word in words):
            return kind
    return None


@dataclass(frozen=True)
class YoloObbDetector:
    """A YOLO-OBB model run with OpenCV's ``dnn`` module on blocks of its own input size.

    Parameters
    ----------
    model : the ONNX file as bytes
    name : the file's name, for logs, provenance and errors
    gsd_m : ground size of the pixels that the model was trained for
    threshold : the score from which on a detection counts
    """

    model: bytes = field(repr=False)
    name: str
    gsd_m: float
    threshold: float = 0.25

    def __post_init__(self) -> None:
        if not any(self._kinds):
            known = ", ".join(self._names.values()) or "none"
            raise FileError(
                f"the model knows no vehicles (its classes: {known})",
                self.name,
                "pass a model with a class called car, vehicle, truck or bus",
            )

    def __getstate__(self) -> dict[str, Any]:
        """Leave the loaded network behind: a worker loads its own."""
        return {key: value for key, value in self.__dict__.items() if key != "_net"}

    @property
    def halo_px(self) -> int:
        """Return the width of the rim whose detections are not to be trusted."""
        return MIN_HALO_PX

    @cached_property
    def _metadata(self) -> dict[str, str]:
        return onnx_metadata(self.model, self.name)

    @cached_property
    def _names(self) -> dict[int, str]:
        """Return the classes' names by number."""
        text = self._metadata.get("names", "")
        try:
            names = ast.literal_eval(text)
            pairs = names.items() if isinstance(names, dict) else enumerate(names)
            return {int(number): str(name) for number, name in pairs}
        except (ValueError, SyntaxError, TypeError) as error:
            raise FileError(
                "the model's metadata holds no class names",
                self.name,
                "export it with its metadata: yolo export format=onnx",
            ) from error

    @cached_property
    def _kinds(self) -> list[str | None]:
        return [kind_of(self._names.get(i, "")) for i in range(max(self._names, default=-1) + 1)]

    @cached_property
    def _input_px(self) -> int:
        """Return the side of the model's square input."""
        try:
            size = ast.literal_eval(self._metadata.get("imgsz", str(_DEFAULT_INPUT_PX)))
            sides = {int(side) for side in (size if isinstance(size, list | tuple) else [size])}
        except (ValueError, SyntaxError, TypeError):
            sides = set()
        if len(sides) != 1 or min(sides) <= 2 * MIN_HALO_PX:
            raise FileError(
                f"the model's input is not a square of more than {2 * MIN_HALO_PX} pixels",
                self.name,
                "export it with one imgsz, for example imgsz=1024",
            )
        return sides.pop()

    @cached_property
    def _net(self) -> Any:
        import cv2

        try:
            return cv2.dnn.readNetFromONNX(np.frombuffer(self.model, np.uint8))
        except cv2.error as error:
            mend = "export it with a fixed input size and a lower opset, for example opset=12"
            raise FileError("OpenCV cannot read the model", self.name, mend) from error

    def detect(self, rgb: Pixels, valid: Mask) -> Detections:
        """Return the vehicles of a picture at the model's GSD, best first."""
        height, width = valid.shape
        parts = [
            self._owned(rgb, block) for block in blocks(height, width, self._input_px, MIN_HALO_PX)
        ]
        found = Detections.concatenate(parts)
        seen = valid[found.y_px.astype(int), found.x_px.astype(int)]
        return without_doubles(found.take(seen), self.gsd_m)

    def _owned(self, rgb: Pixels, block: Block) -> Detections:
        """Return the detections whose centre the block owns, in pixels of the picture."""
        size = block.size
        part = rgb[block.y0 : block.y0 + size, block.x0 : block.x0 + size]
        padding = ((0, size - part.shape[0]), (0, size - part.shape[1]), (0, 0))
        found = self._decode(self._run(np.pad(part, padding, constant_values=_FILL)))
        x, y = found.x_px + block.x0, found.y_px + block.y0
        placed = replace(found, x_px=x, y_px=y)
        inside = (x >= block.own_x[0]) & (x < block.own_x[1])
        return placed.take(inside & (y >= block.own_y[0]) & (y < block.own_y[1]))

    def _run(self, rgb: Pixels) -> npt.NDArray[np.float64]:
        """Return the (4 + nc + 1, N) output for one block."""
        import cv2

        self._net.setInput(cv2.dnn.blobFromImage(rgb, 1 / 255))
        output = np.asarray(self._net.forward(), dtype=np.float64)
        rows = 4 + len(self._kinds) + 1
        if output.ndim != 3 or output.shape[:2] != (1, rows):
            raise FileError(
                f"the model's output has the shape {output.shape}, not (1, {rows}, N)",
                self.name,
                "export an oriented-box model without NMS: yolo export format=onnx nms=False",
            )
        candidates: npt.NDArray[np.float64] = output[0]
        return candidates

    def _decode(self, output: npt.NDArray[np.float64]) -> Detections:
        """Return the candidates that are vehicles; the longer side is the length."""
        chosen = [i for i, kind in enumerate(self._kinds) if kind is not None]
        scores = output[4:-1]
        best = np.argmax(scores, axis=0)
        score = scores.max(axis=0)
        likely = np.isin(best, chosen) & (score >= _FLOOR)
        x, y, along_x, along_y = output[:4, likely]
        upright = along_y > along_x
        heading = np.degrees(output[-1, likely]) + np.where(upright, 180.0, 90.0)
        return Detections.of_cars(
            x,
            y,
            heading,
            np.maximum(along_x, along_y),
            np.minimum(along_x, along_y),
            np.clip(score[likely], 0, 1),
            np.array(self._kinds, dtype=object)[best[likely]],
        )

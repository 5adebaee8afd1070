"""Running the shipped network: with onnxruntime where it is installed, else with OpenCV.

Both give the same maps to about 1e-5. onnxruntime takes about two thirds of OpenCV's time.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec

import numpy as np
import numpy.typing as npt

Floats32 = npt.NDArray[np.float32]
Network = Callable[[Floats32], Floats32]
"""From a picture as (1, 3, H, W) to the maps as (1, M, H', W')."""


def load_network(weights: bytes) -> Network:
    """Return a function that runs the network of an ONNX file of one input and one output."""
    return _by_onnxruntime(weights) if find_spec("onnxruntime") else by_opencv(weights)


def _by_onnxruntime(weights: bytes) -> Network:
    """Return a function that runs the network by onnxruntime, on one thread."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    # Processes share the work (--workers); threads inside them would only get in each other's way.
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    session = onnxruntime.InferenceSession(weights, options, providers=["CPUExecutionProvider"])
    name = session.get_inputs()[0].name

    def run(picture: Floats32) -> Floats32:
        maps: Floats32 = session.run(None, {name: picture})[0]
        return maps

    return run


def by_opencv(weights: bytes) -> Network:
    """Return a function that runs the network by OpenCV's ``dnn`` module."""
    import cv2

    network = cv2.dnn.readNetFromONNX(np.frombuffer(weights, np.uint8))

    def run(picture: Floats32) -> Floats32:
        network.setInput(picture)
        return np.array(network.forward(), dtype=np.float32)

    return run

"""A tiny ONNX file written byte by byte, so that the tests need no package for it."""

from __future__ import annotations

import struct

import numpy as np

_FLOAT, _INT64 = 1, 7


def _varint(value: int) -> bytes:
    out = bytearray()
    while value >= 0x80:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*out, value])


def _number(field: int, value: int) -> bytes:
    return _varint(field << 3) + _varint(value)


def _chunk(field: int, content: bytes | str) -> bytes:
    data = content.encode() if isinstance(content, str) else content
    return _varint(field << 3 | 2) + _varint(len(data)) + data


def _tensor(name: str, values: np.ndarray) -> bytes:
    kind = _FLOAT if values.dtype == np.float32 else _INT64
    dims = b"".join(_number(1, size) for size in values.shape)
    return dims + _number(2, kind) + _chunk(8, name) + _chunk(9, values.tobytes())


def _value(name: str, shape: tuple[int, ...]) -> bytes:
    dims = b"".join(_chunk(1, _number(1, size)) for size in shape)
    return _chunk(1, name) + _chunk(2, _chunk(1, _number(1, _FLOAT) + _chunk(2, dims)))


def _node(kind: str, inputs: list[str], output: str) -> bytes:
    named = b"".join(_chunk(1, name) for name in inputs)
    return named + _chunk(2, output) + _chunk(3, output) + _chunk(4, kind)


def yolo_like(candidates: np.ndarray, metadata: dict[str, str], input_px: int) -> bytes:
    """Return a model with output [1, rows, N]: the candidates, scores times the mean of red.

    Rows 4 to the last but one of `candidates` are scores. A pooled pixel goes through one
    convolution whose bias holds the boxes and whose weights hold the scores.
    """
    rows, count = candidates.shape
    weights = np.zeros((rows, count, 3, 1, 1), np.float32)
    weights[4:-1, :, 0, 0, 0] = candidates[4:-1]
    bias = candidates.astype(np.float32).copy()
    bias[4:-1] = 0
    graph = (
        _chunk(1, _node("GlobalAveragePool", ["images"], "mean"))
        + _chunk(1, _node("Conv", ["mean", "weights", "bias"], "flat"))
        + _chunk(1, _node("Reshape", ["flat", "shape"], "output0"))
        + _chunk(2, "tiny")
        + _chunk(5, _tensor("weights", weights.reshape(rows * count, 3, 1, 1)))
        + _chunk(5, _tensor("bias", bias.reshape(rows * count)))
        + _chunk(5, _tensor("shape", np.array([1, rows, count], np.int64)))
        + _chunk(11, _value("images", (1, 3, input_px, input_px)))
        + _chunk(12, _value("output0", (1, rows, count)))
    )
    pairs = b"".join(
        _chunk(14, _chunk(1, key) + _chunk(2, value)) for key, value in metadata.items()
    )
    opset = _chunk(8, _chunk(1, "") + _number(2, 13))
    return _number(1, 8) + _chunk(2, "tests") + _chunk(7, graph) + opset + pairs


def fixed_width_field() -> bytes:
    """Return a top-level field of eight fixed bytes, which a reader has to step over."""
    return _varint(100 << 3 | 1) + struct.pack("<d", 1.5)

"""The metadata of an ONNX file, read without the onnx package.

An ONNX file is one protocol-buffer message (``ModelProto``). Its field 14, ``metadata_props``,
holds pairs of a key (field 1) and a value (field 2). Only the outermost level has to be walked.
https://protobuf.dev/programming-guides/encoding/
"""

from __future__ import annotations

from collections.abc import Iterator

from covertool.errors import FileError

_METADATA_PROPS, _KEY, _VALUE = 14, 1, 2
_VARINT, _FIXED64, _LENGTH, _FIXED32 = 0, 1, 2, 5


def _varint(data: memoryview, at: int) -> tuple[int, int]:
    """Return the number of variable length that starts at a place, and where it ends."""
    value = shift = 0
    while True:
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, at
        shift += 7


def _fields(data: memoryview) -> Iterator[tuple[int, memoryview]]:
    """Yield (field number, content) of the fields of a message that have a length."""
    at = 0
    while at < len(data):
        tag, at = _varint(data, at)
        wire = tag & 7
        if wire == _VARINT:
            _, at = _varint(data, at)
        elif wire == _FIXED64:
            at += 8
        elif wire == _FIXED32:
            at += 4
        elif wire == _LENGTH:
            length, at = _varint(data, at)
            if at + length > len(data):
                raise IndexError("a field is longer than the file")
            yield tag >> 3, data[at : at + length]
            at += length
        else:
            raise IndexError(f"wire type {wire}")


def onnx_metadata(model: bytes, where: str) -> dict[str, str]:
    """Return the metadata pairs of an ONNX file.

    Parameters
    ----------
    model : the file's bytes
    where : the file's name, for the error

    Raises
    ------
    FileError
        When the bytes are not an ONNX file.

    Examples
    --------
    >>> onnx_metadata(b"", "empty.onnx")
    {}
    """
    pairs: dict[str, str] = {}
    try:
        for number, content in _fields(memoryview(model)):
            if number == _METADATA_PROPS:
                pair = {part: bytes(text).decode("utf-8") for part, text in _fields(content)}
                pairs[pair.get(_KEY, "")] = pair.get(_VALUE, "")
    except (IndexError, UnicodeDecodeError) as error:
        mend = "pass a model that was exported to ONNX"
        raise FileError("the file is not an ONNX model", where, mend) from error
    return pairs

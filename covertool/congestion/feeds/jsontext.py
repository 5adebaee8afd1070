"""JSON feeds: read whole, within a cap, with every fault told."""

from __future__ import annotations

import json
import math
from typing import Any, BinaryIO

import shapely

from covertool.congestion.feeds.protocol import FeedOptions
from covertool.errors import FileError, TruncatedError


def read_object(stream: BinaryIO, options: FeedOptions) -> dict[str, Any]:
    """Return the JSON object of a stream.

    Raises
    ------
    FileError
        When it is too large, too deep, not JSON, or not an object.
    TruncatedError
        When it ends early.
    """
    try:
        text = stream.read(options.limits.text_bytes + 1)
    except EOFError:
        raise TruncatedError(
            "the compressed feed ends early", options.where, "fetch it again"
        ) from None
    if len(text) > options.limits.text_bytes:
        raise FileError(
            f"the feed is larger than {options.limits.text_bytes / 2**20:.0f} MiB",
            options.where,
            "split it, by snapshot for example",
        )
    try:
        content = json.loads(text)
    except json.JSONDecodeError as fault:
        if fault.pos >= len(fault.doc.rstrip()) - 1 or fault.msg.startswith("Unterminated"):
            raise TruncatedError(
                f"the JSON ends early: {fault.msg}", options.where, "fetch the feed again"
            ) from None
        raise FileError(f"this is not JSON: {fault}", options.where, "check the file") from None
    except UnicodeDecodeError as fault:
        raise FileError(f"this is not UTF-8: {fault.reason}", options.where, "check it") from None
    except ValueError as fault:  # a number of thousands of digits
        raise FileError(f"this is not JSON: {fault}", options.where, "check the file") from None
    except RecursionError:
        raise FileError(
            "the JSON is nested too deeply", options.where, "this is not such a feed"
        ) from None
    if not isinstance(content, dict):
        raise FileError("the JSON is not an object", options.where, "this is not such a feed")
    return content


def line_of(points: Any, x: str, y: str) -> shapely.LineString | None:
    """Return a list of objects with coordinates as a line; None when there are fewer than two.

    Examples
    --------
    >>> line_of([{"x": 1, "y": 2}, {"x": 3, "y": 4}], "x", "y").wkt
    'LINESTRING (1 2, 3 4)'
    """
    try:
        pairs = [(float(point[x]), float(point[y])) for point in points or []]
    except (TypeError, KeyError, ValueError):
        return None
    whole = len(pairs) >= 2 and all(math.isfinite(value) for pair in pairs for value in pair)
    return shapely.LineString(pairs) if whole else None


def number(value: Any) -> float:
    """Return a JSON value as a float; NaN for whatever is none."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return float("nan")
    try:
        return float(value)
    except ValueError:
        return float("nan")

"""Bokeh figures and its JavaScript as text for one page: the same figures, the same bytes."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from bokeh.core.types import ID
from bokeh.embed import json_item
from bokeh.resources import Resources

if TYPE_CHECKING:
    from bokeh.models import Model

_MODEL_ID = re.compile(r"p\d+")


def figures_json(figures: Mapping[str, Model]) -> str:
    """Return the figures as one JSON object, by the name of the element that each fills.

    Bokeh numbers its models through the whole life of a process; here they are numbered anew, so
    that a page does not depend on what the process did before.
    """
    items = {name: json_item(figure, ID(name)) for name, figure in figures.items()}
    known: dict[str, str] = {}
    for value in _ids(items):
        known.setdefault(value, f"p{1001 + len(known)}")
    return json_for_script(_renumbered(items, known))


def json_for_script(value: object) -> str:
    """Return JSON that may stand inside a script element, whatever texts it holds.

    >>> json_for_script("</script>")
    '"\\\\u003c/script\\\\u003e"'
    """
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    for char in "<>&\u2028\u2029":
        text = text.replace(char, f"\\u{ord(char):04x}")
    return text


def bokeh_script() -> str:
    """Return BokehJS without widgets, tables and WebGL, as the installed Bokeh carries it."""
    return "\n".join(Resources(mode="inline", components=["bokeh"]).js_raw)


def content_policy(scripts: list[str]) -> str:
    """Return a content security policy: no request leaves the page, only these scripts run."""
    hashes = " ".join(
        f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
        for text in scripts
    )
    return (
        f"default-src 'none'; script-src {hashes}; style-src 'unsafe-inline'; "
        "img-src data: blob:; base-uri 'none'; form-action 'none'"
    )


def _ids(value: Any) -> Iterator[str]:
    if isinstance(value, dict):
        own = value.get("id")
        if isinstance(own, str) and _MODEL_ID.fullmatch(own):
            yield own
        for inner in value.values():
            yield from _ids(inner)
    elif isinstance(value, list):
        for inner in value:
            if isinstance(inner, dict | list):
                yield from _ids(inner)


def _renumbered(value: Any, known: Mapping[str, str]) -> Any:
    """Return a copy with every id replaced."""
    if isinstance(value, dict):
        return {
            key: known.get(inner, inner)
            if key in ("id", "root_id") and isinstance(inner, str)
            else _renumbered(inner, known)
            for key, inner in value.items()
        }
    if isinstance(value, list):
        return [
            _renumbered(inner, known) if isinstance(inner, dict | list) else inner
            for inner in value
        ]
    return value

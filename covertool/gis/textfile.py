"""Text that goes out as a file, written whole or not at all."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from covertool.errors import FileError
from covertool.gis import guard
from covertool.gis.formats import Format

LATEX = Format("LaTeX", "", (".tex",))
MARKDOWN = Format("Markdown", "", (".md",))
HTML = Format("HTML", "HTML", (".html", ".htm"))

_UNSPEAKABLE = dict.fromkeys(
    [*range(9), 11, 12, *range(14, 32), 0xFFFE, 0xFFFF], "\N{REPLACEMENT CHARACTER}"
)


def speakable(text: str) -> str:
    """Return a text in which what XML 1.0 cannot hold at all is a replacement character.

    >>> speakable("a\\x00b")
    'a\N{REPLACEMENT CHARACTER}b'
    """
    return text.translate(_UNSPEAKABLE)


def write_text(
    path: str | Path,
    text: str,
    known: Format,
    *,
    overwrite: bool = False,
    inputs: Iterable[str | Path] = (),
) -> None:
    """Write text in UTF-8 with line feeds.

    Raises
    ------
    FileError
        When the path cannot be written, has another extension than the format, or is one of
        ``inputs``.
    """
    checked, _ = guard.output_file(path, (known,), overwrite=overwrite, inputs=inputs)
    content = text.encode("utf-8")
    with guard.replacing(checked) as temporary:
        temporary.write_bytes(content)
        if temporary.stat().st_size != len(content):
            raise FileError(
                "not all of the text arrived", str(checked), "check free space and try again"
            )

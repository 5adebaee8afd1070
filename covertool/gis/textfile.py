"""Text that goes out as a file, written whole or not at all."""

from __future__ import annotations

from pathlib import Path

from covertool.gis import guard
from covertool.gis.formats import Format

LATEX = Format("LaTeX", "", (".tex",))
MARKDOWN = Format("Markdown", "", (".md",))


def write_text(path: str | Path, text: str, known: Format, *, overwrite: bool = False) -> None:
    """Write text in UTF-8 with line feeds.

    Raises
    ------
    FileError
        When the path cannot be written or has another extension than the format.
    """
    checked, _ = guard.output_file(path, (known,), overwrite=overwrite)
    with guard.replacing(checked) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")

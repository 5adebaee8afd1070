"""Pages that go out: one HTML file, whole or not at all."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from covertool.errors import FileError
from covertool.gis import guard
from covertool.gis.formats import Format

PAGE_FORMATS = (Format("HTML", "HTML", (".html", ".htm")),)


def write_page(
    path: str | Path, text: str, *, overwrite: bool = False, inputs: Iterable[str | Path] = ()
) -> None:
    """Write an HTML page in UTF-8.

    Raises
    ------
    FileError
        When the path cannot be written, its extension is not .html or .htm, or it is one of
        ``inputs``.
    """
    checked, _ = guard.output_file(path, PAGE_FORMATS, overwrite=overwrite, inputs=inputs)
    content = text.encode("utf-8")
    with guard.replacing(checked) as temporary:
        temporary.write_bytes(content)
        if temporary.stat().st_size != len(content):
            raise FileError(
                "not all of the page arrived", str(checked), "check free space and try again"
            )

"""A full disk, which SUMO does not notice: its exit code is 0 all the same."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path

from covertool.errors import FileError

_LEAST_BYTES = 64 * 1024
"""With less than this left, what was written last may be cut off."""


def refuse_full_disk(folder: Path, what: str) -> None:
    """Raise when the disk of a folder is full, so that files in it may be cut off."""
    free = shutil.disk_usage(folder).free
    if free < _LEAST_BYTES:
        raise FileError(
            f"the disk is full ({free} bytes left), so {what} may be cut off",
            str(folder),
            "free some space, or set TMPDIR to a folder on a larger disk",
        )


def write_xml(path: Path, root: str, rows: Sequence[str]) -> None:
    """Write elements under a root as a file that SUMO reads.

    Raises
    ------
    FileError
        When the disk is full or the folder may not be written to.
    """
    body = "\n".join(rows)
    try:
        path.write_text(f"<{root}>\n{body}\n</{root}>\n", encoding="utf-8")
    except OSError as fault:
        raise FileError(
            f"{path.name} cannot be written for SUMO: {fault.strerror}",
            str(path.parent),
            "free some space, or set TMPDIR to a folder on a larger disk",
        ) from None

"""The door for paths: what may be opened, what may be written, and how a file is replaced whole."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from covertool.errors import FileError
from covertool.gis.formats import GEOJSON, Format, by_suffix, suffixes

_REMOTE = ("/vsi", "http:", "https:", "ftp:", "s3:", "gs:", "az:")


def local_path(path: str | Path) -> Path:
    """Return a path on this machine; remote and GDAL-virtual paths are refused.

    >>> local_path("town.gpkg").name
    'town.gpkg'
    """
    text = str(path)
    if text.lower().startswith(_REMOTE) or "://" in text:
        raise FileError(
            "remote and virtual paths are not opened", text, "download the file and name it here"
        )
    if not text or "\x00" in text:
        raise FileError("the path is empty or holds a zero byte", repr(text), "name a file")
    return Path(text).expanduser()


def layer_spec(spec: str | Path) -> tuple[Path, str | None]:
    """Split ``FILE[:LAYER]``; a file whose whole name exists wins over a layer after a colon.

    >>> layer_spec("town.gpkg")
    (PosixPath('town.gpkg'), None)
    """
    path = local_path(spec)
    head, colon, layer = str(path).rpartition(":")
    if colon and layer and not path.exists() and Path(head).is_file():
        return Path(head), layer
    return path, None


def input_file(path: str | Path, formats: tuple[Format, ...]) -> tuple[Path, Format]:
    """Return a path that may be opened and its format, after checks of both name and content.

    Raises
    ------
    FileError
        When the file is absent, a folder, empty, unreadable, of an unknown extension, or when its
        first bytes are not those of its extension.
    """
    checked = local_path(path)
    require_readable(checked)
    known = by_suffix(checked, formats)
    if known is None:
        raise FileError(
            f"the extension {checked.suffix or '(none)'!r} is not known here",
            str(checked),
            f"use a file with one of: {suffixes(formats)}",
        )
    _require_content(checked, known)
    return checked, known


def require_readable(path: Path) -> None:
    """Refuse a path that is absent, not a file, empty or not to be read."""
    try:
        if not path.exists():
            raise FileError("the file does not exist", str(path), "check the path and its spelling")
        if path.is_dir():
            raise FileError("this is a folder, not a file", str(path), "name a file inside it")
        if not path.is_file():
            raise FileError("this is not a regular file", str(path), "name a file on disk")
        if path.stat().st_size == 0:
            raise FileError("the file is empty (zero bytes)", str(path), "write or copy it again")
        with path.open("rb"):
            pass
    except OSError as error:
        raise FileError(
            f"the file cannot be opened: {error.strerror}", str(path), "check its name and rights"
        ) from None


def _require_content(path: Path, known: Format) -> None:
    with path.open("rb") as file:
        head = file.read(64)
    good = any(head[offset : offset + len(sign)] == sign for offset, sign in known.signatures)
    if known is GEOJSON:
        good = head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"{")
    elif not known.signatures:
        good = True
    if not good:
        raise FileError(
            f"the content is not {known.name}, as the extension says",
            str(path),
            "give the file its true extension, or write it again",
        )


def output_file(
    path: str | Path,
    formats: tuple[Format, ...],
    *,
    overwrite: bool = False,
    inputs: Iterable[str | Path] = (),
) -> tuple[Path, Format]:
    """Return a path that may be written and its format.

    Raises
    ------
    FileError
        When the extension is unknown, the parent folder is missing, the file exists and
        ``overwrite`` is False, or the file is one of ``inputs``.
    """
    checked = local_path(path)
    known = by_suffix(checked, formats)
    if known is None:
        raise FileError(
            f"the extension {checked.suffix or '(none)'!r} is not one that covertool writes",
            str(checked),
            f"use one of: {suffixes(formats)}",
        )
    require_parent(checked)
    if checked.is_dir():
        raise FileError("the output is a folder", str(checked), "name a file inside it")
    for given in inputs:
        if checked.exists() and Path(given).exists() and os.path.samefile(checked, given):
            raise FileError("output and input are the same file", str(checked), "name another -o")
    if checked.exists() and not overwrite:
        raise FileError("the output exists", str(checked), "name another, or add --overwrite")
    return checked, known


def require_parent(path: Path) -> None:
    """Refuse a path whose folder is missing or may not be written to."""
    parent = path.parent
    if not parent.is_dir():
        raise FileError(f"the folder {parent} does not exist", str(path), f"mkdir -p {parent}")
    if not os.access(parent, os.W_OK):
        raise FileError(
            f"the folder {parent} may not be written to", str(path), "choose another folder"
        )


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary sibling of ``path`` that takes its place when the block ends well.

    The block writes, closes, reopens and checks the sibling. When it raises, the sibling (and any
    file that a driver put beside it) is removed and the old file stays as it was.
    """
    require_parent(path)
    suffix = "".join(path.suffixes[-2:]) if path.name.lower().endswith(".osm.gz") else path.suffix
    temporary = path.with_name(f".{secrets.token_hex(6)}.part{suffix}")
    try:
        yield temporary
        with temporary.open("rb+") as file:
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError as error:
        raise FileError(
            f"the file cannot be written: {error.strerror or error}",
            str(path),
            "check free space and rights, or choose another folder",
        ) from error
    finally:
        for leftover in path.parent.glob(f"{temporary.stem}*"):
            leftover.unlink(missing_ok=True)

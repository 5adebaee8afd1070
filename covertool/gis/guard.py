"""The door for paths: what may be opened, what may be written, and how a file is replaced whole."""

from __future__ import annotations

import glob
import mmap
import os
import platform
import secrets
import sqlite3
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from covertool.errors import FileError
from covertool.gis.formats import GEOJSON, Format, by_suffix, suffixes

_HEAD = 4096  # bytes looked at, at either end of a file
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
        found = path.stat()
        if stat.S_ISDIR(found.st_mode):
            raise FileError("this is a folder, not a file", str(path), "name a file inside it")
        if not stat.S_ISREG(found.st_mode):
            raise FileError("this is not a regular file", str(path), "name a file on disk")
        if found.st_size == 0:
            raise FileError("the file is empty (zero bytes)", str(path), "write or copy it again")
        with path.open("rb"):
            pass
    except FileNotFoundError:
        raise FileError(
            "the file does not exist", str(path), "check the path and its spelling"
        ) from None
    except OSError as error:
        raise FileError(
            f"the file cannot be opened: {error.strerror}", str(path), "check its name and rights"
        ) from None


def _require_content(path: Path, known: Format) -> None:
    """Refuse a file whose bytes are not those of its extension, or which is cut off."""
    with path.open("rb") as file:
        head = file.read(_HEAD)
        good = any(head[at : at + len(sign)] == sign for at, sign in known.signatures)
        if known is GEOJSON:
            good = head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"{") and not _runs_gdal(file)
    if not good and (known.signatures or known is GEOJSON):
        raise FileError(
            f"the content is not {known.name}, as the extension says",
            str(path),
            "give the file its true extension, or write it again",
        )

    if known.ending and known.ending not in tail(path):
        raise FileError(f"the {known.name} file is cut off", str(path), "copy or export it again")


def tail(path: Path) -> bytes:
    """Return the last bytes of a file, 4096 of them if it has so many."""
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - _HEAD))
        return file.read()


def _runs_gdal(file: BinaryIO) -> bool:
    """Return True for JSON that GDAL would run as a pipeline, which may read any other file."""
    with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        return content.find(b"gdal_streamed_alg") >= 0


def output_file(
    path: str | Path,
    formats: tuple[Format, ...],
    *,
    overwrite: bool = False,
    inputs: Iterable[str | Path] = (),
) -> tuple[Path, Format]:
    """Return a path that may be written and its format.

    Parameters
    ----------
    path : str or Path
    formats : of which its extension must name one
    overwrite : whether an existing file may be replaced
    inputs : files, or ``FILE:LAYER``, that it must not be

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
    try:
        checked.lstat()
    except FileNotFoundError:
        return checked, known
    except OSError as error:
        raise FileError(
            f"the file cannot be written: {error.strerror}", str(checked), "choose another name"
        ) from None
    if checked.is_dir():
        raise FileError("the output is a folder", str(checked), "name a file inside it")
    if any(_same_file(checked, layer_spec(given)[0]) for given in inputs):
        raise FileError("output and input are the same file", str(checked), "name another output")
    if not overwrite:
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


def _same_file(one: Path, other: Path) -> bool:
    try:
        return os.path.samefile(one, other)
    except OSError:
        return False


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary sibling of ``path`` that takes its place when the block ends well.

    The block writes, closes, reopens and checks the sibling. When it raises, the sibling (and any
    file that a driver put beside it) is removed and the old file stays as it was. Of a symbolic
    link the file that it points to is replaced.

    Raises
    ------
    FileError
        When the block fails to write.
    """
    require_parent(path)
    target = path.resolve()
    _sweep(target.parent)
    temporary = target.with_name(
        f"{_part_prefix()}{os.getpid()}-{secrets.token_hex(4)}.part{path.suffix}"
    )
    try:
        yield temporary
        with temporary.open("rb+") as file:
            os.fsync(file.fileno())
        os.replace(temporary, target)
    except _faults_of_writing() as error:
        raise unwritten(path, error) from error
    finally:
        for leftover in target.parent.glob(f"{glob.escape(temporary.stem)}*"):
            leftover.unlink(missing_ok=True)


def _part_prefix() -> str:
    return f".{platform.node()[:64]}-"


def _sweep(folder: Path) -> None:
    """Remove the unfinished siblings of writers on this machine that were killed."""
    if os.name != "posix":  # elsewhere signal 0 is no harmless question
        return
    prefix = _part_prefix()
    for part in folder.glob(f"{glob.escape(prefix)}*.part*"):
        writer = part.name.removeprefix(prefix).partition("-")[0]
        if writer.isdigit() and not _lives(int(writer)):
            part.unlink(missing_ok=True)


def _lives(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def unread(path: Path, error: BaseException) -> FileError:
    """Return the error that says that and why a file was not read."""
    told = str(error).replace(str(path), path.name)
    return FileError(
        f"the file cannot be read: {told}", str(path), "check it in QGIS, or write it again"
    )


def unwritten(path: Path, error: BaseException) -> FileError:
    """Return the error that says that and why a file was not written."""
    told = getattr(error, "strerror", None) or str(error)
    return FileError(
        f"the file cannot be written: {told}",
        str(path),
        "check free space and rights, or choose another folder",
    )


def _faults_of_writing() -> tuple[type[Exception], ...]:
    import pyarrow
    import pyogrio.errors

    return (
        OSError,
        sqlite3.Error,
        pyogrio.errors.DataSourceError,
        pyogrio.errors.DataLayerError,
        pyarrow.ArrowException,
    )

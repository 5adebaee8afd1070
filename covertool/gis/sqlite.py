"""SQLite files, which GeoPackages are: opened so that nothing is left beside them."""

from __future__ import annotations

import shutil
import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from covertool.errors import FileError
from covertool.gis import guard
from covertool.gis.formats import GEOPACKAGE, Format

_WAL_MODE = b"\x02\x02"
"""Bytes 18 and 19 of a file that keeps a write-ahead log."""


def quoted(name: str) -> str:
    """Return a name as SQL takes it, whatever is in it.

    >>> print(quoted("a layer"))
    "a layer"
    """
    return '"' + name.replace('"', '""') + '"'


@contextmanager
def read_only(path: Path, *, timeout_s: float = 5.0) -> Iterator[sqlite3.Connection]:
    """Yield a connection that cannot write and trusts nothing that the file's schema calls."""
    uri = f"{path.absolute().as_uri()}?mode=ro"
    with closing(sqlite3.connect(uri, uri=True, timeout=timeout_s)) as connection:
        connection.execute("PRAGMA trusted_schema = OFF")
        yield connection


@contextmanager
def readable(path: Path, known: Format) -> Iterator[Path]:
    """Yield a path to read from that leaves nothing beside the user's file.

    A GeoPackage that another program holds open in WAL mode is read from a copy of the file and
    its log; SQLite would else write ``-wal`` and ``-shm`` files beside it.
    """
    if known is not GEOPACKAGE:
        yield path
        return
    with path.open("rb") as file:
        keeps_log = file.read(20)[18:20] == _WAL_MODE
    if not keeps_log:
        _require_unlocked(path)
        yield path
        return
    with tempfile.TemporaryDirectory(prefix="covertool-") as folder:
        copy = Path(folder) / "snapshot.gpkg"
        snapshot(path, copy)
        yield copy


def snapshot(path: Path, copy: Path) -> None:
    """Copy a SQLite file with its write-ahead log, and leave the copy in rollback mode."""
    shutil.copyfile(path, copy)
    log = path.with_name(path.name + "-wal")
    if log.is_file():
        shutil.copyfile(log, copy.with_name(copy.name + "-wal"))
    try:
        with closing(sqlite3.connect(copy)) as connection:
            connection.execute("PRAGMA journal_mode=DELETE").fetchall()
    except sqlite3.Error as error:
        raise guard.unread(path, error) from None


def _require_unlocked(path: Path) -> None:
    """Refuse a file that another program is writing."""
    try:
        with read_only(path, timeout_s=1.0) as connection:
            connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
    except sqlite3.DatabaseError as error:
        if isinstance(error, sqlite3.OperationalError) and "locked" in str(error):
            raise FileError(
                "the file is locked by another program",
                str(path),
                "close it there (or let it finish) and try again",
            ) from None
        raise guard.unread(path, error) from None

"""Guarded byte streams: a feed's file opened for reading, unpacked, and capped in size."""

from __future__ import annotations

import gzip
import io
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, cast

from covertool.errors import FileError
from covertool.gis import guard

MAX_BYTES = 4 * 2**30
"""Greatest size of a feed after unpacking."""
MAX_RATIO = 300
"""Greatest ratio of unpacked to packed size; real XML packs 10 to 40 times, a bomb 1000."""
_GZIP = b"\x1f\x8b"
_RATIO_COUNTS_FROM = 64 * 2**20


@contextmanager
def open_stream(
    path: str | Path, *, max_bytes: int = MAX_BYTES, max_ratio: float = MAX_RATIO
) -> Iterator[BinaryIO]:
    """Yield a file's bytes as a stream that refuses to grow beyond its caps; gzip is unpacked.

    A plain file can be sought in (Parquet needs that); an unpacked one is read once, forwards.

    Raises
    ------
    FileError
        When the file is absent or empty; while reading, when it grows beyond a cap.
    """
    checked = guard.local_path(path)
    try:
        size = checked.stat().st_size
        file = checked.open("rb")
    except OSError as error:
        raise FileError(
            f"the file cannot be opened: {error.strerror}", str(checked), "check the path"
        ) from None
    with file:
        if size == 0:
            raise FileError("the file is empty", str(checked), "fetch or export it again")
        head = file.read(2)
        file.seek(0)
        if head != _GZIP:
            yield cast(BinaryIO, _Capped(file, max_bytes, checked))
            return
        cap = min(max_bytes, max(_RATIO_COUNTS_FROM, int(size * max_ratio)))
        with gzip.GzipFile(fileobj=file) as unpacked:
            yield cast(BinaryIO, io.BufferedReader(_Capped(unpacked, cap, checked)))


class _Capped(io.RawIOBase):
    """A binary stream that raises once more than ``cap`` bytes have been read."""

    def __init__(self, inner: io.BufferedIOBase, cap: int, path: Path) -> None:
        self._inner, self._cap, self._path = inner, cap, path
        self._read = 0

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return not isinstance(self._inner, gzip.GzipFile)

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        return self._inner.seek(offset, whence)

    def tell(self) -> int:
        return self._inner.tell()

    def readinto(self, buffer: bytearray | memoryview) -> int:  # type: ignore[override]
        try:
            chunk = self._inner.read(len(buffer))
        except (gzip.BadGzipFile, zlib.error) as fault:
            raise FileError(
                f"the gzip file is damaged: {fault}", str(self._path), "fetch it again"
            ) from None
        self._read += len(chunk)
        if self._read > self._cap:
            raise FileError(
                f"the file unpacks to more than {self._cap / 2**20:.0f} MiB",
                str(self._path),
                "unpack it by hand if you trust it, and split it",
            )
        buffer[: len(chunk)] = chunk
        return len(chunk)

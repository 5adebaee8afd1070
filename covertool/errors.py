"""The errors that a user can mend: each says what is wrong, where, and how to mend it."""

from collections.abc import Iterator
from contextlib import contextmanager


class CovertoolError(Exception):
    """A fault that the user can mend, told in three lines.

    Parameters
    ----------
    what : str
        What is wrong, in one sentence without a full stop.
    where : str
        The file, layer, column, option or place that holds the fault.
    mend : str
        What to type or change so that it works.

    Examples
    --------
    >>> print(CovertoolError("the file does not exist", "town.gpkg", "check the path"))
    error: the file does not exist
    where: town.gpkg
    mend:  check the path
    """

    def __init__(self, what: str, where: str, mend: str) -> None:
        super().__init__(what, where, mend)
        self.what = what
        self.where = where
        self.mend = mend

    def __str__(self) -> str:
        lines = (f"error: {self.what}", f"where: {self.where}", f"mend:  {self.mend}")
        return "\n".join(" ".join(line.splitlines()) for line in lines)


class FileError(CovertoolError):
    """A file that cannot be read or written."""


class TruncatedError(FileError):
    """A file or feed that ends before it is complete."""


class CrsError(CovertoolError):
    """A coordinate reference system that is missing, in conflict, or of the wrong kind."""


class GeometryError(CovertoolError):
    """Geometry or coordinates that cannot be used."""


class ColumnError(CovertoolError):
    """A column that is missing, misspelt, or holds values out of range."""


class OptionError(CovertoolError):
    """Options that are out of range or do not fit together."""


class MissingExtraError(CovertoolError):
    """A part of covertool that needs an extra which is not installed."""


class ComputationError(CovertoolError):
    """A result that failed its own check and is therefore not given out."""


@contextmanager
def told_of(file: object) -> Iterator[None]:
    """Name a file in the faults of a block that knows only what was in it.

    >>> with told_of("town.gpkg"):
    ...     raise ColumnError("there is no column id", "segments", "add one")
    Traceback (most recent call last):
    covertool.errors.ColumnError: error: there is no column id
    where: town.gpkg: segments
    mend:  add one
    """
    try:
        yield
    except CovertoolError as fault:
        if str(file) in fault.where:
            raise
        raise type(fault)(fault.what, f"{file}: {fault.where}", fault.mend) from None

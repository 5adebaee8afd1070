"""Where the sample study lies: ``data/`` in a checkout, ``covertool/data`` in a wheel."""

from __future__ import annotations

import shutil
from pathlib import Path

from covertool.errors import FileError
from covertool.gis import guard

SAMPLE_STUDY = "sample.gpkg"
SAMPLE_TRACE = "trace.parquet"

_PACKAGE = Path(__file__).resolve().parents[1]


def sample_folder() -> Path:
    """Return the folder of the sample study.

    Raises
    ------
    FileError
        When the sample study is not there.
    """
    places = (_PACKAGE / "data", _PACKAGE.parent / "data")
    for place in places:
        if (place / SAMPLE_STUDY).is_file():
            return place
    raise FileError(
        f"the sample study {SAMPLE_STUDY} is missing from this installation",
        " and ".join(str(place) for place in places),
        "install covertool again, or name your own study",
    )


def copy_sample(folder: Path, *, overwrite: bool = False) -> list[Path]:
    """Copy the files of the sample study into a folder, which is made if its parent exists.

    Returns
    -------
    list of Path
        The copies.

    Raises
    ------
    FileError
        When the folder cannot be made, or a file of that name is there and ``overwrite`` is False.
    """
    files = sorted(path for path in sample_folder().iterdir() if path.is_file())
    guard.require_parent(folder)
    if folder.exists() and not folder.is_dir():
        raise FileError("this is a file, not a folder", str(folder), "name a folder")
    there = [file.name for file in files if (folder / file.name).exists()]
    if there and not overwrite:
        raise FileError(
            f"the folder already holds {there[0]}", str(folder), "name another, or add --overwrite"
        )
    folder.mkdir(exist_ok=True)
    copies = [folder / file.name for file in files]
    for file, copy in zip(files, copies, strict=True):
        with guard.replacing(copy) as temporary:
            shutil.copyfile(file, temporary)
    return copies

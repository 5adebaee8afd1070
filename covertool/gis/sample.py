"""Where the sample study lies: ``data/`` in a checkout, ``covertool/data`` in a wheel."""

from __future__ import annotations

from pathlib import Path

from covertool.errors import FileError

SAMPLE_STUDY = "sample.gpkg"

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

"""Pictures that go out: matplotlib figures as PNG, PDF or SVG, the same bytes each time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from covertool.gis import guard
from covertool.gis.formats import Format, by_suffix

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIGURE_FORMATS = (
    Format("PNG", "PNG", (".png",)),
    Format("PDF", "PDF", (".pdf",)),
    Format("SVG", "SVG", (".svg",)),
)
# Without these, matplotlib writes the time of day into the file.
_UNDATED: dict[str, dict[str, Any]] = {
    "PNG": {},
    "PDF": {"CreationDate": None},
    "SVG": {"Date": None},
}

_ABOUT = {"PNG": "Description", "PDF": "Subject", "SVG": "Description"}


def is_figure(path: Path) -> bool:
    """Return True for a path whose extension is that of a figure.

    >>> is_figure(Path("map.PNG")), is_figure(Path("map.gpkg"))
    (True, False)
    """
    return by_suffix(path, FIGURE_FORMATS) is not None


def write_figure(
    path: str | Path, figure: Figure, *, about: str = "", overwrite: bool = False
) -> None:
    """Write a figure whole or not at all; the extension decides the format.

    Parameters
    ----------
    path : str or Path
        A .png, .pdf or .svg file.
    figure : Figure
    about : str
        What lies in the file unseen, such as the provenance.
    overwrite : bool
        Replace an existing file.

    Raises
    ------
    FileError
        When the path cannot be written or its extension is not .png, .pdf or .svg.
    """
    import matplotlib as mpl

    checked, known = guard.output_file(path, FIGURE_FORMATS, overwrite=overwrite)
    unseen = {**_UNDATED[known.name], **({_ABOUT[known.name]: about} if about else {})}
    with guard.replacing(checked) as temporary, mpl.rc_context({"svg.hashsalt": "covertool"}):
        figure.savefig(temporary, format=known.driver.lower(), dpi=200, metadata=unseen)

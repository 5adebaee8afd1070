"""Files that name rasters: a VRT mosaic, or a text file with one path a line.

A VRT is never handed to GDAL, which would open whatever file of this machine, or of another, it
names. It is read here as what ``gdalbuildvrt`` writes, a list of images that lie side by side, and
each image then passes the same door as one that was named by hand.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from lxml import etree
from pyproj import CRS
from pyproj.exceptions import CRSError
from rasterio.transform import Affine

from covertool.errors import FileError
from covertool.gis import guard
from covertool.gis.formats import RASTER_FORMATS, Format
from covertool.gis.georaster import open_dataset

VRT = Format("VRT", "", (".vrt",), ((0, b"<VRTDataset"), (0, b"<?xml")))
TEXT_LIST = Format("list of files", "", (".txt",))

_MOST_BYTES = 64 * 2**20
_SOURCES = ("SimpleSource", "ComplexSource")
_PLAIN_PARTS = {
    "SourceFilename", "SourceBand", "SourceProperties", "SrcRect", "DstRect", "NODATA",
    "UseMaskBand",
}  # fmt: skip
_ALPHA = "Alpha"


def raster_files(path: str | Path) -> list[Path]:
    """Return the rasters that a path stands for: itself, or those that a VRT or a list names.

    Where images overlap the first returned lies on top, so those of a VRT come last drawn first.

    Parameters
    ----------
    path : str or Path
        A raster; a ``.vrt`` made by ``gdalbuildvrt``, whose images lie in its own folder or below;
        or a ``.txt`` with one path a line, relative to its own folder (``#`` begins a comment).

    Raises
    ------
    FileError
        When a VRT does more than lay whole images side by side, reaches outside its folder, or a
        list names nothing.
    """
    name = guard.local_path(path)
    suffix = name.suffix.lower()
    if suffix == ".vrt":
        return _vrt_files(guard.input_file(name, (VRT,))[0])
    if suffix == ".txt":
        return _listed_files(guard.input_file(name, (TEXT_LIST,))[0])
    return [name]


def _listed_files(path: Path) -> list[Path]:
    try:
        lines = _content(path).decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise FileError("the list is no UTF-8 text", str(path), "save it as UTF-8") from None
    named = [line.strip() for line in lines]
    found = [path.parent / guard.local_path(n) for n in named if n and not n.startswith("#")]
    if not found:
        raise FileError("the list names no file", str(path), "write one path a line")
    return list(dict.fromkeys(found))


def _vrt_files(path: Path) -> list[Path]:
    """Return the images of a VRT, the one on top first."""
    root = _parsed(path)
    if root.tag != "VRTDataset" or root.get("subClass") is not None:
        raise _too_much(path, root.get("subClass") or root.tag)
    try:
        files = list(dict.fromkeys(_sources(path, root)))
    except (ValueError, CRSError) as error:
        raise FileError(
            f"the VRT holds a value that cannot be read ({error})",
            str(path),
            "make it with gdalbuildvrt",
        ) from None
    if not files:
        raise FileError("the VRT names no image", str(path), "make it with gdalbuildvrt")
    return files[::-1]


def _sources(path: Path, root: Any) -> Iterator[Path]:
    """Yield the images in the order in which they are drawn, once for each band."""
    for band in root.iterfind("VRTRasterBand"):
        parts = {str(part.tag) for part in band}
        strange = {part for part in parts if part.endswith("Source")} - set(_SOURCES)
        if band.get("subClass") is not None or strange:
            raise _too_much(path, band.get("subClass") or ", ".join(sorted(strange)))
        for source in band.iterchildren(*_SOURCES):
            file = _inside(path, source.find("SourceFilename"))
            if band.findtext("ColorInterp") != _ALPHA:  # each image knows its own alpha
                _require_plain(path, root, band, source, file)
            yield file


def _content(path: Path) -> bytes:
    if path.stat().st_size > _MOST_BYTES:
        raise FileError("the file is far too long for a list", str(path), "name the images by hand")
    return path.read_bytes()


def _parsed(path: Path) -> Any:
    """Return the root element; entities are neither declared nor expanded."""
    parser = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False)
    try:
        root = etree.fromstring(_content(path), parser)
    except etree.XMLSyntaxError as error:
        raise FileError(
            f"the VRT is no XML ({error.msg})", str(path), "make it with gdalbuildvrt"
        ) from None
    if root.getroottree().docinfo.doctype:
        raise FileError(
            "the VRT declares a DOCTYPE, which may hold entity bombs",
            str(path),
            "make it with gdalbuildvrt",
        )
    return root


def _inside(vrt: Path, element: Any) -> Path:
    """Return the path of an image, which lies in the folder of the VRT or below."""
    named = (element.text or "").strip() if element is not None else ""
    given = guard.local_path(named)
    near = element is not None and element.get("relativeToVRT") == "1"
    found = (vrt.parent / given if near else given).resolve()
    if not found.is_relative_to(vrt.parent.resolve()):
        raise FileError(
            f"the VRT names {named}, outside its own folder",
            str(vrt),
            "put the VRT beside or above its images, or name the images themselves",
        )
    return found


def _require_plain(vrt: Path, root: Any, band: Any, source: Any, file: Path) -> None:
    """Refuse a source that is not the whole of an image, band for band, at its own place."""
    strange = {str(part.tag) for part in source} - _PLAIN_PARTS
    if strange:
        raise _too_much(vrt, ", ".join(sorted(strange)))
    if (source.findtext("SourceBand") or "1") != band.get("band"):
        raise _too_much(vrt, f"band {source.findtext('SourceBand')} as band {band.get('band')}")
    checked, known = guard.input_file(file, RASTER_FORMATS)
    dataset = open_dataset(checked, known.driver)
    try:
        nodata = source.findtext("NODATA")
        if nodata is not None and dataset.nodata != float(nodata):
            raise _too_much(vrt, f"{nodata} as no data of {file.name}")
        _require_whole(vrt, root, source, dataset, file)
    finally:
        dataset.close()


def _require_whole(vrt: Path, root: Any, source: Any, dataset: Any, file: Path) -> None:
    """Refuse an image that is drawn in part, elsewhere, or in another CRS than its own."""
    whole = (0.0, 0.0, float(dataset.width), float(dataset.height))
    seen = _rectangle(source.find("SrcRect"), whole)
    if seen != whole:
        raise _too_much(vrt, f"a part of {file.name}")
    x, y, width, height = _rectangle(source.find("DstRect"), whole)
    step = root.findtext("GeoTransform")
    if step is None:
        raise _too_much(vrt, "images without georeference")
    place = Affine.from_gdal(*(float(number) for number in step.split(",")))
    drawn = place @ Affine.translation(x, y) @ Affine.scale(width / whole[2], height / whole[3])
    for column, row in ((0, 0), (dataset.width, dataset.height)):
        off = ~place @ (drawn @ (column, row))
        true = ~place @ (dataset.transform @ (column, row))
        if not max(abs(off[0] - true[0]), abs(off[1] - true[1])) <= 1:
            raise _too_much(vrt, f"{file.name} at another place than its own")
    named = root.findtext("SRS")
    if named and dataset.crs and CRS.from_user_input(named) != CRS.from_wkt(dataset.crs.to_wkt()):
        raise _too_much(vrt, f"{file.name} in another CRS than its own")


def _rectangle(element: Any, whole: tuple[float, ...]) -> tuple[float, ...]:
    if element is None:
        return whole
    return tuple(float(element.get(key, "nan")) for key in ("xOff", "yOff", "xSize", "ySize"))


def _too_much(vrt: Path, what: str | None) -> FileError:
    return FileError(
        f"the VRT does more than lay whole images side by side ({what})",
        str(vrt),
        "name the images themselves, or write a GeoTIFF of it: gdal_translate in.vrt out.tif",
    )

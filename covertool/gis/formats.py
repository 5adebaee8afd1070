"""The file formats that covertool opens: by extension, each with its first bytes and GDAL driver.

Only these drivers are ever used. GDAL alone would look at the content and so open a VRT that is
named ``.tif``, which can read any other file of the machine.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Format:
    """A file format.

    Attributes
    ----------
    name : as people say it
    driver : of GDAL
    suffixes : extensions in lower case, with their dot
    signatures : (offset, bytes) pairs of which one must match; none means plain text
    layers : whether a file holds several layers
    ending : what must stand near the end of a whole file, where GDAL would not notice a cut
    """

    name: str
    driver: str
    suffixes: tuple[str, ...]
    signatures: tuple[tuple[int, bytes], ...] = ()
    layers: bool = False
    ending: bytes = b""


GEOPACKAGE = Format("GeoPackage", "GPKG", (".gpkg",), ((0, b"SQLite format 3\x00"),), layers=True)
GEOJSON = Format("GeoJSON", "GeoJSON", (".geojson", ".json"))
GEOPARQUET = Format("GeoParquet", "Parquet", (".parquet", ".geoparquet"), ((0, b"PAR1"),))
FLATGEOBUF = Format("FlatGeobuf", "FlatGeobuf", (".fgb",), ((0, b"fgb"),))
SHAPEFILE = Format("Shapefile", "ESRI Shapefile", (".shp",), ((0, b"\x00\x00\x27\x0a"),))
CSV = Format("CSV", "CSV", (".csv", ".tsv", ".txt"))
VECTOR_FORMATS = (GEOPACKAGE, GEOJSON, GEOPARQUET, FLATGEOBUF, SHAPEFILE, CSV)
KML = Format("KML", "KML", (".kml",), layers=True)
SHAPEFILES = Format("zipped Shapefiles", "ESRI Shapefile", (".shp.zip",), layers=True)
VECTOR_OUTPUTS = (*VECTOR_FORMATS, KML, SHAPEFILES)
"""What layers are written to; KML and archives are not read again."""

_XML = ((0, b"<?xml"), (0, b"<osm"), (0, b"\xef\xbb\xbf<"))
OSM_FORMATS = (
    Format("OSM PBF", "OSM", (".osm.pbf", ".pbf"), ((6, b"OSMHeader"),)),
    Format("gzipped OSM XML", "OSM", (".osm.gz",), ((0, b"\x1f\x8b"),)),
    Format("OSM XML", "OSM", (".osm",), _XML),
)

RASTER_FORMATS = (
    Format(
        "GeoTIFF",
        "GTiff",
        (".tif", ".tiff"),
        ((0, b"II*\x00"), (0, b"MM\x00*"), (0, b"II+\x00"), (0, b"MM\x00+")),
    ),
    Format("PNG", "PNG", (".png",), ((0, b"\x89PNG\r\n\x1a\n"),), ending=b"IEND"),
    Format("JPEG", "JPEG", (".jpg", ".jpeg"), ((0, b"\xff\xd8\xff"),)),
    Format(
        "JPEG2000",
        "JP2OpenJPEG",
        (".jp2", ".j2k"),
        ((0, b"\x00\x00\x00\x0cjP  "), (0, b"\xff\x4f\xff\x51")),
    ),
    Format("WebP", "WEBP", (".webp",), ((8, b"WEBP"),)),
    Format("Erdas Imagine", "HFA", (".img",), ((0, b"EHFA_HEADER_TAG"),)),
)


def by_suffix(path: Path, formats: tuple[Format, ...]) -> Format | None:
    """Return the format of a path by its extension, or None.

    >>> by_suffix(Path("town.GPKG"), VECTOR_FORMATS).name
    'GeoPackage'
    """
    name = path.name.lower()
    return next((known for known in formats if name.endswith(known.suffixes)), None)


def suffixes(formats: tuple[Format, ...]) -> str:
    """Return the extensions of formats as one phrase.

    >>> suffixes((GEOPACKAGE, FLATGEOBUF))
    '.gpkg, .fgb'
    """
    return ", ".join(suffix for known in formats for suffix in known.suffixes)

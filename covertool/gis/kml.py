"""KML for Google Earth and other globes: WGS 84, one styled folder for each layer."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO
from xml.sax.saxutils import escape, quoteattr

import numpy as np
import shapely

from covertool.gis.columns import typed
from covertool.gis.styles import PIXELS_PER_MM, Choice, Style, choices, rgb, style_of
from covertool.gis.textfile import speakable

if TYPE_CHECKING:
    import geopandas as gpd

_LOG = logging.getLogger(__name__)

_HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<kml xmlns="http://www.opengis.net/kml/2.2">
<Document>
<name>{name}</name>
"""
_DEFAULT = Style("line", "#333333", 0.8, 0.4)
_MARKER_SCALE = 0.35  # of the globe's own pin
_MANY = 100_000  # features, beyond which globes grow slow
_NAMES = ("name", "id", "segment_id", "vehicle", "zone")


def write_kml(
    path: Path, name: str, layers: Mapping[str, gpd.GeoDataFrame], description: str = ""
) -> int:
    """Write layers, which lie in WGS 84, and return the number of placemarks.

    Levels of several radii become one folder for each radius, of which the smallest is switched on.
    """
    count = 0
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write(_HEAD.format(name=_text(name)))
        if description:
            file.write(f"<description>{_text(description)}</description>\n")
        folders = [
            (_id(layer, choice), layer, part, choice)
            for layer, frame in layers.items()
            for part, choice in _parts(layer, frame)
        ]
        for id_, layer, _, choice in folders:
            file.write(_style(id_, _look(layer, choice)))
        for id_, layer, part, choice in folders:
            count += _write_folder(file, id_, layer, part, choice)
        file.write("</Document>\n</kml>\n")
    if count > _MANY:
        _LOG.warning("%s: %d placemarks are slow in a globe; a .gpkg is not", path, count)
    return count


def _parts(layer: str, frame: gpd.GeoDataFrame) -> Iterator[tuple[gpd.GeoDataFrame, Choice | None]]:
    rows = choices(layer, frame)
    rest = np.ones(len(frame), dtype=bool)
    for choice in rows:
        chosen = (frame[choice.column] == choice.value).to_numpy()
        rest &= ~chosen
        yield frame[chosen], choice
    if rest.any() or not rows:
        yield frame[rest], None


def _look(layer: str, choice: Choice | None) -> Style:
    return (style_of(layer) if choice is None else choice.style) or _DEFAULT


def _write_folder(
    file: TextIO, style: str, layer: str, frame: gpd.GeoDataFrame, choice: Choice | None
) -> int:
    """Write a folder with one placemark for each row, and return their number."""
    title = _look(layer, choice).title or layer
    name = title if choice is None else f"{title}, {choice.label}"
    visible = "" if choice is None or choice.shown else "<visibility>0</visibility>"
    file.write(f"<Folder><name>{_text(name)}</name>{visible}\n")
    table = typed(frame)
    columns = [str(column) for column in table.columns if column != table.geometry.name]
    for row, shape in zip(_rows(table, columns), frame.geometry.array, strict=True):
        values = {key: value for key, value in zip(columns, row, strict=True) if value is not None}
        file.write(
            f"<Placemark>{_name(values)}{visible}<styleUrl>#{style}</styleUrl>"
            f"{_data(values)}{_geometry(shape)}</Placemark>\n"
        )
    file.write("</Folder>\n")
    return len(frame)


def _rows(table: Any, columns: list[str]) -> Iterator[tuple[Any, ...]]:
    """Yield the cells of each row; None where a cell is empty."""
    plain = [table[column].astype(object).where(table[column].notna(), None) for column in columns]
    return iter(zip(*plain, strict=True)) if plain else iter([()] * len(table))


def _name(values: Mapping[str, Any]) -> str:
    found = next((values[name] for name in _NAMES if name in values), None)
    return "" if found is None else f"<name>{_text(found)}</name>"


def _data(values: Mapping[str, Any]) -> str:
    if not values:
        return ""
    cells = "".join(
        f"<Data name={quoteattr(key)}><value>{_text(value)}</value></Data>"
        for key, value in values.items()
    )
    return f"<ExtendedData>{cells}</ExtendedData>"


def _geometry(shape: Any) -> str:
    """Return a geometry as KML writes it; nothing for an empty one."""
    if shape is None or shape.is_empty:
        return ""
    if isinstance(shape, shapely.Point):
        return f"<Point>{_coordinates(shape)}</Point>"
    if isinstance(shape, shapely.Polygon):
        turned = shapely.orient_polygons(shape)
        inner = "".join(
            f"<innerBoundaryIs>{_ring(ring)}</innerBoundaryIs>" for ring in turned.interiors
        )
        outer = f"<outerBoundaryIs>{_ring(turned.exterior)}</outerBoundaryIs>"
        return f"<Polygon>{outer}{inner}</Polygon>"
    if isinstance(shape, shapely.LineString):
        return f"<LineString><tessellate>1</tessellate>{_coordinates(shape)}</LineString>"
    return f"<MultiGeometry>{''.join(_geometry(part) for part in shape.geoms)}</MultiGeometry>"


def _ring(ring: Any) -> str:
    return f"<LinearRing>{_coordinates(ring)}</LinearRing>"


def _coordinates(shape: Any) -> str:
    places = shapely.get_coordinates(shape).tolist()
    return f"<coordinates>{' '.join(f'{x:.7f},{y:.7f}' for x, y in places)}</coordinates>"


def _style(name: str, style: Style) -> str:
    """Return a shared style; KML writes colours as alpha, blue, green, red."""
    drawn = style.outline or style.colour
    width = max(round(style.size_mm * PIXELS_PER_MM, 1), 1.0)
    line = f"<LineStyle><color>{_abgr(drawn, 1.0)}</color><width>{width:g}</width></LineStyle>"
    if style.kind == "marker":
        look = (
            f"<IconStyle><color>{_abgr(style.colour, style.opacity)}</color>"
            f"<scale>{_MARKER_SCALE}</scale></IconStyle><LabelStyle><scale>0</scale></LabelStyle>"
        )
    elif style.kind == "line":
        look = line
    else:
        fill = f"<color>{_abgr(style.colour, style.opacity)}</color>"
        outline = int(style.outline is not None)
        look = f"{line}<PolyStyle>{fill}<outline>{outline}</outline></PolyStyle>"
    return f"<Style id={quoteattr(name)}>{look}</Style>\n"


def _abgr(colour: str, opacity: float) -> str:
    red, green, blue = rgb(colour)
    return f"{round(255 * opacity):02x}{blue:02x}{green:02x}{red:02x}"


def _id(layer: str, choice: Choice | None) -> str:
    """Return a name that XML takes as an id and a link can point to."""
    words = layer if choice is None else f"{layer} {choice.label}"
    return "style_" + "".join(c if c.isascii() and c.isalnum() else "_" for c in words)


def _text(value: object) -> str:
    return escape(speakable(str(value)))

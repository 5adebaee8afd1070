"""Layer styles as other GIS read them (OGC Styled Layer Descriptor 1.0.0)."""

from __future__ import annotations

from collections.abc import Sequence
from xml.sax.saxutils import escape

from covertool.gis.styles import Choice, Style

_SLD = """<?xml version="1.0" encoding="UTF-8"?>
<StyledLayerDescriptor xmlns="http://www.opengis.net/sld" xmlns:ogc="http://www.opengis.net/ogc"
 version="1.0.0">
 <NamedLayer><Name>{layer}</Name><UserStyle><FeatureTypeStyle><Rule>
  <Title>{title}</Title>{filter}
  {symbolizer}
 </Rule></FeatureTypeStyle></UserStyle></NamedLayer>
</StyledLayerDescriptor>
"""
_FILTER = """
  <ogc:Filter><ogc:PropertyIsEqualTo><ogc:PropertyName>radius_m</ogc:PropertyName>\
<ogc:Literal>{radius}</ogc:Literal></ogc:PropertyIsEqualTo></ogc:Filter>"""
_FILL = (
    '<PolygonSymbolizer><Fill><CssParameter name="fill">{colour}</CssParameter>'
    '<CssParameter name="fill-opacity">{opacity:g}</CssParameter></Fill>{stroke}'
    "</PolygonSymbolizer>"
)
_STROKE = (
    '<Stroke><CssParameter name="stroke">{colour}</CssParameter>'
    '<CssParameter name="stroke-width">{pixels:g}</CssParameter></Stroke>'
)
_LINE = "<LineSymbolizer>{stroke}</LineSymbolizer>"
_MARKER = (
    "<PointSymbolizer><Graphic><Mark><WellKnownName>circle</WellKnownName>"
    '<Fill><CssParameter name="fill">{colour}</CssParameter></Fill>'
    "</Mark><Size>{pixels:g}</Size></Graphic></PointSymbolizer>"
)
_PIXELS_PER_MM = 96 / 25.4


def sld(layer: str, style: Style, choices: Sequence[Choice] = ()) -> str:
    """Return an OGC Styled Layer Descriptor; of several choices it draws the one that is shown.

    >>> from covertool.gis.styles import LAYER_STYLES
    >>> "#e31a1c" in sld("coverage_level_3", LAYER_STYLES["coverage_level_3"])
    True
    """
    drawn = next((choice for choice in choices if choice.shown), None)
    title = style.title or layer
    return _SLD.format(
        layer=escape(layer),
        title=escape(title if drawn is None else f"{title}, {drawn.label}"),
        filter="" if drawn is None else _FILTER.format(radius=f"{drawn.radius_m!r}"),
        symbolizer=_symbolizer(style),
    )


def _symbolizer(style: Style) -> str:
    pixels = round(style.size_mm * _PIXELS_PER_MM, 2)
    stroke_colour = style.outline if style.kind == "fill" else style.colour
    stroke = _STROKE.format(colour=stroke_colour, pixels=pixels) if stroke_colour else ""
    if style.kind == "fill":
        return _FILL.format(colour=style.colour, opacity=style.opacity, stroke=stroke)
    if style.kind == "line":
        return _LINE.format(stroke=stroke)
    return _MARKER.format(colour=style.colour, pixels=pixels)

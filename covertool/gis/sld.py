"""Layer styles as other GIS read them (OGC Styled Layer Descriptor 1.0.0)."""

from __future__ import annotations

from collections.abc import Sequence
from xml.sax.saxutils import escape

from covertool.gis.styles import PIXELS_PER_MM, Choice, Style

_SLD = """<?xml version="1.0" encoding="UTF-8"?>
<StyledLayerDescriptor xmlns="http://www.opengis.net/sld" xmlns:ogc="http://www.opengis.net/ogc"
 version="1.0.0">
 <NamedLayer><Name>{layer}</Name><UserStyle><FeatureTypeStyle>
{rules}
 </FeatureTypeStyle></UserStyle></NamedLayer>
</StyledLayerDescriptor>
"""
_RULE = """  <Rule><Title>{title}</Title>{filter}
   {symbolizer}
  </Rule>"""
_FILTER = """
   <ogc:Filter><ogc:PropertyIsEqualTo><ogc:PropertyName>{column}</ogc:PropertyName>\
<ogc:Literal>{value}</ogc:Literal></ogc:PropertyIsEqualTo></ogc:Filter>"""
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


def sld(layer: str, style: Style, choices: Sequence[Choice] = ()) -> str:
    """Return an OGC Styled Layer Descriptor; of several choices it draws those that are shown.

    >>> from covertool.gis.styles import LAYER_STYLES
    >>> "#e31a1c" in sld("coverage_level_3", LAYER_STYLES["coverage_level_3"])
    True
    """
    title = style.title or layer
    drawn = [choice for choice in choices if choice.shown]
    rules = [
        _rule(f"{title}, {choice.label}", choice.style, choice.column, choice.value)
        for choice in drawn
    ] or [_rule(title, style)]
    return _SLD.format(layer=escape(layer), rules="\n".join(rules))


def _rule(title: str, style: Style, column: str = "", value: float | str = "") -> str:
    chosen = _FILTER.format(column=escape(column), value=escape(str(value))) if column else ""
    return _RULE.format(title=escape(title), filter=chosen, symbolizer=_symbolizer(style))


def _symbolizer(style: Style) -> str:
    pixels = round(style.size_mm * PIXELS_PER_MM, 2)
    stroke_colour = style.outline if style.kind == "fill" else style.colour
    stroke = _STROKE.format(colour=stroke_colour, pixels=pixels) if stroke_colour else ""
    if style.kind == "fill":
        return _FILL.format(colour=style.colour, opacity=style.opacity, stroke=stroke)
    if style.kind == "line":
        return _LINE.format(stroke=stroke)
    return _MARKER.format(colour=style.colour, pixels=pixels)

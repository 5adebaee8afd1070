"""The paper's colours, as QGIS (QML) and other GIS (SLD) styles."""

from __future__ import annotations

from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

LEVEL_COLOURS = {1: "#ffdc00", 2: "#ff8c00", 3: "#e0201b"}
"""Yellow, orange and red for Levels 1, 2 and 3, as in the paper's figures."""
TRANSIT_COLOUR = "#2f6fd0"
PARKED_COLOUR = "#000000"


@dataclass(frozen=True)
class Style:
    """How a layer looks: its kind of symbol, colour, opacity and size."""

    kind: str
    colour: str
    opacity: float = 1.0
    size_mm: float = 1.0


LAYER_STYLES = {
    "coverage_level_1": Style("fill", LEVEL_COLOURS[1], 0.85),
    "coverage_level_2": Style("fill", LEVEL_COLOURS[2], 0.85),
    "coverage_level_3": Style("fill", LEVEL_COLOURS[3], 0.85),
    "transit": Style("fill", TRANSIT_COLOUR, 0.6),
    "anchors": Style("marker", PARKED_COLOUR, size_mm=0.9),
    "vehicles": Style("fill", PARKED_COLOUR, 0.8),
    "segments": Style("line", "#5b2a86", size_mm=0.8),
    "trajectories": Style("line", "#0b7a5e", size_mm=0.4),
}

_QML = """<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis version="3.22" styleCategories="Symbology">
 <renderer-v2 type="singleSymbol" symbollevels="0" enableorderby="0" forceraster="0">
  <symbols>
   <symbol type="{kind}" name="0" alpha="{opacity:g}" clip_to_extent="1" force_rhr="0">
    <layer class="{symbol}" enabled="1" locked="0" pass="0">
     <Option type="Map">
{options}
     </Option>
    </layer>
   </symbol>
  </symbols>
 </renderer-v2>
</qgis>
"""

_SYMBOLS = {"fill": "SimpleFill", "line": "SimpleLine", "marker": "SimpleMarker"}

_SLD = """<?xml version="1.0" encoding="UTF-8"?>
<StyledLayerDescriptor xmlns="http://www.opengis.net/sld" version="1.0.0">
 <NamedLayer><Name>{layer}</Name><UserStyle><FeatureTypeStyle><Rule>
  {symbolizer}
 </Rule></FeatureTypeStyle></UserStyle></NamedLayer>
</StyledLayerDescriptor>
"""

_SYMBOLIZERS = {
    "fill": "<PolygonSymbolizer><Fill>"
    '<CssParameter name="fill">{colour}</CssParameter>'
    '<CssParameter name="fill-opacity">{opacity:g}</CssParameter>'
    "</Fill></PolygonSymbolizer>",
    "line": "<LineSymbolizer><Stroke>"
    '<CssParameter name="stroke">{colour}</CssParameter>'
    '<CssParameter name="stroke-width">{pixels:g}</CssParameter>'
    "</Stroke></LineSymbolizer>",
    "marker": "<PointSymbolizer><Graphic><Mark><WellKnownName>circle</WellKnownName>"
    '<Fill><CssParameter name="fill">{colour}</CssParameter></Fill>'
    "</Mark><Size>{pixels:g}</Size></Graphic></PointSymbolizer>",
}

_PIXELS_PER_MM = 96 / 25.4


def qml(style: Style) -> str:
    """Return a QGIS layer style.

    >>> 'value="255,220,0,255"' in qml(LAYER_STYLES["coverage_level_1"])
    True
    """
    red, green, blue = (int(style.colour[i : i + 2], 16) for i in (1, 3, 5))
    rgba = f"{red},{green},{blue},255"
    values = {
        "fill": {"color": rgba, "style": "solid", "outline_style": "no"},
        "line": {
            "line_color": rgba,
            "line_style": "solid",
            "line_width": f"{style.size_mm:g}",
            "line_width_unit": "MM",
        },
        "marker": {
            "color": rgba,
            "name": "circle",
            "outline_style": "no",
            "size": f"{style.size_mm:g}",
            "size_unit": "MM",
        },
    }[style.kind]
    options = "\n".join(
        f'      <Option type="QString" name={quoteattr(name)} value={quoteattr(value)}/>'
        for name, value in values.items()
    )
    return _QML.format(
        kind=style.kind, opacity=style.opacity, symbol=_SYMBOLS[style.kind], options=options
    )


def sld(layer: str, style: Style) -> str:
    """Return an OGC Styled Layer Descriptor (1.0.0).

    >>> "#e0201b" in sld("coverage_level_3", LAYER_STYLES["coverage_level_3"])
    True
    """
    symbolizer = _SYMBOLIZERS[style.kind].format(
        colour=style.colour,
        opacity=style.opacity,
        pixels=round(style.size_mm * _PIXELS_PER_MM, 2),
    )
    return _SLD.format(layer=layer, symbolizer=symbolizer)

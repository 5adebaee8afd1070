"""Layer styles as QGIS reads them (QML), the only ones that it takes from a GeoPackage."""

from __future__ import annotations

from collections.abc import Sequence
from xml.sax.saxutils import quoteattr

from covertool.gis.styles import Choice, Style, rgb

_QML = """<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis version="3.22" styleCategories="Symbology">
{renderer}
</qgis>
"""
_SINGLE = """ <renderer-v2 type="singleSymbol" symbollevels="0" enableorderby="0" forceraster="0">
  <symbols>
{symbols}
  </symbols>
 </renderer-v2>"""
_RULES = """ <renderer-v2 type="RuleRenderer" symbollevels="0" enableorderby="0" forceraster="0">
  <rules key="root">
{rules}
  </rules>
  <symbols>
{symbols}
  </symbols>
 </renderer-v2>"""
_SYMBOL = """   <symbol type="{kind}" name="{name}" alpha="1" clip_to_extent="1" force_rhr="0">
    <layer class="{symbol}" enabled="1" locked="0" pass="0">
     <Option type="Map">
{options}
     </Option>
    </layer>
   </symbol>"""
_CLASSES = {"fill": "SimpleFill", "line": "SimpleLine", "marker": "SimpleMarker"}


def qml(style: Style, choices: Sequence[Choice] = ()) -> str:
    """Return a QGIS layer style, with one rule to tick for each choice.

    >>> from covertool.gis.styles import LAYER_STYLES
    >>> 'value="255,217,47,255"' in qml(LAYER_STYLES["coverage_level_1"])
    True
    """
    if not choices:
        return _QML.format(renderer=_SINGLE.format(symbols=_symbol(style, 0)))
    rules = "\n".join(
        f'   <rule key="{number}" symbol="{number}" checkstate="{int(choice.shown)}"'
        f" label={quoteattr(choice.label)}"
        f" filter={quoteattr(_filter(choice))}/>"
        for number, choice in enumerate(choices)
    )
    symbols = "\n".join(_symbol(choice.style, place) for place, choice in enumerate(choices))
    return _QML.format(renderer=_RULES.format(rules=rules, symbols=symbols))


def _filter(choice: Choice) -> str:
    return f'"{choice.column}" = {choice.value!r}'


def _symbol(style: Style, number: int) -> str:
    options = "\n".join(
        f'      <Option type="QString" name={quoteattr(name)} value={quoteattr(value)}/>'
        for name, value in _options(style).items()
    )
    return _SYMBOL.format(
        kind=style.kind, name=number, symbol=_CLASSES[style.kind], options=options
    )


def _options(style: Style) -> dict[str, str]:
    """Return the settings of a symbol by QGIS's names for them."""
    colour = _rgba(style.colour, style.opacity)
    if style.kind == "fill":
        if style.outline is None:
            return {"color": colour, "style": "solid", "outline_style": "no"}
        return {
            "color": colour,
            "style": "solid",
            "outline_style": "solid",
            "outline_color": _rgba(style.outline, 1.0),
            "outline_width": f"{style.size_mm:g}",
            "outline_width_unit": "MM",
        }
    if style.kind == "line":
        return {
            "line_color": colour,
            "line_style": "solid",
            "line_width": f"{style.size_mm:g}",
            "line_width_unit": "MM",
        }
    return {"color": colour, "name": "circle", "outline_style": "no", **_marker_size(style)}


def _marker_size(style: Style) -> dict[str, str]:
    """Return a size true to the ground within bounds on paper, or one on paper."""
    if style.size_m is None:
        return {"size": f"{style.size_mm:g}", "size_unit": "MM"}
    smallest, largest = style.size_mm / 3, style.size_mm * 2
    return {
        "size": f"{style.size_m:g}",
        "size_unit": "RenderMetersInMapUnits",
        "size_map_unit_scale": f"3x:0,0,1,{smallest:.2g},1,{largest:g}",
    }


def _rgba(colour: str, opacity: float) -> str:
    red, green, blue = rgb(colour)
    return f"{red},{green},{blue},{round(255 * opacity)}"

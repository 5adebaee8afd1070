"""The whole page: parts, map, plots, style and script put into one template."""

from __future__ import annotations

import re
from dataclasses import dataclass
from importlib import resources
from typing import TYPE_CHECKING

from jinja2 import DictLoader, Environment, StrictUndefined
from markupsafe import Markup

from covertool import __version__
from covertool import crs as crs_door
from covertool.errors import FileError
from covertool.report.page import embed
from covertool.report.page.blocks import Section
from covertool.report.page.congestion import congestion_section
from covertool.report.page.coverage import by_radius, coverage_section
from covertool.report.page.limits import limits_section
from covertool.report.page.mapfigure import TownMap, town_map
from covertool.report.page.maplayer import MapLayer
from covertool.report.page.mapping import map_layers
from covertool.report.page.positioning import positioning_section
from covertool.report.page.study import ReportStudy, in_one_crs
from covertool.report.page.whence import provenance_section

if TYPE_CHECKING:
    from bokeh.models import Model


_UNIT = re.compile(r"(?<=\d) (%|m\b|m²|km\b)")


@dataclass(frozen=True)
class Switch:
    """One check box of the map.

    Attributes
    ----------
    key, label, form : as in :class:`covertool.report.page.maplayer.MapLayer`
    light, dark : its colour in both schemes
    on : whether it is ticked at first
    """

    key: str
    label: str
    form: str
    light: str
    dark: str
    on: bool


def report_page(study: ReportStudy) -> str:
    """Return the report of a study as one HTML page that needs nothing else.

    The page computes nothing: it shows the layers and tables that the study holds, and names the
    verb that makes each missing part. The same study gives the same text.

    Raises
    ------
    FileError
        When the study has no layer to draw and no table to print.

    Examples
    --------
    >>> from pyproj import CRS
    >>> from covertool.model import Anchors
    >>> cars = Anchors.from_points([0.0, 90.0], [0.0, 40.0], CRS(2157)).to_frame()
    >>> study = ReportStudy("town.gpkg", 64 * "0", {"anchors": cars}, {}, {"title": "A town"})
    >>> "A town" in report_page(study)
    True
    """
    if not any(len(frame) for frame in study.layers.values()) and not study.tables:
        raise FileError(
            "the study holds no layer or table that the report shows",
            study.name,
            "make one with covertool transit, extract and coverage",
        )
    drawn, crs = _map(study)
    sections = [
        coverage_section(study),
        congestion_section(study),
        positioning_section(study),
        limits_section(study),
        provenance_section(study, drawn, crs),
    ]
    return _render(study, drawn, crs, sections)


def _map(study: ReportStudy) -> tuple[TownMap | None, str]:
    """Return the map of all that has a place, and the name of its CRS."""
    placed = {
        name: frame[~(frame.geometry.isna() | frame.geometry.is_empty)]
        for name, frame in study.layers.items()
    }
    filled = {name: frame for name, frame in placed.items() if len(frame)}
    if not filled:
        return None, ""
    layers, crs = in_one_crs(filled)
    return town_map(map_layers(study, layers)), crs_door.name(crs)


def _render(study: ReportStudy, drawn: TownMap | None, crs: str, sections: list[Section]) -> str:
    """Return the page with everything that it needs put into it."""
    figures: dict[str, Model] = {}
    if drawn is not None:
        figures["map"] = drawn.plot
    figures |= {plot.key: plot.figure for section in sections for plot in section.plots}
    scripts = [embed.bokeh_script(), _part("page.js")]
    environment = Environment(
        loader=DictLoader({"page": _part("page.html"), "blocks": _part("blocks.html")}),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["units"] = _units
    return environment.get_template("page").render(
        study=study,
        version=__version__,
        map=drawn,
        crs=crs,
        switches=_switches(drawn.layers) if drawn else [],
        facts=_facts(study),
        sections=sections,
        policy=Markup(embed.content_policy(scripts)),
        style=Markup(_part("page.css")),
        scripts=[Markup(script) for script in scripts],
        figures=Markup(embed.figures_json(figures)),
    )


def _units(text: str) -> str:
    """Return a text whose numbers keep their units beside them."""
    return _UNIT.sub("\u00a0\\1", text)


def _part(name: str) -> str:
    place = resources.files("covertool.report.page") / "templates" / name
    return place.read_text(encoding="utf-8")


def _switches(layers: tuple[MapLayer, ...]) -> list[Switch]:
    """Return the check boxes from the top layer down; they are the legend as well."""
    found = {
        layer.key: Switch(layer.key, layer.label, layer.form, *layer.colour, layer.shown)
        for layer in layers
    }
    return list(found.values())[::-1]


def _facts(study: ReportStudy) -> list[tuple[str, str]]:
    """Return the figures at the head of the page, as the study holds them."""
    facts: list[tuple[str, str]] = []
    if "transit" in study.layers and "area_m2" in study.layers["transit"]:
        area = float(study.layers["transit"]["area_m2"].sum())
        facts.append((f"{area:,.0f} m²", "transit area: where cars drive"))
    if "anchors" in study.layers:
        facts.append((f"{len(study.layers['anchors']):,}", "parked cars and other anchors"))
    summary = study.table("coverage_summary")
    if summary is not None:
        # The first radius; the section on coverage has them all.
        for name, rows in list(by_radius(summary).items())[:1]:
            covered = 100 * (1 - float(rows[0]["fraction"]))
            three = 100 * float(rows[3]["fraction"])
            facts.append((f"{covered:.1f} %", f"hears one parked car or more, at {name}"))
            facts.append((f"{three:.1f} %", f"hears three or more, at {name}"))
    return facts

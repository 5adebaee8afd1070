"""The page's last part: where its figures come from, and how the map was drawn."""

from __future__ import annotations

import shlex
from typing import Any

from covertool import __version__
from covertool.gis.provenance import provenances
from covertool.report.page.blocks import Block, Missing, Prose, Section, Table
from covertool.report.page.mapfigure import TownMap
from covertool.report.page.study import ReportStudy


def provenance_section(study: ReportStudy, drawn: TownMap | None, crs: str) -> Section:
    """Return the study's fingerprint, each verb's command and inputs, and the versions."""
    told = study.provenance()
    blocks: list[Block] = [
        Prose(
            (
                f"Made by covertool {__version__} from {study.name}, SHA-256 {study.sha256}."
                " The same study gives the same page, byte for byte.",
                *_drawing(drawn, crs),
            )
        )
    ]
    if not told:
        blocks.append(
            Missing("which command wrote what into this study", study.command("coverage"))
        )
    else:
        blocks += [_commands(told), _inputs(told), _versions(told)]
    blocks.append(_said(study))
    return Section("provenance", "Provenance", tuple(block for block in blocks if _filled(block)))


def _filled(block: Block) -> bool:
    return not isinstance(block, Table) or bool(block.rows)


def _drawing(drawn: TownMap | None, crs: str) -> list[str]:
    if drawn is None:
        return []
    return [
        f"The map lies in {crs}. To keep the page small its lines are drawn to within"
        f" {drawn.tolerance_m:g} m, rounded to decimetres, and patches smaller than"
        f" {(2 * drawn.tolerance_m) ** 2:g} m² are left out. Tables and pop-ups give the study's"
        " own figures.",
        *drawn.thinned,
    ]


def _said(study: ReportStudy) -> Table:
    _, others = provenances(study.metadata)
    rows = tuple(others.items())
    return Table("What the study says of itself", ("Key", "Value"), rows, words=2)


def _commands(told: list[dict[str, Any]]) -> Table:
    rows = tuple(
        (str(one["verb"]), f"covertool {shlex.join(map(str, one.get('command', ())))}", _seeds(one))
        for one in told
    )
    heads = ("Part", "Command", "Seeds and options")
    return Table("How each part was made", heads, rows, words=3)


def _seeds(one: dict[str, Any]) -> str:
    pairs = {**_mapping(one.get("seeds")), **_mapping(one.get("options"))}
    return ", ".join(f"{name} {value}" for name, value in pairs.items()) or "–"


def _inputs(told: list[dict[str, Any]]) -> Table:
    found: dict[tuple[str, str], list[str]] = {}
    for one in told:
        for given in one.get("inputs", ()):
            if isinstance(given, dict):
                place = (str(given.get("path", "")), str(given.get("sha256", "")))
                found.setdefault(place, []).append(str(one["verb"]))
    rows = tuple((path, sha, ", ".join(verbs)) for (path, sha), verbs in found.items())
    return Table("Inputs", ("File", "SHA-256", "Read by"), rows, words=3)


def _versions(told: list[dict[str, Any]]) -> Table:
    """Return the versions of every engine that wrote into the study."""
    names = list(dict.fromkeys(name for one in told for name in _mapping(one.get("versions"))))
    rows = tuple(
        (
            str(name),
            ", ".join(
                dict.fromkeys(
                    str(_mapping(one.get("versions"))[name])
                    for one in told
                    if name in _mapping(one.get("versions"))
                )
            ),
        )
        for name in names
    )
    return Table("Versions", ("Engine", "Version"), rows, words=2, folded=True)


def _mapping(value: Any) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}

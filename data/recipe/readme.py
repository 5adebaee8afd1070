"""The parts of data/README.md that follow from the files: calibration, sizes, checksums."""

from __future__ import annotations

import hashlib
from pathlib import Path

from covertool.coverage import coverage_levels
from covertool.model import Anchors, TransitArea
from data.recipe.parameters import SEED, TABLE_IV_PERCENT

FILES = ("sample.gpkg", "observations.csv", "orthophoto.tif", "road_mask.tif", "trace.parquet")
_BEGIN, _END = "<!-- made by data/recipe/readme.py -->\n", "<!-- end -->\n"


def write_readme(folder: Path, transit: TransitArea, anchors: Anchors) -> None:
    """Replace the part of data/README.md between the two marks."""
    path = folder / "README.md"
    text = path.read_text(encoding="utf-8")
    before, rest = text.split(_BEGIN)
    after = rest.split(_END)[1]
    tables = "\n".join([*_calibration(transit, anchors), "", *_checksums(folder), ""])
    path.write_text(before + _BEGIN + tables + _END + after, encoding="utf-8")


def _calibration(transit: TransitArea, anchors: Anchors) -> list[str]:
    report = coverage_levels(anchors, transit, list(TABLE_IV_PERCENT))
    lines = [
        f"Seed {SEED}. Transit area {transit.area_m2:,.0f} m2, {len(anchors)} parked cars.",
        "",
        "| radius | level | paper's Table IV, % | this town, %, calibrated | difference |",
        "| --- | --- | ---: | ---: | ---: |",
    ]
    for result in report.results:
        target = TABLE_IV_PERCENT[float(result.radius_m or 0)]
        for level, fraction in enumerate(result.fractions):
            lines.append(
                f"| {result.radius_m:g} m | Level {level} | {target[level]:.2f} "
                f"| {100 * fraction:.2f} | {100 * fraction - target[level]:+.2f} |"
            )
    return lines


def _checksums(folder: Path) -> list[str]:
    lines = ["| file | bytes | sha256 |", "| --- | ---: | --- |"]
    for name in FILES:
        content = (folder / name).read_bytes()
        lines.append(f"| {name} | {len(content)} | {hashlib.sha256(content).hexdigest()} |")
    return lines

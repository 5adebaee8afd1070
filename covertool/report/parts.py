"""The parts of a study that become tables, each with the command that makes it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Part:
    """A part of a study that becomes a sheet.

    Attributes
    ----------
    table : its table in the study
    title : headline of the sheet
    mend : the command that makes it, with STUDY for the study's path
    """

    table: str
    title: str
    mend: str


PARTS: Mapping[str, Part] = {
    "coverage": Part(
        "coverage_summary",
        "Share of the transit area that hears one, two, or three and more stationary cars",
        "covertool coverage STUDY --radius 15 --into STUDY",
    ),
    "curve": Part(
        "coverage_curve",
        "Coverage against the radius",
        "covertool coverage STUDY --radius 15 --curve 5:100:20 --into STUDY",
    ),
    "penetration": Part(
        "coverage_penetration",
        "Expected coverage when only a share of the cars carries a device",
        "covertool coverage STUDY --radius 15 --penetration 0.1,0.5,1 --into STUDY",
    ),
    "zones": Part(
        "coverage_zones",
        "Coverage of each zone",
        "covertool coverage STUDY --radius 15 --by ZONES --into STUDY",
    ),
    "congestion": Part(
        "occupancy",
        "Street length that is slow or stands, by weekday and time",
        "covertool congestion table OBSERVATIONS --into STUDY",
    ),
    "congestion_means": Part(
        "occupancy_means",
        "Street length that is slow or stands, means over days",
        "covertool congestion table OBSERVATIONS --into STUDY",
    ),
    "positioning": Part(
        "positioning",
        "Position errors of moving cars",
        "covertool simulate STUDY --into STUDY",
    ),
    "improvements": Part(
        "improvements",
        "How much parked cars take off the position error",
        "covertool simulate STUDY --into STUDY",
    ),
    "parked_met": Part(
        "parked_met",
        "Parked cars that a moving car meets on its way",
        "covertool simulate STUDY --into STUDY",
    ),
}

"""The parts of a study, tables and layers, each with the command that makes it."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass

from covertool.errors import FileError
from covertool.model import LEVELS


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

    def absent(self, study: str) -> FileError:
        """Return the error that a study lacks this part, with the command that makes it."""
        words = self.table.replace("_", " ")
        return FileError(f"the study holds no {words}", study, typed(self.mend, study))


def typed(command: str, study: str) -> str:
    """Return a command about STUDY as it is typed for a study.

    >>> typed("covertool simulate STUDY --into STUDY", "my town.gpkg")
    "covertool simulate 'my town.gpkg' --into 'my town.gpkg'"
    """
    return command.replace("STUDY", shlex.quote(study))


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
        "covertool congestion table OBSERVATIONS --segments STUDY --tz ZONE --into STUDY",
    ),
    "congestion_means": Part(
        "occupancy_means",
        "Street length that is slow or stands, means over days",
        "covertool congestion table OBSERVATIONS --segments STUDY --tz ZONE --into STUDY",
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

LAYER_MENDS: Mapping[str, str] = {
    "transit": "covertool transit FILE --into STUDY",
    "anchors": "covertool anchors parked --osm FILE --into STUDY",
    "vehicles": "covertool extract IMAGE --into STUDY",
    "segments": "covertool simulate STUDY -o NEW.gpkg",
    "congestion": "covertool congestion map OBSERVATIONS --segments STUDY --tz ZONE --into STUDY",
    "trajectories": "covertool simulate STUDY --into STUDY",
    **{
        f"coverage_level_{level}": "covertool coverage STUDY --radius 15 --into STUDY"
        for level in LEVELS[1:]
    },
}
"""The command that makes each layer, with STUDY for the study's path."""

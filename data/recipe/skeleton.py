"""The hand-drawn part of the town: through roads, reserved land, car parks, the built edge.

Coordinates are metres east and north of the middle of Main Street. The drawing is our own: it
has the character of a small Irish university town, and copies no map.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from data.recipe.curves import Points, resample, smooth
from data.recipe.parameters import WIDTHS_M


@dataclass(frozen=True)
class Street:
    """A street's centre line with its class, name and parking habit.

    ``frontage`` says what stands along it: terrace, houses, ribbon (single houses far back) or
    none. ``closed`` is True for a cul-de-sac, which ends in a turning head.
    """

    name: str
    kind: str
    points: Points
    frontage: str
    closed: bool = False

    @property
    def width_m(self) -> float:
        """Carriageway width in metres."""
        return WIDTHS_M[self.kind]

    @property
    def line(self) -> shapely.LineString:
        """The centre line as a shapely geometry."""
        return shapely.LineString(self.points)


@dataclass(frozen=True)
class CarPark:
    """A car park: parallel aisles between bays, joined by a cross aisle at both ends."""

    name: str
    x_m: float
    y_m: float
    angle_deg: float
    length_m: float
    aisles: int


_THROUGH_ROADS: tuple[tuple[str, str, str, tuple[tuple[float, float], ...]], ...] = (
    ("Main Street", "main", "terrace", ((-250, 0), (-90, 8), (60, 20), (220, 44), (380, 60))),
    (
        "West Road",
        "arterial",
        "none",
        ((-250, 0), (-420, 30), (-700, 70), (-1000, 150), (-1350, 170), (-1900, 260)),
    ),
    (
        "Moat Road",
        "regional",
        "houses",
        ((-250, 0), (-300, 130), (-360, 330), (-500, 640), (-720, 960), (-830, 1500)),
    ),
    (
        "Demesne Road",
        "regional",
        "houses",
        ((380, 60), (470, 180), (560, 350), (720, 690), (880, 1060), (900, 1600)),
    ),
    (
        "East Road",
        "arterial",
        "houses",
        ((380, 60), (560, 55), (820, 10), (1200, -60), (1500, -70), (2000, -160)),
    ),
    (
        "South Road",
        "arterial",
        "none",
        ((60, 20), (75, -150), (90, -330), (120, -560), (150, -830), (210, -1150), (190, -1600)),
    ),
    (
        "Abbey Road",
        "regional",
        "houses",
        ((95, -380), (260, -450), (520, -590), (860, -740), (1150, -980), (1600, -1150)),
    ),
    (
        "Canal Road",
        "regional",
        "houses",
        ((-250, 0), (-310, -130), (-420, -290), (-640, -430), (-960, -560), (-1300, -640)),
    ),
    (
        "North Link",
        "collector",
        "none",
        ((-455, 540), (-260, 560), (0, 520), (300, 590), (520, 600), (676, 598)),
    ),
    (
        "South Ring",
        "collector",
        "none",
        ((-790, -490), (-640, -650), (-380, -760), (-100, -790), (148, -815), (420, -850)),
    ),
    ("South Ring East", "collector", "none", ((420, -850), (640, -830), (860, -740))),
    (
        "East Ring",
        "collector",
        "none",
        ((520, -590), (640, -440), (720, -230), (790, -80), (820, 10)),
    ),
    ("Mill Lane", "residential", "terrace", ((-90, 8), (-100, 110), (-60, 230), (20, 330))),
    ("Back Lane", "residential", "terrace", ((60, 20), (70, 130), (20, 220), (-62, 228))),
    ("Fair Street", "residential", "terrace", ((220, 44), (225, 160), (280, 280), (300, 400))),
    ("Chapel Street", "residential", "terrace", ((-90, 8), (-110, -70), (-60, -105), (68, -95))),
    ("Harbour Street", "residential", "terrace", ((220, 44), (232, -50), (180, -92), (71, -95))),
)

_RESERVED: dict[str, tuple[tuple[float, float], ...]] = {
    "south campus": ((-300, -20), (-450, -230), (-660, -390), (-900, -480), (-950, 90), (-600, 20)),
    "north campus": ((-345, 90), (-395, 280), (-480, 450), (-880, 460), (-930, 190), (-600, 100)),
    "castle park": ((-230, 40), (-130, 45), (-130, 250), (-210, 330), (-290, 260)),
    "retail park": ((130, -190), (420, -190), (560, -330), (470, -470), (280, -420), (120, -330)),
    "business park": ((640, 120), (900, 60), (1150, 90), (1130, 420), (760, 480), (620, 300)),
    "industrial estate": ((260, -900), (640, -890), (880, -820), (980, -1060), (420, -1160)),
    "sports ground": ((-380, -480), (-180, -470), (-170, -680), (-380, -690)),
    "school ground": ((330, 250), (500, 360), (600, 560), (320, 545)),
    "greens": ((-900, 560), (-760, 560), (-760, 690), (-900, 690)),
    "south green": ((620, -160), (690, -160), (660, -330), (560, -300)),
}

RAILWAY = smooth(
    np.array(
        [
            (-1900, -60),
            (-1100, -260),
            (-500, -170),
            (75, -140),
            (500, -150),
            (1100, -260),
            (2000, -300),
        ],
        dtype=float,
    )
)
"""Canal and railway side by side; only through roads cross them."""

_BUILT_EDGE = np.array(
    [
        (-1270, 420), (-1120, 800), (-720, 1050), (-150, 1010), (300, 1080), (800, 1010),
        (1060, 780), (1200, 380), (1330, -60), (1240, -480), (1180, -900), (880, -1120),
        (350, -1240), (-300, -1150), (-850, -980), (-1220, -640), (-1330, -160),
    ],
    dtype=float,
)  # fmt: skip

CAR_PARKS: tuple[CarPark, ...] = (
    CarPark("South campus library car park", -520, -90, 8, 90, 3),
    CarPark("South campus west car park", -800, -60, 12, 110, 3),
    CarPark("South campus canal car park", -700, -300, -32, 100, 2),
    CarPark("North campus sports car park", -800, 300, 10, 100, 4),
    CarPark("North campus east car park", -450, 190, 75, 80, 2),
    CarPark("North campus residence car park", -620, 390, 4, 80, 2),
    CarPark("Station car park", 260, -225, -2, 130, 2),
    CarPark("Supermarket car park", 340, -300, -24, 100, 4),
    CarPark("Retail park car park", 200, -270, 82, 80, 2),
    CarPark("Business park north car park", 860, 330, 14, 110, 3),
    CarPark("Business park south car park", 800, 160, -10, 90, 2),
    CarPark("Business park east car park", 1040, 220, 80, 100, 2),
    CarPark("Industrial estate west car park", 400, -960, 4, 70, 2),
    CarPark("Industrial estate east car park", 760, -950, 18, 80, 2),
    CarPark("School car park", 420, 470, -30, 50, 2),
    CarPark("Sports ground car park", -270, -520, 2, 70, 2),
    CarPark("Castle car park", -175, 120, 78, 50, 2),
    CarPark("Main Street back car park", 140, 110, 84, 60, 2),
    CarPark("Chapel car park", -20, -50, 4, 50, 2),
)


def through_roads() -> list[Street]:
    """Return the hand-drawn roads, smoothed, with vertices about every 4 m."""
    return [
        Street(name, kind, resample(smooth(np.array(corners, dtype=float)), 4.0), frontage)
        for name, kind, frontage, corners in _THROUGH_ROADS
    ]


def reserved_land() -> dict[str, shapely.Polygon]:
    """Return the land that estates may not grow into, by name."""
    return {name: shapely.Polygon(corners) for name, corners in _RESERVED.items()}


def railway_strip() -> shapely.Polygon:
    """Return the strip of land that canal and railway take."""
    return shapely.LineString(RAILWAY).buffer(20.0, cap_style="flat")


def built_edge(scale: float) -> shapely.Polygon:
    """Return the edge of the built-up town, stretched about its middle."""
    return shapely.Polygon(smooth(np.vstack([_BUILT_EDGE, _BUILT_EDGE[:1]]) * scale))

"""Streets: cross-sections of strips with lanes, parked rows, verges, medians, rails; junctions."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from renderer import markings
from renderer.canvas import Pose, box
from renderer.furniture import draw_island, draw_person, draw_planter, draw_pole, draw_stain
from renderer.scene import Scene
from renderer.vegetation import draw_bush, draw_shrubs

Span = tuple[float, float]


@dataclass(frozen=True)
class Strip:
    """A strip along a street: its kind and its left and right edge (metres to the right)."""

    kind: str
    left_m: float
    right_m: float

    @property
    def middle_m(self) -> float:
        """The offset of the strip's centre line."""
        return (self.left_m + self.right_m) / 2


@dataclass(frozen=True)
class Street:
    """A straight street: its pose, its strips, and how it is parked and driven on."""

    pose: Pose
    strips: tuple[Strip, ...]
    left_hand: bool
    occupied: float
    queued: bool

    def edges(self, kinds: tuple[str, ...]) -> Span:
        """Return the outer offsets of the strips of given kinds."""
        found = [s for s in self.strips if s.kind in kinds]
        return min(s.left_m for s in found), max(s.right_m for s in found)


def random_street(scene: Scene, pose: Pose) -> Street:
    """Return a street of random cross-section, from a lane between kerbs to an arterial."""
    rng = scene.rng
    lanes = int(rng.choice([1, 1, 2, 3, 4], p=[0.4, 0.2, 0.2, 0.15, 0.05]))
    lane_m = rng.uniform(2.7, 3.6)
    kerb = ["parallel", "perpendicular", "diagonal", "none"]
    sides = []
    for _ in range(2):
        side: list[tuple[str, float]] = []
        parking = str(rng.choice(kerb, p=[0.5, 0.15, 0.08, 0.27]))
        if parking != "none":
            wide = {"parallel": (1.9, 2.4), "perpendicular": (4.6, 5.6), "diagonal": (4.3, 5.2)}
            side.append((parking, rng.uniform(*wide[parking])))
        if rng.random() < 0.45:
            side.append(("verge", rng.uniform(0.6, 3.5)))
        if rng.random() < 0.25:
            side.append(("cycle", rng.uniform(1.2, 2.4)))
        side.append(("pavement", rng.uniform(1.2, 5.0)))
        sides.append(side)
    median = [("median", rng.uniform(0.8, 6.0))] if lanes > 1 and rng.random() < 0.45 else []
    if not median and rng.random() < 0.15:
        median = [("tram", rng.uniform(6.0, 7.5))]
    flow = [("lane", lane_m)] * lanes
    row = sides[0][::-1] + flow + median + flow + sides[1]
    if lanes == 1 and not median and rng.random() < 0.3:
        row = sides[0][::-1] + flow + sides[1]
    edge, strips = -sum(width for _, width in row) / 2, []
    for kind, width in row:
        strips.append(Strip(kind, edge, edge + width))
        edge += width
    occupied = float(rng.choice([rng.uniform(0, 0.3), rng.uniform(0.3, 1.0)], p=[0.3, 0.7]))
    return Street(pose, tuple(strips), rng.random() < 0.3, occupied, rng.random() < 0.35)


_GROUND = {
    "lane": "road", "parallel": "road", "perpendicular": "road", "diagonal": "road",
    "verge": "green", "cycle": "square", "pavement": "pavement", "median": "green", "tram": "road",
}  # fmt: skip


def pave(scene: Scene, street: Street, spans: list[Span], kinds: tuple[str, ...]) -> None:
    """Lay the ground of the strips of given kinds over spans of the street, with kerbs."""
    rng = scene.rng
    bay_ground = str(rng.choice(["road", "square", "lot"], p=[0.6, 0.25, 0.15]))
    kerb_tone = rng.uniform(0.55, 0.95)
    for strip in street.strips:
        if strip.kind not in kinds:
            continue
        bays = strip.kind in ("parallel", "perpendicular", "diagonal")
        ground = bay_ground if bays else _GROUND[strip.kind]
        for u0, u1 in spans:
            area = street.pose.place(box(u0, u1, strip.left_m, strip.right_m))
            scene.ground(area, ground)
            scene.reserve(area)
            if strip.kind in ("verge", "pavement", "median", "cycle"):
                for v in (strip.left_m, strip.right_m):
                    edge = street.pose.place([[u0, v], [u1, v]])
                    scene.canvas.line(edge, 0.16, (kerb_tone,) * 3, 0.8)


def mark(scene: Scene, street: Street, spans: list[Span]) -> None:
    """Paint lane lines, arrows and rails; leave some streets bare."""
    rng, canvas = scene.rng, scene.canvas
    bare = rng.random() < 0.15
    lanes = [s for s in street.strips if s.kind == "lane"]
    for u0, u1 in spans:
        for left, right in pairwise(lanes):
            if not bare and abs(left.right_m - right.left_m) < 0.01:
                dash = float(rng.choice([0.0, rng.uniform(1.5, 4.0)], p=[0.2, 0.8]))
                markings.lane_line(
                    canvas, street.pose, u0, u1, left.right_m, rng, dash_m=dash, ink=scene.ink
                )
        if not bare and rng.random() < 0.4:
            for v in (lanes[0].left_m + 0.2, lanes[-1].right_m - 0.2):
                markings.lane_line(canvas, street.pose, u0, u1, v, rng, dash_m=0, ink=scene.ink)
        for lane in lanes:
            if not bare and len(lanes) > 2 and rng.random() < 0.5:
                u = rng.uniform(u0, u1)
                turn = 180.0 if _against(street, lane) else 0.0
                markings.arrow(canvas, street.pose.moved(u, lane.middle_m, turn), rng, scene.ink)
        for strip in street.strips:
            if strip.kind == "tram":
                for shift in (-0.25, 0.25):
                    v = strip.middle_m + shift * (strip.right_m - strip.left_m)
                    markings.rails(canvas, street.pose, u0, u1, v, rng)
    for _ in range(int(rng.integers(0, 9))):
        u0, u1 = spans[int(rng.integers(len(spans)))]
        lane = lanes[int(rng.integers(len(lanes)))]
        v = rng.uniform(lane.left_m, lane.right_m)
        draw_stain(canvas, street.pose.moved(rng.uniform(u0, u1), v, rng.choice([0, 90])), rng)


def _against(street: Street, lane: Strip) -> bool:
    """Tell whether the traffic on a lane runs against the street's direction."""
    lanes = [s for s in street.strips if s.kind == "lane"]
    first_half = lanes.index(lane) < len(lanes) / 2
    return first_half != street.left_hand if len(lanes) > 1 else False


def drive(scene: Scene, street: Street, spans: list[Span]) -> None:
    """Put moving and queueing vehicles on the lanes and trams on the rails."""
    rng = scene.rng
    for strip in street.strips:
        if strip.kind == "tram" and rng.random() < 0.4:
            v = strip.middle_m + rng.choice([-0.25, 0.25]) * (strip.right_m - strip.left_m)
            scene.add_heavy(street.pose.moved(rng.uniform(-30, 30), v), "tram")
        if strip.kind != "lane":
            continue
        turn = 180.0 if _against(street, strip) else 0.0
        queue = street.queued and rng.random() < 0.7
        for u0, u1 in spans:
            u = u0 + rng.uniform(0, 6)
            while u < u1:
                lateral = strip.middle_m + rng.normal(0, 0.25)
                pose = street.pose.moved(u, lateral, turn + rng.normal(0, 1.5))
                heavy = rng.random() < 0.07
                if heavy:
                    scene.add_heavy(pose, str(rng.choice(["truck", "bus"])))
                else:
                    scene.add_car(pose)
                u += (12 if heavy else 5) + (rng.uniform(0.8, 3) if queue else rng.exponential(22))


def park(scene: Scene, street: Street, spans: list[Span]) -> None:
    """Paint the bays along the kerbs and park cars in some of them."""
    rng = scene.rng
    for strip in street.strips:
        if strip.kind == "parallel":
            _park_parallel(scene, street, strip, spans)
        elif strip.kind in ("perpendicular", "diagonal"):
            angle = 90.0 if strip.kind == "perpendicular" else float(rng.choice([45, 60, 70]))
            for span in spans:
                line = street.pose.moved(0, strip.middle_m)
                park_row(scene, line, span, angle * rng.choice([-1, 1]), street.occupied)


def _park_parallel(scene: Scene, street: Street, strip: Strip, spans: list[Span]) -> None:
    """Park cars along the kerb, with or without painted bays, planters and trees between."""
    rng = scene.rng
    slot, painted = rng.uniform(5.0, 6.6), rng.random() < 0.35
    planted = rng.random() < 0.2
    for u0, u1 in spans:
        for u in np.arange(u0 + slot / 2, u1 - slot / 2, slot):
            here = street.pose.moved(u, strip.middle_m)
            if not scene.canvas.in_sight(here.x_m, here.y_m, 6.0):
                continue
            if painted:
                width = strip.right_m - strip.left_m
                markings.bay_lines(
                    scene.canvas, here.moved(0, 0, 90), width, slot, rng, scene.ink, end=True
                )
            if rng.random() < street.occupied:
                turn = 180.0 if rng.random() < 0.5 else 0.0
                ahead, side = rng.normal(0, 0.35), rng.normal(0, 0.12)
                scene.add_car(here.moved(ahead, side, turn + rng.normal(0, 1.5)))
            elif rng.random() < 0.12:
                draw_stain(scene.canvas, here, rng)
            elif planted and rng.random() < 0.4:
                draw_planter(scene.canvas, here, scene.sun, rng)


def park_row(scene: Scene, line: Pose, span: Span, angle_deg: float, occupied: float) -> None:
    """Paint and fill a row of bays at an angle to a line."""
    rng = scene.rng
    bay_m, painted = rng.uniform(2.3, 2.75), rng.random() < 0.8
    depth_m = rng.uniform(4.7, 5.4)
    pitch = bay_m / abs(np.sin(np.radians(angle_deg)))
    nose_in = rng.uniform(0.2, 0.9)
    for u in np.arange(span[0] + pitch, span[1] - pitch, pitch):
        here = line.moved(u, 0.0, angle_deg)
        if not scene.canvas.in_sight(here.x_m, here.y_m, 6.0):
            continue
        if painted:
            markings.bay_lines(scene.canvas, here, depth_m, bay_m, rng, scene.ink, end=False)
        if rng.random() < occupied:
            turn = 0.0 if rng.random() < nose_in else 180.0
            ahead, side = rng.normal(0, 0.2), rng.normal(0, 0.1)
            scene.add_car(here.moved(ahead, side, turn + rng.normal(0, 1.5)))
        elif rng.random() < 0.12:
            draw_stain(scene.canvas, here.moved(-1.5, -0.7), rng)


def furnish(scene: Scene, street: Street, spans: list[Span]) -> None:
    """Plant verges and medians; put lamps, people and planters on pavements."""
    rng, canvas = scene.rng, scene.canvas
    for strip in street.strips:
        if strip.kind in ("verge", "median", "pavement"):
            planted = rng.random() < (0.3 if strip.kind == "pavement" else 0.65)
            step, radius = rng.uniform(5, 14), rng.uniform(0.5, 4.0)
            for u0, u1 in spans if planted else []:
                for u in np.arange(u0 + rng.uniform(0, step), u1, step):
                    x, y = street.pose.place([[u, strip.middle_m + rng.normal(0, 0.2)]])[0]
                    if rng.random() < 0.2:
                        draw_bush(canvas, x, y, rng.uniform(0.3, 1.2), scene.sun, rng)
                    elif rng.random() < 0.85:
                        scene.add_tree(x, y, radius * rng.uniform(0.6, 1.3))
        if strip.kind in ("verge", "median") and rng.random() < 0.35:
            for u0, u1 in spans:
                bed = street.pose.place(box(u0, u1, strip.left_m, strip.right_m))
                draw_shrubs(canvas, bed, int(rng.integers(5, 60)), scene.sun, rng)
        if strip.kind != "pavement":
            continue
        for u0, u1 in spans:
            for _ in range(int(rng.integers(0, 5))):
                u, v = rng.uniform(u0, u1), rng.uniform(strip.left_m, strip.right_m)
                x, y = street.pose.place([[u, v]])[0]
                if rng.random() < 0.4:
                    draw_pole(canvas, x, y, scene.sun, rng)
                elif rng.random() < 0.7:
                    draw_person(canvas, x, y, scene.sun, rng)
                elif strip.right_m - strip.left_m > 3:
                    draw_planter(canvas, street.pose.moved(u, v), scene.sun, rng)


DRIVABLE = ("lane", "tram")
KERBSIDE = ("parallel", "perpendicular", "diagonal", "verge", "cycle", "pavement", "median")


def single_street(scene: Scene, reach_m: float) -> Street:
    """Lay one street through the scene."""
    rng = scene.rng
    street = random_street(scene, scene.centre.moved(0, rng.uniform(-12, 12)))
    spans = [(-reach_m, reach_m)]
    pave(scene, street, spans, KERBSIDE + DRIVABLE)
    mark(scene, street, spans)
    if rng.random() < 0.25:
        half = (street.edges(("lane",))[1] - street.edges(("lane",))[0]) / 2
        markings.zebra(
            scene.canvas,
            street.pose.moved(rng.uniform(-20, 20), sum(street.edges(("lane",))) / 2),
            half,
            rng,
            scene.ink,
        )
    furnish(scene, street, spans)
    park(scene, street, spans)
    drive(scene, street, spans)
    return street


def junction(scene: Scene, reach_m: float) -> list[Street]:
    """Lay two streets that cross, with stop lines, crossings, guide lines and turning cars."""
    rng, canvas = scene.rng, scene.canvas
    shift = rng.uniform(-10, 10, 2)
    main = random_street(scene, scene.centre.moved(*shift))
    minor = random_street(scene, scene.centre.moved(*shift, 90 + rng.uniform(-12, 12)))
    streets, openings = (main, minor), []
    for other in (minor, main):
        low, high = other.edges(DRIVABLE)
        gap = max(-low, high) + rng.uniform(2.5, 6)
        openings.append([(-reach_m, -gap), (gap, reach_m)])
    for street, spans in zip(streets, openings, strict=True):
        pave(scene, street, spans, KERBSIDE)
    for street in streets:
        pave(scene, street, [(-reach_m, reach_m)], DRIVABLE)
    for street, other in ((main, minor), (minor, main)):
        _pave_core(scene, street, other)
    for street, spans in zip(streets, openings, strict=True):
        mark(scene, street, spans)
        _mark_mouths(scene, street, spans)
        furnish(scene, street, spans)
        park(scene, street, spans)
        drive(scene, street, spans)
    for _ in range(int(rng.integers(0, 6))):
        pose = main.pose.moved(*rng.uniform(-9, 9, 2), rng.uniform(0, 360))
        scene.add_car(pose)
    if rng.random() < 0.3:
        place = main.pose.moved(*rng.uniform(-10, 10, 2), rng.uniform(0, 360))
        markings.hatching(canvas, place, rng.uniform(3, 9), rng.uniform(1.5, 4), rng, scene.ink)
    return [main, minor]


def _pave_core(scene: Scene, street: Street, other: Street) -> None:
    """Pave the middle of the junction wide enough for rounded corners."""
    low, high = street.edges(DRIVABLE)
    reach = max(abs(edge) for edge in other.edges(DRIVABLE)) + 3
    mouth = np.array(
        [[-reach, low], [-reach + 3, low - 2], [reach - 3, low - 2], [reach, low],
         [reach, high], [reach - 3, high + 2], [-reach + 3, high + 2], [-reach, high]]
    )  # fmt: skip
    scene.ground(street.pose.place(mouth), "road")


def _mark_mouths(scene: Scene, street: Street, spans: list[Span]) -> None:
    """Paint stop lines, crossings and dashed guide lines where a street meets the junction."""
    rng, canvas, ink = scene.rng, scene.canvas, scene.ink
    low, high = street.edges(("lane",))
    crossing, stop, guide = rng.random(3)
    for u, inward in ((spans[0][1], 1), (spans[1][0], -1)):
        if crossing < 0.6:
            here = street.pose.moved(u - inward * 1.0, (low + high) / 2)
            markings.zebra(canvas, here, (high - low) / 2, rng, ink)
        if rng.random() < 0.3:
            here = street.pose.moved(u - inward * rng.uniform(2.6, 4.5), (low + high) / 2)
            markings.teeth(canvas, here, (high - low) / 2, rng, ink)
        if rng.random() < 0.45:
            where = rng.choice([low, high, (low + high) / 2]) + rng.normal(0, 0.5)
            draw_island(canvas, street.pose.moved(u - inward * 2.0, where), scene.sun, rng)
        if stop < 0.7:
            for lane in (s for s in street.strips if s.kind == "lane"):
                if _against(street, lane) == (inward < 0):
                    here = street.pose.moved(u - inward * 4.0, 0)
                    markings.stop_line(canvas, here, lane.left_m, lane.right_m, ink)
    if guide < 0.5:
        for strip in street.strips:
            if strip.kind == "lane":
                u0, u1 = spans[0][1], spans[1][0]
                markings.lane_line(
                    canvas,
                    street.pose,
                    u0,
                    u1,
                    strip.left_m,
                    rng,
                    dash_m=rng.uniform(0.4, 1.2),
                    ink=ink,
                )

"""The engine on near-degenerate geometry: discs that touch, coincide or end on a corner."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from covertool.coverage import level_areas

SEGMENTS = 200
"""Chords in a quarter of the oracle's circles: their area is short by 2 pi^2 / 3 / (4 x 200)^2."""
SHORT = 2 * math.pi**2 / 3 / (4 * SEGMENTS) ** 2

Disc = tuple[float, float, float]
nudge = st.sampled_from([0.0, 1e-15, -1e-13, 1e-12, 1e-9, -1e-7, 1e-5, -1e-3])
lattice = st.integers(-6, 6).map(lambda steps: 2.5 * steps)
sizes = st.sampled_from([2.5, 5.0, 7.5, 1e-3, 40.0])


@st.composite
def near_degenerate(draw: st.DrawFn) -> tuple[list[Disc], shapely.MultiPolygon, float]:
    """Draw discs, a transit area where events nearly coincide, and how far the origin lies."""
    discs: list[Disc] = []
    for _ in range(draw(st.integers(1, 7))):
        x, y, radius = draw(lattice), draw(lattice), draw(sizes)
        if discs and draw(st.booleans()):
            x0, y0, r0 = draw(st.sampled_from(discs))
            angle = draw(st.sampled_from([0.0, math.pi / 2, math.pi / 3, 1.0]))
            how = draw(st.sampled_from(["same", "outside", "inside", "through"]))
            apart = {"same": 0.0, "outside": r0 + radius, "inside": abs(r0 - radius), "through": r0}
            x = x0 + apart[how] * math.cos(angle)
            y = y0 + apart[how] * math.sin(angle)
        discs.append((x + draw(nudge), y + draw(nudge), radius + abs(draw(nudge))))
    pieces = []
    for _ in range(draw(st.integers(1, 3))):
        x, y = draw(lattice), draw(lattice)
        wide, high = draw(
            st.sampled_from([(5, 5), (25, 1e-6), (1e-3, 20), (30, 2.5), (12.5, 12.5)])
        )
        box = shapely.box(x, y, x + wide + abs(draw(nudge)), y + high)
        angle = draw(st.sampled_from([0.0, 45.0, 1e-7, 90.0, 30.0]))
        pieces.append(shapely.affinity.rotate(box, angle, origin="center"))
    united = shapely.union_all(pieces)
    parts = [part for part in shapely.get_parts(united) if part.geom_type == "Polygon"]
    return discs, shapely.MultiPolygon(parts), draw(st.sampled_from([0.0, 1024.0, 700_000.0]))


@settings(max_examples=120, deadline=None, suppress_health_check=list(HealthCheck))
@given(near_degenerate())
def test_levels_close_and_agree_with_circles_of_800_chords(
    case: tuple[list[Disc], shapely.MultiPolygon, float],
) -> None:
    discs, shape, away = case
    x, y, radius = (np.array(column) for column in zip(*discs, strict=True))
    x, y = x + away, y + away
    moved = shapely.transform(shape, lambda points: points + away)
    if not moved.is_valid or moved.area == 0:
        return
    areas = level_areas(x, y, radius, moved).areas_m2
    assert sum(areas) == pytest.approx(moved.area, rel=1e-9, abs=1e-7)
    assert min(areas) > -1e-7
    circles = shapely.buffer(shapely.points(x, y), radius, quad_segs=SEGMENTS)
    covered = shapely.intersection(shapely.union_all(circles), moved).area
    missed = SHORT * math.pi * float((radius**2).sum())
    assert sum(areas[1:]) == pytest.approx(covered, rel=1e-9, abs=missed + 1e-6)


@settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
@given(near_degenerate(), st.integers(0, 6))
def test_a_disc_more_never_uncovers_and_a_disc_twice_covers_nothing_new(
    case: tuple[list[Disc], shapely.MultiPolygon, float], which: int
) -> None:
    discs, shape, _ = case
    x, y, radius = (np.array(column) for column in zip(*discs, strict=True))
    some = level_areas(x[:-1], y[:-1], radius[:-1], shape).areas_m2
    every = level_areas(x, y, radius, shape).areas_m2
    assert every[0] <= some[0] + 1e-7
    again = which % len(discs)
    twice = level_areas(
        np.append(x, x[again]), np.append(y, y[again]), np.append(radius, radius[again]), shape
    ).areas_m2
    assert twice[0] == pytest.approx(every[0], abs=1e-7)

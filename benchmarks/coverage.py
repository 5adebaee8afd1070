"""The coverage engine beside the ways that users have today, in one run, as ratios.

The 4541 cars are those of the synthetic sample study. Larger towns are made here: streets on a
bent grid, cars along their kerbs, some blocks fuller than others. Peers and engine take turns, and
the medians are compared.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from pyproj import CRS
from scipy.spatial import cKDTree

from benchmarks.rows import Row, main, seconds, seconds_alone, side_by_side
from covertool.coverage import level_areas, level_regions
from covertool.gis.parquet import ParquetAnchors, write_anchors
from covertool.gis.read import read_study
from covertool.gis.sample import SAMPLE_STUDY, sample_folder
from covertool.model import Anchors, TransitArea

ITM = CRS.from_epsg(2157)
DEVICE_RADII_M = (15.0, 100.0, 400.0, 1000.0)
PATIENCE_S = 300.0


def town(cars: int, seed: int = 1) -> tuple[Anchors, TransitArea]:
    """Return parked cars and the carriageways of a made-up town, 14 m of street to a car."""
    random = np.random.default_rng(seed)
    spacing, width = 90.0, 9.0
    side = max(300.0, float(np.sqrt(cars * 14.0 * spacing / 2)))
    lines = []
    for street in range(int(side // spacing) + 1):
        along = np.linspace(0, side, int(side / 40) + 2)
        for turned in (False, True):
            bend = 8 * np.sin(along / 130 + street) + random.normal(0, 0.5, along.size)
            across = street * spacing + bend
            lines.append(np.column_stack([across, along] if turned else [along, across]))
    streets = shapely.linestrings(np.concatenate(lines), indices=np.repeat(
        np.arange(len(lines)), [len(line) for line in lines]))  # fmt: skip
    roads = shapely.union_all(shapely.buffer(streets, width / 2, cap_style="flat"))
    street = random.integers(len(streets), size=cars)
    # Two of three cars stand in the fuller blocks.
    block = random.integers(int(side // spacing) + 1, size=cars)
    block = np.where(random.random(cars) < 2 / 3, block // 3 * 3, block)
    place = (block + random.uniform(0, 1, cars)) * spacing % (side - 2)
    here = shapely.line_interpolate_point(streets[street], place)
    ahead = shapely.line_interpolate_point(streets[street], place + 1)
    x, y = shapely.get_x(here), shapely.get_y(here)
    dx, dy = shapely.get_x(ahead) - x, shapely.get_y(ahead) - y
    kerb = random.choice([-1.0, 1.0], cars) * (width / 2 + 1) / np.maximum(np.hypot(dx, dy), 1e-9)
    anchors = Anchors.from_points(x - dy * kerb + 7e5, y + dx * kerb + 7.4e5, ITM)
    moved = shapely.transform(roads, lambda p: p + np.array([7e5, 7.4e5]))
    return anchors, TransitArea(shapely.MultiPolygon(shapely.get_parts(moved).tolist()), ITM)


def divide_and_conquer(anchors: Anchors, transit: TransitArea, radius_m: float) -> list[Any]:
    """Return regions of Levels 1-3 by merging halves with overlays capped at three levels."""
    points = shapely.points(anchors.x_m, anchors.y_m)
    at_least = _merged(shapely.buffer(points, radius_m, quad_segs=16), anchors.x_m, anchors.y_m)
    clipped = [shapely.intersection(region, transit.polygons) for region in at_least]
    return [
        shapely.difference(clipped[0], clipped[1]),
        shapely.difference(clipped[1], clipped[2]),
        clipped[2],
    ]


def _merged(discs: Any, x: Any, y: Any) -> tuple[Any, Any, Any]:
    if len(discs) == 1:
        return discs[0], shapely.Polygon(), shapely.Polygon()
    order = np.argsort(x if np.ptp(x) > np.ptp(y) else y)
    halves = order[: len(order) // 2], order[len(order) // 2 :]
    (a1, a2, a3), (b1, b2, b3) = (_merged(discs[h], x[h], y[h]) for h in halves)
    return (
        shapely.union(a1, b1),
        shapely.union_all([a2, b2, shapely.intersection(a1, b1)]),
        shapely.union_all([a3, b3, shapely.intersection(a2, b1), shapely.intersection(a1, b2)]),
    )


def node_and_polygonize(anchors: Anchors, transit: TransitArea, radius_m: float) -> Any:
    """Return level areas by noding all outlines, polygonizing, and counting discs over faces."""
    points = shapely.points(anchors.x_m, anchors.y_m)
    discs = shapely.buffer(points, radius_m, quad_segs=16)
    outlines = shapely.boundary(np.append(discs, transit.polygons))
    faces = shapely.get_parts(shapely.polygonize([shapely.union_all(outlines)]))
    inner = shapely.point_on_surface(faces)
    face, _ = shapely.STRtree(discs).query(inner, predicate="within")
    depth = np.minimum(np.bincount(face, minlength=len(faces)), 3)
    shapely.prepare(transit.polygons)
    inside = shapely.contains_properly(transit.polygons, inner)
    return np.bincount(depth[inside], shapely.area(faces[inside]), minlength=4)


def engine(anchors: Anchors, transit: TransitArea, radius_m: Any) -> Any:
    return level_areas(anchors.x_m, anchors.y_m, radius_m, transit.polygons)


def rows(quick: bool) -> Iterator[Row]:
    """Yield the figures; quick leaves out what takes minutes."""
    study = read_study(sample_folder() / SAMPLE_STUDY)
    small, roads = study.anchors, study.transit
    engine(*town(10), 15.0)
    level_regions(*town(10), 15.0)
    turns = 1 if quick else 3
    for radius in (15.0, 100.0):
        ours = partial(engine, small, roads, radius)
        yield side_by_side(
            f"areas of 4541 discs, {radius:g} m",
            "shapely: halves merged by overlays, levels capped at 3",
            ours,
            partial(divide_and_conquer, small, roads, radius),
            turns,
            at_least=50,
            repeats=3,
        )
        if radius == 15.0 or not quick:
            yield side_by_side(
                f"areas of 4541 discs, {radius:g} m",
                "shapely: node all outlines, polygonize, count",
                ours,
                partial(node_and_polygonize, small, roads, radius),
                1,
                at_least=80,
                repeats=3,
            )
    yield side_by_side(
        "regions of 4541 discs, 15 m",
        "shapely: halves merged by overlays, levels capped at 3",
        partial(level_regions, small, roads, 15.0),
        partial(divide_and_conquer, small, roads, 15.0),
        turns,
        at_least=5,
    )
    if not quick:
        yield _against_patience(100_000)
    yield from _against_reading(100_000 if quick else 1_000_000)
    yield _growth((10_000, 100_000) if quick else (100_000, 1_000_000))


def _against_patience(cars: int) -> Row:
    """Return overlays over the engine; overlays that take too long are stopped, and it is said."""
    anchors, transit = town(cars)
    ours = min(seconds(partial(engine, anchors, transit, 15.0)) for _ in range(3))
    peer, ended = seconds_alone(partial(divide_and_conquer, anchors, transit, 15.0), PATIENCE_S)
    told = "" if ended else f", stopped after {PATIENCE_S:g} s: the ratio is a lower bound"
    return Row(
        f"areas of {cars:,} discs, 15 m",
        f"shapely: halves merged by overlays, levels capped at 3{told}",
        (peer / ours,),
        limit=100,
    )


def _against_reading(cars: int) -> Iterator[Row]:
    """Yield covertool over (reading the GeoParquet and building a cKDTree)."""
    anchors, transit = town(cars)
    mixed = np.random.default_rng(2).choice(DEVICE_RADII_M, cars)
    works = {f"{radius:g} m": radius for radius in DEVICE_RADII_M} | {"mixed classes": mixed}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "anchors.parquet"
        write_anchors(path, anchors)

        def read_and_index() -> cKDTree:
            found = ParquetAnchors(path).read()
            return cKDTree(np.column_stack([found.x_m, found.y_m]))

        for name, radius in works.items():
            yield side_by_side(
                f"areas of {cars:,} discs, {name}",
                "reading the GeoParquet and building a cKDTree",
                partial(engine, anchors, transit, radius),
                read_and_index,
                3,
                at_most={"15 m": 10, "100 m": 6, "mixed classes": 6}.get(name, 3),
            )


def _growth(sizes: tuple[int, ...]) -> Row:
    """Return the exponent with which the time at 15 m grows with the number of cars."""
    taken = []
    for cars in sizes:
        work = partial(engine, *town(cars), 15.0)
        taken.append([seconds(work, time.process_time) for _ in range(2)])
    slope = float(np.polyfit(np.log(sizes), np.log([min(times) for times in taken]), 1)[0])
    growth = f"areas, 15 m, growth of time from {sizes[0]:,} to {sizes[-1]:,} discs"
    return Row(growth, "itself", (slope,), "exponent", higher=False, limit=1.05)


if __name__ == "__main__":
    main(rows, __doc__)

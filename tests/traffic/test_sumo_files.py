"""Files for SUMO: it loads them, and what they hold is where it belongs."""

import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
import shapely
from pyproj import CRS

from covertool.coverage.regions import level_regions
from covertool.model import Anchors, TransitArea
from covertool.traffic.sumo import find_sumo
from covertool.traffic.sumo_files import without_holes, write_additional

IRELAND = CRS("EPSG:2157")


def scene():
    rng = np.random.default_rng(4)
    x, y = rng.uniform(0, 300, 60), rng.uniform(0, 300, 60)
    anchors = Anchors.from_points(690_000 + x, 730_000 + y, IRELAND)
    block = shapely.box(690_000, 730_000, 690_300, 730_300)
    area = TransitArea(shapely.MultiPolygon([block]), IRELAND)
    return anchors, level_regions(anchors, area, 25.0)


def read(path):
    root = ET.parse(path).getroot()
    polygons = {1: [], 2: [], 3: []}
    for poly in root.iter("poly"):
        ring = [tuple(map(float, pair.split(","))) for pair in poly.get("shape").split()]
        polygons[int(poly.get("type")[-1])].append(shapely.Polygon(ring))
    points = [(float(poi.get("x")), float(poi.get("y"))) for poi in root.iter("poi")]
    return polygons, np.array(points)


def test_polygons_without_holes_have_the_area_of_the_levels(tmp_path):
    anchors, levels = scene()
    assert any(part.interiors for level in levels.values() for part in level.geoms)
    write_additional(tmp_path / "a.add.xml", anchors, levels)
    polygons, points = read(tmp_path / "a.add.xml")
    for level, parts in polygons.items():
        # Corners are rounded to a centimetre.
        slack = 0.01 * levels[level].length
        assert sum(part.area for part in parts) == pytest.approx(levels[level].area, abs=slack)
    assert np.abs(points[:, 0] - anchors.x_m).max() < 0.001
    assert np.abs(points[:, 1] - anchors.y_m).max() < 0.001


def test_a_polygon_with_many_holes_is_cut_into_parts_that_do_not_overlap():
    holes = [shapely.box(i, j, i + 0.5, j + 0.5) for i in range(1, 9, 2) for j in range(1, 9, 2)]
    whole = shapely.box(0, 0, 10, 10).difference(shapely.union_all(holes))
    parts = without_holes(whole)
    assert not any(part.interiors for part in parts)
    assert shapely.union_all(parts).symmetric_difference(whole).area < 1e-9
    assert sum(part.area for part in parts) == pytest.approx(whole.area)


def test_sumo_loads_the_additional_file(tmp_path):
    sumo, (anchors, levels) = find_sumo(), scene()
    write_additional(tmp_path / "a.add.xml", anchors, levels)
    nodes = '<nodes><node id="a" x="0" y="0"/><node id="b" x="300" y="0"/></nodes>'
    (tmp_path / "n.nod.xml").write_text(nodes)
    (tmp_path / "e.edg.xml").write_text('<edges><edge id="ab" from="a" to="b"/></edges>')
    for program, arguments in (
        ("netconvert", ["-n", "n.nod.xml", "-e", "e.edg.xml", "-o", "one.net.xml"]),
        ("sumo", ["-n", "one.net.xml", "-a", "a.add.xml", "--end", "2", "--no-step-log"]),
    ):
        done = subprocess.run(
            [sumo.program(program), *arguments],
            cwd=Path(tmp_path), env=dict(sumo.environment), capture_output=True, text=True,
            check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        assert "Error" not in done.stderr

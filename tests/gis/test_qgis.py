"""A study opened in real QGIS shows the paper's colours without another step."""

import json
import os
import shutil
import subprocess
from pathlib import Path

import cv2
import numpy as np
import pytest
import shapely

from covertool import crs as crs_door
from covertool.gis.write import write_layers
from covertool.model import Anchors, TransitArea
from covertool.report.export import export
from tests.running import ok

SCRIPT = Path(__file__).with_name("qgis_render.py")
PYTHON = "/usr/bin/python3"  # Debian's, which has QGIS beside it
MIDDLE = "693900,737350,694300,737650"
COLOURS = {  # as the paper names them
    "yellow": (255, 217, 47),
    "orange": (253, 141, 60),
    "red": (227, 26, 28),
    "transit blue": (79, 129, 189),
    "parked black": (0, 0, 0),
}


@pytest.fixture(scope="module", autouse=True)
def qgis() -> None:
    if not shutil.which("qgis_process") or not Path(PYTHON).exists():
        pytest.skip("QGIS is not installed (Debian: apt-get install qgis python3-qgis)")
    found = subprocess.run([PYTHON, "-c", "import qgis.core"], capture_output=True, check=False)
    if found.returncode != 0:
        pytest.skip("QGIS has no Python here (Debian: apt-get install python3-qgis)")


def rendered(study: Path, picture: Path, bounds: str) -> tuple[dict[str, dict], np.ndarray]:
    """Return what QGIS tells of each layer, and the map that it draws, as (H, W, RGB)."""
    done = subprocess.run(
        [PYTHON, SCRIPT, study, picture, bounds],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "QT_QPA_PLATFORM": "offscreen"},
    )
    assert done.stdout, done.stderr
    told = json.loads(done.stdout)
    assert told["errors"] == []
    assert "may only be partially supported" not in done.stderr
    return {layer["name"]: layer for layer in told["layers"]}, cv2.imread(str(picture))[..., ::-1]


def share(picture: np.ndarray, colour: tuple[int, int, int]) -> float:
    return float((np.abs(picture.astype(int) - colour).max(axis=2) < 8).mean())


@pytest.fixture(scope="module")
def town(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, dict], np.ndarray]:
    folder = tmp_path_factory.mktemp("qgis")
    ok("coverage", "--radius", "15", "--radius", "100", "-o", folder / "x.gpkg")
    return rendered(folder / "x.gpkg", folder / "map.png", MIDDLE)


def test_the_default_styles_draw_the_papers_colours(town: tuple[dict, np.ndarray]) -> None:
    layers, picture = town
    assert all(layer["valid"] and layer["index"] for layer in layers.values())
    assert {layer["crs"] for layer in layers.values()} == {"EPSG:2157"}
    assert layers["anchors"]["kind"] == "Point"
    assert layers["transit"]["kind"] == "MultiPolygon"
    for name, colour in COLOURS.items():
        assert share(picture, colour) > 0.001, name


def test_of_several_radii_only_the_smallest_is_drawn_at_first(
    town: tuple[dict, np.ndarray],
) -> None:
    """At 100 m nearly all of the town is red; at 15 m much of it is blue."""
    layers, picture = town
    assert layers["coverage_level_3"]["colours"] == ["#e31a1c", "#e31a1c"]
    assert share(picture, COLOURS["transit blue"]) > share(picture, COLOURS["red"])


def test_discs_let_what_lies_below_shine_through(tmp_path: Path) -> None:
    """Overlapping discs grow darker, so that levels can be seen before they are counted."""
    car = Anchors.from_points([0.0, 15.0], [0.0, 0.0], crs_door.IRISH_TM)
    road = TransitArea(shapely.MultiPolygon([shapely.box(-40, -5, 60, 5)]), crs_door.IRISH_TM)
    path = tmp_path / "s.gpkg"
    write_layers(path, {"anchors": car.to_frame(), "transit": road.to_frame()})
    export(path, tmp_path / "d.gpkg", discs=["A"])
    layers, picture = rendered(tmp_path / "d.gpkg", tmp_path / "map.png", "-40,-40,60,40")
    assert layers["discs_class_a"]["rows"] == 2
    height, width = picture.shape[:2]
    none, one, two = (
        picture[round(height * (40 - y) / 80), round(width * (x + 40) / 100)].astype(int).sum()
        for x, y in ((-30, 20), (-8, 9), (7, 9))
    )
    assert none > one > two > 300
    assert share(picture, COLOURS["transit blue"]) > 0.01

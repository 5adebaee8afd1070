"""`covertool export`: maps and layers of a study that the command itself made."""

import json
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

MIDDLE = "693900,737350,694300,737650"
COLOURS = {"blue": (79, 129, 189), "yellow": (255, 217, 47), "orange": (253, 141, 60)}


def run(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "covertool", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def study(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("export") / "sample.gpkg"
    done = run("coverage", "--radius", "15", "-o", path)
    assert done.returncode == 0, done.stderr
    return path


def test_the_map_shows_the_papers_colours(study, tmp_path):
    out = tmp_path / "map.png"
    assert run("export", study, "-o", out, "--bounds", MIDDLE).returncode == 0
    picture = cv2.imread(str(out))[..., ::-1].astype(int)
    for name, colour in {**COLOURS, "red": (227, 26, 28), "black": (0, 0, 0)}.items():
        near = np.abs(picture - colour).max(axis=2) < 12
        assert near.mean() > 0.001, name


def test_the_same_study_gives_the_same_bytes(study, tmp_path):
    for suffix in (".svg", ".pdf"):
        first, second = tmp_path / f"a{suffix}", tmp_path / f"b{suffix}"
        for out in (first, second):
            assert run("export", study, "-o", out, "--bounds", MIDDLE).returncode == 0
        assert first.read_bytes() == second.read_bytes()


def test_a_map_of_synthetic_data_says_so(study, tmp_path):
    out = tmp_path / "map.svg"
    run("export", study, "-o", out, "--bounds", MIDDLE)
    assert "synthetic: Synthetic Maynooth-like town" in out.read_text()


def test_a_layer_goes_out_in_degrees_as_geojson(study, tmp_path):
    out = tmp_path / "transit.geojson"
    assert run("export", study, "--layer", "transit", "-o", out).returncode == 0
    features = json.loads(out.read_text())["features"]
    lon, lat = features[0]["geometry"]["coordinates"][0][0][0][:2]
    assert -6.7 < lon < -6.5
    assert 53.3 < lat < 53.5


def test_a_radius_that_was_not_computed_names_its_verb(study, tmp_path):
    done = run("export", study, "-o", tmp_path / "map.png", "--radius", "400")
    assert done.returncode == 1
    assert "covertool coverage STUDY --radius 400" in done.stderr
    assert list(tmp_path.iterdir()) == []

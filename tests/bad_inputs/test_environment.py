"""What surrounds a run: projection databases of other programs, odd locales, no home."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest
import rasterio

from covertool.gis.sample import sample_folder
from tests.running import run

OLD_DATABASE = Path(rasterio.__file__).parent / "proj_data"


@pytest.fixture(scope="module")
def undisturbed() -> object:
    return levels(run("coverage", "--radius", 15, "--json"))


def levels(done: subprocess.CompletedProcess[str]) -> object:
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)["results"]


@pytest.mark.parametrize(
    "variables",
    [
        {"PROJ_DATA": "/nowhere", "PROJ_LIB": "/nowhere"},
        {"PROJ_DATA": str(OLD_DATABASE), "PROJ_LIB": str(OLD_DATABASE)},
        {"GDAL_DATA": "/nowhere", "GDAL_DRIVER_PATH": "/nowhere"},
        {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii", "TZ": "Asia/Kathmandu"},
        {"HOME": "/nowhere", "XDG_CACHE_HOME": "/nowhere", "TERM": "dumb"},
    ],
    ids=["no projections", "another PROJ", "no GDAL data", "locale", "no home"],
)
def test_another_environment_changes_no_number(
    variables: dict[str, str], undisturbed: object
) -> None:
    assert levels(run("coverage", "--radius", 15, "--json", **variables)) == undisturbed


@pytest.mark.parametrize("place", ["/nowhere", str(OLD_DATABASE)])
def test_rasters_lie_where_they_lay_with_another_projection_database(
    place: str, tmp_path: Path
) -> None:
    """Or the fault is told in three lines; never a place that is wrong."""
    mask = sample_folder() / "road_mask.tif"
    here, there = tmp_path / "here.geojson", tmp_path / "there.geojson"
    assert run("transit", mask, "-o", here).returncode == 0
    done = run("transit", mask, "-o", there, PROJ_DATA=place, PROJ_LIB=place)
    if done.returncode == 0:
        shapes = [json.loads(path.read_text())["features"] for path in (here, there)]
        assert shapes[0] == shapes[1]
    else:
        assert done.stderr.splitlines()[-3].startswith("error:")
        assert not there.exists()

"""The built wheel, installed in a clean environment, works outside the source tree."""

import json
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("dist")
    command = [
        sys.executable,
        "-m",
        "build",
        "--wheel",
        "--no-isolation",
        "-o",
        str(out),
        str(ROOT),
    ]
    subprocess.run(command, check=True, capture_output=True)
    (built,) = out.glob("*.whl")
    return built


def test_the_wheel_carries_the_sample_study_and_the_type_marker(wheel: Path):
    names = zipfile.ZipFile(wheel).namelist()
    assert "covertool/py.typed" in names
    assert "covertool/data/sample.gpkg" in names
    assert not [name for name in names if name.startswith(("tests", "training", "benchmarks"))]


def test_the_installed_wheel_covers_the_sample_study(wheel: Path, tmp_path: Path):
    venv.create(tmp_path / "env", with_pip=True)
    python = tmp_path / "env" / "bin" / "python"
    pins = ["--constraint", str(ROOT / "constraints.txt")]
    install = [str(python), "-m", "pip", "install", "--quiet", *pins, str(wheel)]
    subprocess.run(install, check=True, cwd=tmp_path)
    command = [str(python.with_name("covertool")), "coverage", "--radius", "15", "--json"]
    done = subprocess.run(command, check=True, cwd=tmp_path, capture_output=True, text=True)
    report = json.loads(done.stdout)
    assert report["anchors"] == 4541
    levels = report["results"][0]["levels"]
    assert sum(level["fraction"] for level in levels.values()) == pytest.approx(1)

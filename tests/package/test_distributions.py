"""What is handed to strangers: a wheel and an sdist, complete, valid, and built alike each time."""

import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

from .conftest import ROOT, build

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def from_sdist(built: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the source tree that the sdist holds."""
    folder = tmp_path_factory.mktemp("unpacked")
    with tarfile.open(built[".gz"]) as archive:
        archive.extractall(folder, filter="data")
    (tree,) = folder.iterdir()
    return tree


def test_the_wheel_carries_study_weights_styles_and_the_type_marker(built: dict[str, Path]):
    names = zipfile.ZipFile(built[".whl"]).namelist()
    assert "covertool/py.typed" in names
    assert "covertool/data/sample.gpkg" in names
    assert "covertool/data/trace.parquet" in names
    assert [name for name in names if name.endswith(".onnx")]
    assert [name for name in names if name.endswith("/licenses/LICENSE")]


def test_the_wheel_carries_nothing_but_the_package(built: dict[str, Path]):
    names = zipfile.ZipFile(built[".whl"]).namelist()
    assert {name.split("/")[0].split("-")[0] for name in names} == {"covertool"}
    assert not [name for name in names if "__pycache__" in name or name.endswith(".nbi")]


def test_every_tracked_file_of_the_package_is_in_the_wheel(built: dict[str, Path]):
    listed = subprocess.run(
        ["git", "ls-files", "covertool"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    if listed.returncode:
        pytest.skip("this tree is no git checkout")
    missing = set(listed.stdout.split()) - set(zipfile.ZipFile(built[".whl"]).namelist())
    assert not missing


def test_the_sdist_builds_the_same_wheel_byte_by_byte(
    built: dict[str, Path], from_sdist: Path, tmp_path: Path
):
    again = build(from_sdist, tmp_path, "--wheel")
    assert again[".whl"].read_bytes() == built[".whl"].read_bytes()


def test_the_sdist_of_the_sdist_is_the_same_byte_by_byte(
    built: dict[str, Path], from_sdist: Path, tmp_path: Path
):
    again = build(from_sdist, tmp_path, "--sdist")
    assert again[".gz"].read_bytes() == built[".gz"].read_bytes()


def test_the_sdist_carries_what_the_readme_and_the_tests_need(from_sdist: Path):
    for name in ("tests", "docs", "examples", "benchmarks", "CITATION.cff", "Makefile"):
        assert (from_sdist / name).exists(), name


def test_twine_finds_both_distributions_valid(built: dict[str, Path]):
    pytest.importorskip("twine")
    command = [sys.executable, "-m", "twine", "check", "--strict", *map(str, built.values())]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout

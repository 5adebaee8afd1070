"""Every command of the README runs as it is written, one after the other, in one folder."""

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from covertool.gis.sample import sample_folder

README = Path(__file__).parents[1] / "README.md"

TOWN = """<?xml version="1.0" encoding="UTF-8"?>
<osm version="0.6">
{nodes}
<way id="1"><nd ref="1"/><nd ref="2"/><nd ref="3"/><tag k="highway" v="residential"/>
<tag k="parking:both" v="lane"/><tag k="parking:both:orientation" v="parallel"/></way>
<way id="2"><nd ref="2"/><nd ref="4"/><tag k="highway" v="secondary"/><tag k="lanes" v="2"/></way>
<way id="3"><nd ref="5"/><nd ref="6"/><nd ref="7"/><nd ref="8"/><nd ref="5"/>
<tag k="amenity" v="parking"/></way>
</osm>
"""
PLACES = [
    (0, 0), (0.001, 0), (0.002, 0), (0.001, 0.001), (0.0012, 0.0002), (0.0016, 0.0002),
    (0.0016, 0.0005), (0.0012, 0.0005),
]  # fmt: skip


def blocks(language: str) -> Iterator[str]:
    """Yield the README's blocks of a language."""
    for found in re.finditer(rf"^```{language}\n(.*?)^```$", README.read_text(), re.M | re.S):
        yield found[1]


def commands() -> list[str]:
    """Return the commands of the README, a line each."""
    return [line for block in blocks("console") for line in block.splitlines() if line]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a small made-up town and a drawn photograph, under the README's names."""
    path = tmp_path_factory.mktemp("readme")
    nodes = "\n".join(
        f'<node id="{i}" lat="{53.38 + y}" lon="{-6.59 + x}"/>'
        for i, (x, y) in enumerate(PLACES, 1)
    )
    (path / "town.osm").write_text(TOWN.format(nodes=nodes))
    shutil.copyfile(sample_folder() / "orthophoto.tif", path / "photo.tif")
    shutil.copyfile(sample_folder() / "road_mask.tif", path / "roads.tif")
    return path


@pytest.mark.slow
def test_every_command_runs_as_written(folder: Path) -> None:
    here = Path(sys.executable).parent
    for command in commands():
        done = subprocess.run(
            ["bash", "-c", command],
            cwd=folder,
            env={"PATH": f"{here}:/usr/bin:/bin", "HOME": str(folder)},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, f"{command}\n{done.stderr}"
    for name in ("town.html", "tables.xlsx", "town.pdf", "seen.png", "curve.png", "evening.png"):
        assert (folder / name).stat().st_size > 1000


@pytest.mark.slow
def test_the_python_of_the_readme_runs(folder: Path) -> None:
    for code in blocks("python"):
        done = subprocess.run(
            [sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        assert "all 0.2" in done.stdout


def test_the_readme_names_only_files_that_are_there() -> None:
    for name in re.findall(r"\]\((?!http)([^)#]+)\)", README.read_text()):
        assert (README.parent / name).exists(), name

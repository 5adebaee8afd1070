"""A small clean town, ways to spoil it, and the two ends that a case may have."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pytest
import shapely

from covertool.cli.main import main

CRS = "EPSG:2157"
EAST_M, NORTH_M = 693500.0, 737000.0
"""A place in the sample town, where Irish Transverse Mercator is true to 1e-4."""


@dataclass(frozen=True)
class Town:
    """Eight parked cars along a cross of two streets, as files and as frames."""

    folder: Path
    anchors: gpd.GeoDataFrame
    transit: gpd.GeoDataFrame

    def write(self, name: str, frame: gpd.GeoDataFrame, **options: Any) -> Path:
        """Write a frame by GeoPandas, as another program would."""
        path = self.folder / name
        if path.suffix == ".parquet":
            frame.to_parquet(path, **options)
        else:
            frame.to_file(path, **options)
        return path

    def anchors_file(self) -> Path:
        """Return the clean anchors as a file."""
        path = self.folder / "anchors.gpkg"
        return path if path.exists() else self.write(path.name, self.anchors)

    def transit_file(self) -> Path:
        """Return the clean transit area as a file."""
        path = self.folder / "transit.gpkg"
        return path if path.exists() else self.write(path.name, self.transit)


@dataclass(frozen=True)
class Outcome:
    """How a command ended."""

    code: int
    out: str
    err: str

    def fractions(self) -> list[float]:
        """Return the shares of Levels 0 to 3 of a ``coverage --json`` run."""
        (result, *_) = json.loads(self.out)["results"]
        return [level["fraction"] for level in result["levels"].values()]


Run = Callable[..., Outcome]


@pytest.fixture
def town(tmp_path: Path) -> Town:
    folder = tmp_path / "town"
    folder.mkdir()
    along = np.array([-90.0, -60, -25, -10, 15, 40, 70, 95])
    places = [
        (EAST_M + a, NORTH_M + 4) if i % 2 else (EAST_M - 4, NORTH_M + a)
        for i, a in enumerate(along)
    ]
    anchors = gpd.GeoDataFrame(
        {"id": [f"car {i}" for i in range(8)]}, geometry=shapely.points(places), crs=CRS
    )
    streets = shapely.union_all(
        [
            shapely.box(EAST_M - 120, NORTH_M - 3, EAST_M + 120, NORTH_M + 3),
            shapely.box(EAST_M - 3, NORTH_M - 120, EAST_M + 3, NORTH_M + 120),
        ]
    )
    return Town(folder, anchors, gpd.GeoDataFrame({"id": [1]}, geometry=[streets], crs=CRS))


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    def run_command(*words: object) -> Outcome:
        capsys.readouterr()
        code = main([str(word) for word in words])
        said = capsys.readouterr()
        return Outcome(code, said.out, said.err)

    return run_command


@pytest.fixture
def coverage(town: Town, run: Run) -> Run:
    """Run ``coverage --json`` at 15 m, on the clean town unless told otherwise."""

    def run_coverage(
        *more: object, anchors: object | None = None, transit: object | None = None
    ) -> Outcome:
        return run(
            "coverage", "--radius", 15, "--json",
            "--anchors", anchors or town.anchors_file(),
            "--transit", transit or town.transit_file(), *more,
        )  # fmt: skip

    return run_coverage


def assert_refused(outcome: Outcome, *named: object) -> None:
    """A fault that the user can mend: exit 1, three lines, no traceback, nothing on stdout."""
    assert outcome.code == 1, outcome
    lines = [line for line in outcome.err.splitlines() if line]
    assert [line.split(":")[0] for line in lines[-3:]] == ["error", "where", "mend"], outcome.err
    assert "Traceback" not in outcome.err
    assert outcome.out == ""
    for name in named:
        assert str(name) in outcome.err, outcome.err


def assert_works_like(clean: Outcome, outcome: Outcome, within: float = 1e-9) -> None:
    """The same answer as the clean input, and exit 0."""
    assert outcome.code == 0, outcome.err
    np.testing.assert_allclose(outcome.fractions(), clean.fractions(), atol=within)

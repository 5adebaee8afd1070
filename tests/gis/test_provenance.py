"""Where a result comes from, and where the sample lies."""

import hashlib
import json
from pathlib import Path

import pyogrio
import pytest
import rasterio

from covertool import crs as crs_door
from covertool.errors import FileError
from covertool.gis import geopackage, sample
from covertool.gis.provenance import provenance, sha256
from covertool.gis.write import write_layers
from covertool.model import Anchors


def test_inputs_are_hashed_and_every_engine_is_named(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(b"x,y\n1,2\n")
    told = provenance(["coverage", "--radius", "15"], [f"{path}:layer", path], seeds={"seed": 3})
    content = told.to_json()
    expected = hashlib.sha256(b"x,y\n1,2\n").hexdigest()
    assert [entry["sha256"] for entry in content["inputs"]] == [expected, expected]
    assert content["seeds"] == {"seed": 3}
    assert content["versions"]["GDAL (rasterio)"] == rasterio.__gdal_version__
    assert content["versions"]["GDAL (pyogrio)"] == ".".join(map(str, pyogrio.__gdal_version__))
    assert {"covertool", "GEOS", "PROJ"} <= set(content["versions"])


def test_each_verb_leaves_its_own_line_in_the_study(tmp_path: Path) -> None:
    path = tmp_path / "s.gpkg"
    layers = {"anchors": Anchors.from_points([0], [0], crs_door.IRISH_TM).to_frame()}
    write_layers(path, layers, metadata=provenance(["extract", "a.tif"], []).to_metadata())
    told = provenance(["coverage", "--radius", "15"], [path])
    write_layers(path, layers, into=True, metadata=told.to_metadata())
    stored = geopackage.read_metadata(path)
    assert set(stored) == {"provenance extract", "provenance coverage"}
    assert json.loads(stored["provenance coverage"])["command"] == ["coverage", "--radius", "15"]


def test_an_absent_input_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileError):
        sha256(tmp_path / "absent.tif")


def test_a_missing_sample_study_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(sample, "_PACKAGE", tmp_path / "covertool")
    with pytest.raises(FileError, match=r"sample\.gpkg"):
        sample.sample_folder()
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "sample.gpkg").touch()
    assert sample.sample_folder() == tmp_path / "data"

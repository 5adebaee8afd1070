"""Files that send GDAL or PROJ on to other files or to the network."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import numpy as np
import pytest
import rasterio
from affine import Affine

from tests.bad_inputs.conftest import CRS, Run, assert_refused


@pytest.fixture
def visited() -> Iterator[tuple[int, list[str]]]:
    """Serve on a port of this machine, and note what is asked for."""
    asked: list[str] = []

    class Notes(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            asked.append(self.path)
            self.send_error(404)

        def do_HEAD(self) -> None:
            self.do_GET()

        def log_message(self, *_: object) -> None:
            pass

    server = HTTPServer(("127.0.0.1", 0), Notes)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield server.server_port, asked
    server.shutdown()
    server.server_close()


def image(path: Path, **tags: str) -> Path:
    with rasterio.open(
        path, "w", driver="GTiff", width=64, height=64, count=3, dtype="uint8", crs=CRS,
        transform=Affine(0.2, 0, 693_500, 0, -0.2, 737_000),
    ) as target:  # fmt: skip
        target.write(np.full((3, 64, 64), 90, dtype=np.uint8))
        if tags:
            target.update_tags(ns="OVERVIEWS", **tags)
    return path


def detour(source: str) -> str:
    return (
        '<VRTDataset rasterXSize="64" rasterYSize="64"><Metadata>'
        '<MDI key="INTERNAL_MASK_FLAGS_1">2</MDI></Metadata>'
        '<VRTRasterBand dataType="Byte" band="1"><SimpleSource>'
        f'<SourceFilename relativeToVRT="0">{source}</SourceFilename>'
        "</SimpleSource></VRTRasterBand></VRTDataset>"
    )


@pytest.mark.parametrize("suffix", [".msk", ".ovr"])
def test_a_virtual_raster_beside_an_image_is_refused(suffix: str, tmp_path: Path, run: Run) -> None:
    """GDAL takes it for the mask or overview of the image, by any driver that it has."""
    path = image(tmp_path / "a.tif")
    (tmp_path / f"a.tif{suffix}").write_text(detour("/etc/hostname"))
    output = tmp_path / "out.gpkg"
    assert_refused(run("extract", path, "-o", output), f"a.tif{suffix}")
    assert_refused(run("info", path), f"a.tif{suffix}")
    assert not output.exists()


def test_a_mask_that_is_a_tiff_is_still_read(tmp_path: Path, run: Run) -> None:
    path = image(tmp_path / "a.tif")
    with rasterio.Env(GDAL_TIFF_INTERNAL_MASK=False), rasterio.open(path, "r+") as target:
        target.write_mask(np.full((64, 64), 255, dtype=np.uint8))
    assert (tmp_path / "a.tif.msk").exists()
    assert run("extract", path, "-o", tmp_path / "out.gpkg").code == 0


@pytest.mark.parametrize("place", ["tags", "beside"])
def test_overviews_in_a_file_of_another_name_are_refused(
    place: str, tmp_path: Path, run: Run
) -> None:
    if place == "tags":
        path = image(tmp_path / "a.tif", OVERVIEW_FILE="/etc/hostname")
    else:
        path = image(tmp_path / "a.tif")
        (tmp_path / "a.tif.aux.xml").write_text(
            '<PAMDataset><Metadata domain="OVERVIEWS">'
            '<MDI key="OVERVIEW_FILE">/etc/hostname</MDI></Metadata></PAMDataset>'
        )
    assert_refused(run("extract", path, "-o", tmp_path / "out.gpkg"), "a.tif")


OPEN = """
import sys
import covertool.cli.main
import pyogrio, rasterio
for read in (rasterio.open, pyogrio.read_info):
    for door in ("/vsicurl/", "/vsicurl_streaming/"):
        try:
            read(door + sys.argv[1])
        except Exception:
            pass
"""


def test_nothing_that_gdal_is_told_to_fetch_is_fetched(
    visited: tuple[int, list[str]], tmp_path: Path
) -> None:
    """Should a file find a way to name an address, GDAL in our process still asks nobody."""
    port, asked = visited
    clean = {k: v for k, v in os.environ.items() if k != "CPL_VSIL_CURL_ALLOWED_EXTENSIONS"}
    words = [sys.executable, "-c", OPEN, f"http://127.0.0.1:{port}/a.tif"]
    subprocess.run(words, check=True, env=clean, capture_output=True, timeout=120)
    assert asked == []


def test_files_that_name_addresses_cause_no_request(
    visited: tuple[int, list[str]], tmp_path: Path, run: Run
) -> None:
    port, asked = visited
    address = f"http://127.0.0.1:{port}"
    bomb = f'<!DOCTYPE x SYSTEM "{address}/x.dtd" [<!ENTITY e SYSTEM "{address}/e">]>'
    (tmp_path / "t.osm").write_text(f'{bomb}<osm version="0.6">&e;</osm>')
    (tmp_path / "t.net.xml").write_text(f"{bomb}<net>&e;</net>")
    (tmp_path / "t.csv").write_text(f"x,y,id\n1,2,{address}/c\n")
    (tmp_path / "t.geojson").write_text(
        f'{{"type":"FeatureCollection","crs":{{"type":"link","properties":'
        f'{{"href":"{address}/crs","type":"proj4"}}}},"features":[]}}'
    )
    image(tmp_path / "t.tif", OVERVIEW_FILE=f"/vsicurl/{address}/o.tif")
    for words in (
        ["transit", tmp_path / "t.osm", "-o", tmp_path / "o.gpkg"],
        ["simulate", "--net", tmp_path / "t.net.xml", "--anchors", tmp_path / "t.csv"],
        ["info", tmp_path / "t.csv"],
        ["info", tmp_path / "t.geojson"],
        ["info", tmp_path / "t.tif"],
        ["coverage", "--anchors", f"{address}/a.gpkg", "--transit", f"/vsicurl/{address}/t.gpkg"],
        ["coverage", "--crs", f"{address}/crs", "--anchors", tmp_path / "t.csv",
         "--transit", tmp_path / "t.geojson"],
    ):  # fmt: skip
        assert "Traceback" not in run(*words).err
    assert asked == []

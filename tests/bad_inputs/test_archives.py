"""Archives, KML and other files that GDAL could open and covertool does not."""

from __future__ import annotations

import subprocess
import sys
import zipfile
import zlib
from pathlib import Path

import pytest

from tests.bad_inputs.conftest import Run, Town, assert_refused

pytestmark = pytest.mark.skipif(
    not Path("/proc/self/status").exists(), reason="reads peak memory from /proc"
)

# VmHWM is this process's own peak; ru_maxrss would also count that of the process before exec.
MEASURE = """
import re, sys
from pathlib import Path
from covertool.cli.main import main
code = main(sys.argv[1:])
print(int(re.search(r"VmHWM:\\s+(\\d+)", Path("/proc/self/status").read_text())[1]) // 1024)
sys.exit(code)
"""


def archive(path: Path, *members: tuple[str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as target:
        for name, content in members:
            target.writestr(name, content)
    return path


def measured(*words: object) -> tuple[int, str, int]:
    """Run a verb in a process of its own; return its exit code, stderr and peak in MiB."""
    done = subprocess.run(
        [sys.executable, "-c", MEASURE, *map(str, words)], capture_output=True, text=True,
        check=False, timeout=300,
    )  # fmt: skip
    return done.returncode, done.stderr, int(done.stdout.splitlines()[-1])


@pytest.mark.parametrize(
    "name", ["a.zip", "a.shp.zip", "a.gpkg.zip", "a.kmz", "a.gz", "a.tar", "a.7z"]
)
def test_archives_are_written_but_never_opened(name: str, town: Town, coverage: Run) -> None:
    """So neither a bomb nor a name such as ``../../etc/cron.d/x`` in one can do harm."""
    path = archive(town.folder / name, ("../../evil.shp", b"x"), ("/tmp/evil.shp", b"y"))
    before = set(town.folder.parent.rglob("*"))
    assert_refused(coverage(anchors=path), name)
    town.transit_file()
    town.anchors_file()
    assert coverage(transit=path).code == 1
    assert not [p for p in town.folder.parent.rglob("*") if p not in before and "evil" in p.name]


@pytest.mark.parametrize(
    "name", ["bomb.gpkg", "bomb.geojson", "bomb.parquet", "bomb.fgb", "bomb.csv"]
)
def test_a_zip_bomb_under_another_name_is_no_layer(name: str, town: Town, coverage: Run) -> None:
    path = archive(town.folder / name, ("a", b"\x00" * 2**26))
    assert_refused(coverage(anchors=path), name)


@pytest.mark.parametrize(
    "text",
    [
        "<kml><Placemark><Point><coordinates>-6,53</coordinates></Point></Placemark></kml>",
        '<!DOCTYPE k [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;">]><kml>&b;</kml>',
    ],
    ids=["plain", "entity bomb"],
)
@pytest.mark.parametrize(
    "name", ["a.kml", "a.gml", "a.gpx", "a.svg", "a.vrt", "a.xml", "a.dxf", "a.pdf"]
)
def test_formats_of_many_powers_are_no_input(
    name: str, text: str, town: Town, coverage: Run, run: Run
) -> None:
    path = town.folder / name
    path.write_text(text)
    assert_refused(coverage(anchors=path), name)
    assert_refused(run("extract", path, "--gsd", 0.2, "-o", town.folder / "out.gpkg"), name)
    assert_refused(run("info", path), name)


def test_a_shapefile_that_points_elsewhere_reads_no_other_file(town: Town, coverage: Run) -> None:
    """A .shp whose .shx or .dbf is a link out of its folder is as trusted as the links are."""
    path = town.write("a.shp", town.anchors)
    (path.with_suffix(".shx")).write_bytes(b"\x00\x00\x27\x0a" + b"\xff" * 96)
    outcome = coverage(anchors=path)
    assert outcome.code in (0, 1)
    assert "Traceback" not in outcome.err


def png_bomb(side: int) -> bytes:
    """Return a PNG of one grey colour: gigabytes in a few hundred kilobytes."""

    def chunk(kind: bytes, content: bytes) -> bytes:
        check = zlib.crc32(kind + content).to_bytes(4, "big")
        return len(content).to_bytes(4, "big") + kind + content + check

    squeeze = zlib.compressobj(9)
    row = bytes(side + 1)
    packed = b"".join([squeeze.compress(row) for _ in range(side)]) + squeeze.flush()
    size = side.to_bytes(4, "big") * 2 + bytes([8, 0, 0, 0, 0])
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        [chunk(b"IHDR", size), chunk(b"IDAT", packed), chunk(b"IEND", b"")]
    )


@pytest.mark.slow
def test_a_picture_that_unpacks_to_gigabytes_is_looked_at_in_bounded_memory(town: Town) -> None:
    path = town.folder / "bomb.png"
    path.write_bytes(png_bomb(30_000))
    assert path.stat().st_size < 2**20
    code, said, peak_mib = measured("info", path)
    assert code in (0, 1), said
    assert "Traceback" not in said
    assert peak_mib < 500


@pytest.mark.slow
def test_a_sparse_image_of_200000_pixels_a_side_needs_bounded_memory(town: Town) -> None:
    """It is 120 GB unpacked and below 1 MB on disk."""
    import rasterio
    from affine import Affine

    path = town.folder / "vast.tif"
    with rasterio.open(
        path, "w", driver="GTiff", width=200_000, height=200_000, count=3, dtype="uint8",
        crs="EPSG:2157", transform=Affine(0.2, 0, 690000, 0, -0.2, 740000), tiled=True,
        blockxsize=4096, blockysize=4096, compress="deflate", SPARSE_OK=True, BIGTIFF="YES",
    ):  # fmt: skip
        pass
    assert path.stat().st_size < 2**20
    code, said, peak_mib = measured("info", path)
    assert code == 0, said
    assert peak_mib < 500

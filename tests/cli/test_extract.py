"""The verbs that make a study, as a user runs them, on rasters drawn here and on real files."""

import json
from dataclasses import dataclass, field
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import rasterio
import rasterio.warp
from rasterio.transform import Affine

from covertool.cli.extract_files import job_ledger
from covertool.gis.geopackage import read_metadata
from covertool.gis.read import read_study
from covertool.gis.sample import sample_folder
from tests.running import ok, run

DATA = Path(__file__).parents[2] / "../shared/data"
real = pytest.mark.skipif(not DATA.is_dir(), reason="the shared real data is not here")


def picture(path: Path, *, size=(300, 200), driver="PNG", **more) -> Path:
    width, height = size
    values = np.random.default_rng(1).integers(80, 110, (3, height, width)).astype(np.uint8)
    with rasterio.open(
        path, "w", driver=driver, width=width, height=height, count=3, dtype="uint8", **more
    ) as out:
        out.write(values)
    return path


@pytest.fixture
def bare(tmp_path):
    return picture(tmp_path / "bare.png")


@real
def test_munich_becomes_a_study_that_coverage_takes(tmp_path):
    study, seen = tmp_path / "munich.gpkg", tmp_path / "seen.png"
    image = DATA / "imagery/munich_mos155.png"
    got = json.loads(
        ok("extract", image, "--gsd", 0.125, "--mask", DATA / "imagery/munich_mos155_mask.png",
           "--score", DATA / "imagery/munich_mos155.geojson", "--preview", seen, "-o", study,
           "--json")
    )  # fmt: skip
    read = read_study(study)
    assert (got["schema_version"], got["command"]) == (1, "extract")
    assert got["vehicles"] == len(read.vehicles)
    assert got["parked"] == len(read.anchors) == sum(p is True for p in read.vehicles.parked)
    assert got["transit_area_m2"] == pytest.approx(read.transit.area_m2)
    with rasterio.open(DATA / "imagery/munich_mos155_mask.png") as mask:
        pixels = int((mask.read(1) > 127).sum())
    assert got["transit_area_m2"] == pytest.approx(pixels * 0.125**2, rel=0.005)
    assert got["score"]["parked_precision"] >= 0.9
    assert got["score"]["parked_recall"] >= 0.9
    with rasterio.open(seen) as drawn, rasterio.open(image) as original:
        assert drawn.shape == original.shape
    levels = json.loads(ok("coverage", study, "--radius", 15, "--json"))["results"][0]["levels"]
    assert sum(level["fraction"] for level in levels.values()) == pytest.approx(1)


@real
def test_a_planner_without_imagery_gets_coverage_from_osm(tmp_path):
    osm, study = DATA / "osm/helsinki.osm.pbf", tmp_path / "town.gpkg"
    ok("transit", osm, "-o", study)
    ok("anchors", "parked", "--osm", osm, "--occupancy", 0.8, "--seed", 1, "--into", study)
    assert len(read_study(study).anchors) > 500
    assert "Level 3" in ok("coverage", study, "--radius", 15)


@real
def test_the_same_seed_parks_the_same_cars(tmp_path):
    osm = DATA / "osm/helsinki.osm.pbf"
    frames = []
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        ok("anchors", "parked", "--osm", osm, "--seed", seed, "-o", tmp_path / f"{name}.gpkg")
        frames.append(gpd.read_file(tmp_path / f"{name}.gpkg", layer="anchors"))
    assert frames[0].equals(frames[1])
    assert len(frames[0]) != len(frames[2])


def test_a_missing_gsd_is_asked_for(bare, tmp_path):
    done = run("extract", bare, "-o", tmp_path / "a.gpkg")
    assert (done.returncode, "--gsd" in done.stderr) == (1, True)


def test_coarse_pixels_are_refused_with_the_mend(bare, tmp_path):
    done = run("extract", bare, "--gsd", 0.5, "-o", tmp_path / "a.gpkg")
    assert (done.returncode, "--force" in done.stderr) == (1, True)


def test_without_mask_or_osm_the_user_is_warned_and_there_is_no_transit(bare, tmp_path):
    done = run("extract", bare, "--gsd", 0.2, "-o", tmp_path / "a.gpkg", "--json")
    got = json.loads(done.stdout)
    assert "neither --mask nor --osm" in done.stderr
    assert (got["parked"], got["transit_area_m2"]) == (None, None)
    assert "transit" not in set(gpd.list_layers(tmp_path / "a.gpkg")["name"])


def test_a_run_that_is_taken_up_again_gives_the_same_and_another_gsd_is_another_job(bare, tmp_path):
    def found(gsd, *more):
        got = json.loads(ok("extract", bare, "--gsd", gsd, "--threshold", 0.01, "--json", *more))
        return {key: got[key] for key in ("vehicles", "gsd_m", "pixels")}

    resume = ("--resume", tmp_path / "windows")
    assert found(0.2) == found(0.2, *resume) == found(0.2, *resume)
    assert found(0.1, *resume) == found(0.1)


def test_a_mask_of_another_shape_is_refused(bare, tmp_path):
    mask = picture(tmp_path / "mask.png", size=(100, 100))
    done = run("extract", bare, "--gsd", 0.2, "--mask", mask, "-o", tmp_path / "a.gpkg")
    assert done.returncode == 1
    assert "300 x 200" in done.stderr
    assert not (tmp_path / "a.gpkg").exists()


def test_a_mask_of_another_crs_lies_where_the_image_lies(tmp_path):
    image = picture(
        tmp_path / "image.tif", driver="GTiff", crs="EPSG:32629",
        transform=Affine(0.2, 0, 680_000, 0, -0.2, 5_916_000),
    )  # fmt: skip
    with rasterio.open(image) as opened:
        west, _, _, north = rasterio.warp.transform_bounds(opened.crs, "EPSG:2157", *opened.bounds)
    with rasterio.open(
        tmp_path / "mask.tif", "w", driver="GTiff", width=300, height=300, count=1, dtype="uint8",
        crs="EPSG:2157", transform=Affine(0.5, 0, west - 40, 0, -0.5, north + 40),
    ) as out:  # fmt: skip
        out.write(np.full((1, 300, 300), 255, np.uint8))
    study = tmp_path / "a.gpkg"
    got = json.loads(ok("extract", image, "--mask", tmp_path / "mask.tif", "-o", study, "--json"))
    assert got["transit_area_m2"] == pytest.approx(60 * 40, rel=0.01)
    assert gpd.read_file(study, layer="transit").crs.to_epsg() == 32629


def test_two_sources_of_the_transit_area_are_a_usage_error(bare, tmp_path):
    done = run("extract", bare, "--mask", bare, "--osm", "x.osm", "-o", tmp_path / "a.gpkg")
    assert done.returncode == 2


def test_an_existing_study_is_kept_unless_told_otherwise(bare, tmp_path):
    (tmp_path / "a.gpkg").write_bytes(b"mine")
    done = run("extract", bare, "--gsd", 0.2, "-o", tmp_path / "a.gpkg")
    assert (done.returncode, (tmp_path / "a.gpkg").read_bytes()) == (1, b"mine")
    assert "--overwrite" in done.stderr


@dataclass(frozen=True)
class NamedModel:
    """A user's model: two files may have one name, and a repr that hides their bytes."""

    model: bytes = field(repr=False)
    name: str = "own.onnx"


def test_another_model_of_the_same_name_is_another_job(bare, tmp_path):
    jobs = [
        job_ledger(tmp_path / "windows", [bare], NamedModel(model), [None]).job
        for model in (b"one", b"two", b"one")
    ]
    assert jobs[0] == jobs[2] != jobs[1]


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    """Return a part of the sample's orthophoto whole, and cut in four with a VRT of the parts."""
    folder = tmp_path_factory.mktemp("town")
    tiles = folder / "tiles"
    tiles.mkdir()
    with rasterio.open(sample_folder() / "orthophoto.tif") as photo:
        values = photo.read()[:, :1200, :1200]
        affine, crs = photo.transform, photo.crs
    for name, column, row, side in [
        ("whole", 0, 0, 1200), *((f"tiles/{i}", i % 2 * 600, i // 2 * 600, 600) for i in range(4)),
    ]:  # fmt: skip
        with rasterio.open(
            folder / f"{name}.tif", "w", driver="GTiff", width=side, height=side, count=3,
            dtype="uint8", crs=crs, transform=affine @ Affine.translation(column, row),
        ) as out:  # fmt: skip
            out.write(values[:, row : row + side, column : column + side])
    sources = "".join(
        f'''<SimpleSource><SourceFilename relativeToVRT="1">tiles/{i}.tif</SourceFilename>
        <SourceBand>BAND</SourceBand><SrcRect xOff="0" yOff="0" xSize="600" ySize="600"/>
        <DstRect xOff="{i % 2 * 600}" yOff="{i // 2 * 600}" xSize="600" ySize="600"/>
        </SimpleSource>'''
        for i in range(4)
    )
    bands = "".join(
        f'<VRTRasterBand dataType="Byte" band="{band}">'
        f"{sources.replace('BAND', str(band))}</VRTRasterBand>"
        for band in (1, 2, 3)
    )
    steps = ", ".join(map(repr, affine.to_gdal()))
    (folder / "town.vrt").write_text(
        f'<VRTDataset rasterXSize="1200" rasterYSize="1200"><SRS>{crs.to_string()}</SRS>'
        f"<GeoTransform>{steps}</GeoTransform>{bands}</VRTDataset>"
    )
    return folder


def cars_of(path):
    frame = gpd.read_file(path, layer="vehicles")
    middle = frame.geometry.centroid
    table = np.column_stack([middle.x, middle.y, frame["score"]])
    return frame, table[np.lexsort(table.T)]


def test_tiles_of_a_vrt_give_the_cars_of_the_whole_with_two_workers(town, tmp_path):
    ok("extract", town / "whole.tif", "-o", tmp_path / "whole.gpkg")
    ok("extract", town / "town.vrt", "-o", tmp_path / "tiles.gpkg", "--workers", 2,
       "--preview", tmp_path / "seen.png")  # fmt: skip
    _, whole = cars_of(tmp_path / "whole.gpkg")
    frame, tiles = cars_of(tmp_path / "tiles.gpkg")
    assert len(whole) > 30
    np.testing.assert_allclose(tiles, whole, atol=1e-4)
    assert frame["image"].nunique() > 1
    middle = frame.geometry.centroid
    for number in range(4):
        with rasterio.open(town / "tiles" / f"{number}.tif") as tile:
            west, south, east, north = tile.bounds
        inside = middle.x.between(west, east) & middle.y.between(south, north)
        assert (frame["image"][inside] == f"{number}.tif").all()
    with rasterio.open(tmp_path / "seen.png") as seen:
        assert seen.shape == (1200, 1200)


def test_images_on_two_grids_have_no_one_preview_and_that_is_told_first(town, tmp_path):
    shifted = picture(tmp_path / "b.tif", driver="GTiff", crs="EPSG:2157",
                      transform=Affine(0.2, 0, 693380.05, 0, -0.2, 737460))  # fmt: skip
    done = run("extract", town / "whole.tif", shifted, "--preview", tmp_path / "two.png")
    assert (done.returncode, "2 pixel grids" in done.stderr) == (2, True)


def test_a_study_tells_which_options_shaped_it_and_not_where_it_went_or_who_worked(bare, tmp_path):
    study = tmp_path / "town.gpkg"
    ok("extract", bare, "--gsd", 0.125, "--detector", "classical", "--workers", 2, "-o", study)
    told = json.loads(read_metadata(study)["provenance extract"])
    assert told["command"][:2] == ["extract", str(bare)]
    assert [given["path"] for given in told["inputs"]] == [str(bare)]
    assert told["options"]["detector"] == "classical"
    assert not {"output", "overwrite", "workers", "as_json"} & set(told["options"])

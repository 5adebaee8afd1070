"""Coordinate systems: those that give the same answer, and those that are refused."""

from __future__ import annotations

from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import rasterio
import shapely
from affine import Affine

from tests.bad_inputs.conftest import (
    CRS,
    EAST_M,
    NORTH_M,
    Run,
    Town,
    assert_refused,
    assert_works_like,
)


@pytest.mark.parametrize(
    ("crs", "within"),
    [
        ("EPSG:4326", 1e-6),
        ("EPSG:3857", 1e-6),
        ("EPSG:29903", 1e-3),
        ("EPSG:32629", 1e-3),
        ("EPSG:3035", 1e-5),
        ("+proj=tmerc +lat_0=53.5 +lon_0=-8 +k=0.99982 +x_0=600000 +y_0=750000 +ellps=GRS80"
         " +units=us-ft", 1e-5),
    ],
    ids=["degrees", "web mercator", "old Irish grid", "UTM", "equal area", "feet"],
)  # fmt: skip
def test_the_same_town_in_another_crs_gives_the_same_answer(
    crs: str, within: float, town: Town, coverage: Run
) -> None:
    anchors = town.write("moved_anchors.gpkg", town.anchors.to_crs(crs))
    transit = town.write("moved_transit.gpkg", town.transit.to_crs(crs))
    assert_works_like(coverage(), coverage(anchors=anchors, transit=transit), within)
    assert_works_like(coverage(), coverage(anchors=anchors), within)


def test_a_file_without_a_crs_is_refused_and_taken_with_one(town: Town, coverage: Run) -> None:
    bare = gpd.GeoDataFrame(town.anchors.drop(columns="geometry"), geometry=town.anchors.geometry)
    path = town.write("bare.gpkg", bare.set_crs(None, allow_override=True))
    assert_refused(coverage(anchors=path), "bare.gpkg", "--crs")
    assert_works_like(coverage(), coverage("--crs", CRS, anchors=path))


def test_a_named_crs_against_that_of_the_file_is_refused(town: Town, coverage: Run) -> None:
    assert_refused(coverage("--crs", "EPSG:32629"), "EPSG:32629", "EPSG:2157")


@pytest.mark.parametrize("crs", ["EPSG:99999", "nonsense", "2157 ", "EPSG:", "+proj=none"])
def test_a_crs_that_proj_does_not_know_is_refused(crs: str, coverage: Run) -> None:
    outcome = coverage("--dst-crs", crs)
    if crs.strip() == "2157":
        assert outcome.code in (0, 1)
    else:
        assert_refused(outcome)


def test_metres_labelled_as_degrees_are_refused(town: Town, coverage: Run) -> None:
    wrong = town.anchors.set_crs(4326, allow_override=True)
    assert_refused(coverage(anchors=town.write("wrong.gpkg", wrong)), "wrong.gpkg")


def test_degrees_labelled_as_metres_are_far_away_and_told(town: Town, coverage: Run) -> None:
    wrong = town.anchors.to_crs(4326).set_crs(CRS, allow_override=True)
    outcome = coverage(anchors=town.write("wrong.gpkg", wrong))
    assert outcome.fractions() == [1, 0, 0, 0]
    assert "no anchor is within 1 km" in outcome.err


def test_latitude_and_longitude_swapped_are_told(town: Town, coverage: Run) -> None:
    degrees = town.anchors.to_crs(4326)
    swapped = shapely.transform(degrees.geometry.to_numpy(), lambda points: points[:, ::-1])
    frame = gpd.GeoDataFrame({"id": degrees["id"]}, geometry=swapped, crs=4326)
    outcome = coverage(anchors=town.write("swapped.gpkg", frame))
    assert outcome.code in (0, 1)
    if outcome.code == 0:
        assert outcome.fractions()[0] == 1
    assert outcome.err != ""


@pytest.mark.parametrize("lon", [179.9995, -179.9995])
def test_a_town_on_the_antimeridian_has_the_area_that_it_has(
    lon: float, town: Town, coverage: Run
) -> None:
    """A street of 0.002 degrees of longitude on the equator is 222.6 m long."""
    street = shapely.box(lon - 0.0004, -0.0001, lon + 0.0004, 0.0001)
    frame = gpd.GeoDataFrame({"id": [1]}, geometry=[street], crs=4326)
    car = gpd.GeoDataFrame({"id": ["a"]}, geometry=[shapely.Point(lon, 0)], crs=4326)
    outcome = coverage(
        anchors=town.write("car.gpkg", car), transit=town.write("street.gpkg", frame)
    )
    assert outcome.code == 0
    # 0.0008 by 0.0002 degrees: 89.06 m by 22.11 m; a disc of 15 m reaches over both kerbs.
    length_m, width_m, radius_m = 89.06, 22.11, 15.0
    half = width_m / 2
    inside = 2 * (half * np.sqrt(radius_m**2 - half**2) + radius_m**2 * np.arcsin(half / radius_m))
    assert outcome.fractions()[1] == pytest.approx(inside / (length_m * width_m), rel=2e-3)


def test_a_place_at_the_pole_is_computed_or_refused_never_guessed(
    town: Town, coverage: Run
) -> None:
    street = shapely.box(10, 89.9990, 20, 89.9995)
    frame = gpd.GeoDataFrame({"id": [1]}, geometry=[street], crs=4326)
    car = gpd.GeoDataFrame({"id": ["a"]}, geometry=[shapely.Point(15, 89.99925)], crs=4326)
    outcome = coverage(
        anchors=town.write("car.gpkg", car), transit=town.write("street.gpkg", frame)
    )
    if outcome.code == 0:
        assert sum(outcome.fractions()) == pytest.approx(1)
        assert outcome.fractions()[1] > 0.5
    else:
        assert_refused(outcome)


@pytest.mark.parametrize("scale", [0.9996, 1.0])
def test_a_crs_of_an_unknown_unit_or_axis_order_still_gives_east_before_north(
    scale: float, town: Town, coverage: Run
) -> None:
    north_first = (
        'PROJCRS["north first",BASEGEOGCRS["IRENET95",DATUM["IRENET95",'
        'ELLIPSOID["GRS 1980",6378137,298.257222101]]],CONVERSION["tm",'
        'METHOD["Transverse Mercator",ID["EPSG",9807]],'
        'PARAMETER["Latitude of natural origin",53.5,ANGLEUNIT["degree",0.0174532925199433]],'
        'PARAMETER["Longitude of natural origin",-8,ANGLEUNIT["degree",0.0174532925199433]],'
        f'PARAMETER["Scale factor at natural origin",{scale},SCALEUNIT["unity",1]],'
        'PARAMETER["False easting",600000,LENGTHUNIT["metre",1]],'
        'PARAMETER["False northing",750000,LENGTHUNIT["metre",1]]],CS[Cartesian,2],'
        'AXIS["northing (N)",north,ORDER[1]],AXIS["easting (E)",east,ORDER[2]],'
        'LENGTHUNIT["metre",1]]'
    )
    anchors = town.write("a.parquet", town.anchors.to_crs(north_first))
    transit = town.write("t.parquet", town.transit.to_crs(north_first))
    assert_works_like(coverage(), coverage(anchors=anchors, transit=transit), 1e-3)


def scene(path: Path, transform: Affine, **options: object) -> Path:
    """Write a grey square of 40 m with a bright lane."""
    picture = np.full((3, 200, 200), 90, dtype=np.uint8)
    picture[:, 80:120] = 140
    with rasterio.open(
        path, "w", driver="GTiff", width=200, height=200, count=3, dtype="uint8",
        **{"crs": CRS, "transform": transform, **options},
    ) as target:  # fmt: skip
        target.write(picture)
    return path


def road(
    path: Path, transform: Affine | None, values: tuple[int, int] = (0, 255), **options: object
) -> Path:
    mask = np.full((200, 200), values[0], dtype=np.uint8)
    mask[80:120] = values[1]
    profile = {"driver": "GTiff", "width": 200, "height": 200, "count": 1, "dtype": "uint8"}
    if transform is not None:
        profile |= {"crs": CRS, "transform": transform}
    with rasterio.open(path, "w", **{**profile, **options}) as target:
        target.write(mask, 1)
    return path


NORTH_UP = Affine(0.2, 0, EAST_M, 0, -0.2, NORTH_M + 40)


@pytest.mark.parametrize(
    "transform",
    [
        Affine(0.2, 0, EAST_M, 0, 0.2, NORTH_M),
        NORTH_UP * Affine.rotation(30),
        Affine(0.2, 0, EAST_M, 0, -0.3, NORTH_M + 60),
    ],
    ids=["south up", "rotated", "anisotropic"],
)
def test_an_image_in_any_position_gives_the_area_of_its_lane(
    transform: Affine, town: Town, run: Run
) -> None:
    image = scene(town.folder / "image.tif", transform)
    mask = road(town.folder / "mask.tif", transform)
    outcome = run("extract", image, "--mask", mask, "-o", town.folder / "out.gpkg", "--overwrite")
    assert outcome.code == 0, outcome.err
    area = gpd.read_file(town.folder / "out.gpkg", layer="transit").area.sum()
    assert area == pytest.approx(40 * 200 * abs(transform.determinant), rel=5e-3)


@pytest.mark.parametrize(
    ("values", "options"),
    [((0, 1), {}), ((0, 255), {}), ((0, 255), {"nodata": 7})],
    ids=["0 and 1", "0 and 255", "nodata elsewhere"],
)
def test_masks_of_any_values_mean_the_same(
    values: tuple[int, int], options: dict[str, object], town: Town, run: Run
) -> None:
    mask = road(town.folder / "mask.tif", NORTH_UP, values, **options)
    outcome = run("transit", mask, "-o", town.folder / "t.gpkg")
    assert outcome.code == 0, outcome.err
    area = gpd.read_file(town.folder / "t.gpkg", layer="transit").area.sum()
    assert area == pytest.approx(40 * 200 * 0.04, rel=5e-3)


def test_a_mask_in_colour_means_what_the_grey_one_means(town: Town, run: Run) -> None:
    path = town.folder / "mask.tif"
    lane = np.zeros((3, 200, 200), dtype=np.uint8)
    lane[:, 80:120] = 255
    with rasterio.open(
        path, "w", driver="GTiff", width=200, height=200, count=3, dtype="uint8", crs=CRS,
        transform=NORTH_UP, photometric="RGB",
    ) as target:  # fmt: skip
        target.write(lane)
    outcome = run("transit", path, "-o", town.folder / "t.gpkg")
    assert outcome.code == 0, outcome.err
    area = gpd.read_file(town.folder / "t.gpkg", layer="transit").area.sum()
    assert area == pytest.approx(40 * 200 * 0.04, rel=5e-3)


def test_places_without_data_in_a_mask_are_no_road(town: Town, run: Run) -> None:
    path = road(town.folder / "mask.tif", NORTH_UP, nodata=7)
    with rasterio.open(path, "r+") as target:
        values = target.read(1)
        values[:, :50] = 7
        target.write(values, 1)
    outcome = run("transit", path, "-o", town.folder / "t.gpkg")
    assert outcome.code == 0, outcome.err
    area = gpd.read_file(town.folder / "t.gpkg", layer="transit").area.sum()
    assert area == pytest.approx(40 * 150 * 0.04, rel=5e-3)


def test_a_mask_in_another_crs_lies_where_it_says(town: Town, run: Run) -> None:
    """The lane as a box in UTM; its area on the ground is the same within both scale factors."""
    image = scene(town.folder / "image.tif", NORTH_UP)
    centre = gpd.GeoSeries([shapely.Point(EAST_M + 20, NORTH_M + 20)], crs=CRS).to_crs(32629)[0]
    mask = road(
        town.folder / "mask.tif",
        Affine(0.2, 0, centre.x - 20, 0, -0.2, centre.y + 20),
        crs="EPSG:32629",
    )
    outcome = run("extract", image, "--mask", mask, "-o", town.folder / "out.gpkg")
    assert outcome.code == 0, outcome.err
    found = gpd.read_file(town.folder / "out.gpkg", layer="transit").to_crs(CRS)
    middle = found.union_all().centroid
    assert middle.distance(shapely.Point(EAST_M + 20, NORTH_M + 20)) < 0.5


@pytest.mark.parametrize("value", [0, 255])
def test_a_mask_of_one_value_is_everything_or_is_refused(value: int, town: Town, run: Run) -> None:
    mask = road(town.folder / "mask.tif", NORTH_UP, (value, value))
    outcome = run("transit", mask, "-o", town.folder / "t.gpkg")
    if value:
        area = gpd.read_file(town.folder / "t.gpkg", layer="transit").area.sum()
        assert area == pytest.approx(1600, rel=5e-3)
    else:
        assert_refused(outcome, "mask.tif")


def test_a_mask_on_another_grid_lies_where_it_says(town: Town, run: Run) -> None:
    image = scene(town.folder / "image.tif", NORTH_UP)
    moved = Affine(0.2, 0, EAST_M - 5, 0, -0.2, NORTH_M + 45)
    mask = road(town.folder / "mask.tif", moved)
    assert run("extract", image, "--mask", mask, "-o", town.folder / "out.gpkg").code == 0
    bounds = gpd.read_file(town.folder / "out.gpkg", layer="transit").total_bounds
    assert bounds[3] == pytest.approx(NORTH_M + 45 - 16, abs=0.3)


def test_a_mask_without_georeference_of_another_shape_is_refused(town: Town, run: Run) -> None:
    image = scene(town.folder / "image.tif", NORTH_UP)
    path = town.folder / "mask.png"
    with rasterio.open(path, "w", driver="PNG", width=100, height=90, count=1, dtype="uint8") as t:
        t.write(np.full((1, 90, 100), 255, dtype=np.uint8))
    output = town.folder / "out.gpkg"
    assert_refused(run("extract", image, "--mask", path, "-o", output), "mask.png")
    assert not output.exists()


@pytest.mark.parametrize("dtype", ["uint16", "int16", "float32"])
def test_deeper_pixels_and_gaps_in_them_are_read(dtype: str, town: Town, run: Run) -> None:
    path = town.folder / "deep.tif"
    picture = np.full((3, 200, 200), 900, dtype=dtype)
    if dtype == "float32":
        picture[:, :50] = np.nan
    with rasterio.open(
        path, "w", driver="GTiff", width=200, height=200, count=3, dtype=dtype, crs=CRS,
        transform=NORTH_UP,
    ) as target:  # fmt: skip
        target.write(picture)
    outcome = run("extract", path, "-o", town.folder / "out.gpkg", "--json")
    assert outcome.code == 0, outcome.err


def test_a_coarse_image_is_refused_with_its_mend(town: Town, run: Run) -> None:
    path = scene(town.folder / "coarse.tif", Affine(0.6, 0, EAST_M, 0, -0.6, NORTH_M))
    outcome = run("extract", path, "-o", town.folder / "out.gpkg")
    assert_refused(outcome, "coarse.tif", "--force")

"""The sample study is what data/README.md says of it, checked by ways that did not make it."""

import hashlib
import re
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import rasterio
import shapely
from scipy.spatial import cKDTree

DATA = Path(__file__).parents[1] / "data"
STUDY = DATA / "sample.gpkg"
TABLE_IV = {15: (45.43, 14.81, 11.98, 27.78), 100: (2.45, 0.31, 0.22, 97.02)}
WITHIN = {15: 3.0, 100: 1.5}


@pytest.fixture(scope="module")
def transit() -> gpd.GeoDataFrame:
    return gpd.read_file(STUDY, layer="transit")


@pytest.fixture(scope="module")
def cars() -> gpd.GeoDataFrame:
    return gpd.read_file(STUDY, layer="vehicles")


def test_the_readme_lists_the_checksums_of_the_files():
    listed = re.findall(
        r"^\| (\S+) \| (\d+) \| ([0-9a-f]{64}) \|$", (DATA / "README.md").read_text(), re.M
    )
    assert len(listed) == 5
    for name, size, checksum in listed:
        content = (DATA / name).read_bytes()
        assert (len(content), hashlib.sha256(content).hexdigest()) == (int(size), checksum), name


def test_the_study_fits_in_twelve_megabytes():
    assert sum(path.stat().st_size for path in DATA.glob("*.*")) < 12e6


def test_the_transit_area_is_valid_and_disjoint(transit):
    parts = transit.geometry.explode()
    assert parts.is_valid.all()
    assert shapely.union_all(parts.array).area == pytest.approx(parts.area.sum(), rel=1e-9)


@pytest.mark.parametrize("radius", [15, 100])
def test_the_coverage_lies_near_the_calibration_target(transit, radius):
    """Counted on a 1.5 m lattice, which the engine does not use."""
    area = shapely.union_all(transit.geometry.array)
    x0, y0, x1, y1 = area.bounds
    x, y = (grid.ravel() for grid in np.meshgrid(np.arange(x0, x1, 1.5), np.arange(y0, y1, 1.5)))
    shapely.prepare(area)
    inside = shapely.contains_xy(area, x, y)
    points = gpd.read_file(STUDY, layer="anchors").geometry
    tree = cKDTree(np.column_stack([points.x, points.y]))
    places = np.column_stack([x[inside], y[inside]])
    heard = np.minimum(tree.query_ball_point(places, radius, return_length=True), 3)
    percents = 100 * np.bincount(heard, minlength=4) / len(heard)
    assert percents == pytest.approx(TABLE_IV[radius], abs=WITHIN[radius])


def test_there_are_as_many_anchors_as_the_paper_counted_cars(cars):
    assert len(gpd.read_file(STUDY, layer="anchors")) == len(cars) == 4541


def test_no_parked_car_stands_in_a_building_or_in_another_car(cars):
    walls = shapely.union_all(gpd.read_file(STUDY, layer="buildings").geometry.array)
    assert not shapely.intersects(cars.geometry.array.centroid, walls).any()
    bodies = np.asarray(cars.geometry.array)
    one, other = shapely.STRtree(bodies).query(bodies, predicate="intersects")
    shared = shapely.area(shapely.intersection(bodies[one], bodies[other]))
    assert shared[one != other].max(initial=0.0) < 0.8


def test_buildings_touch_but_do_not_overlap():
    walls = np.asarray(gpd.read_file(STUDY, layer="buildings").geometry.array)
    one, other = shapely.STRtree(walls).query(walls, predicate="intersects")
    shared = shapely.area(shapely.intersection(walls[one], walls[other]))[one != other]
    assert len(shared) > 1000
    assert shared.max() < 0.1


def test_no_parked_car_has_its_centre_in_the_carriageway(cars, transit):
    area = shapely.union_all(transit.geometry.array)
    assert not shapely.contains(area, np.asarray(cars.geometry.array.centroid)).any()


def test_every_observation_is_of_a_segment_and_both_directions_exist():
    segments = gpd.read_file(STUDY, layer="segments")
    seen = pd.read_csv(DATA / "observations.csv")
    assert set(seen.segment_id) == set(segments.segment_id)
    lines = {tuple(line.coords) for line in segments.geometry.explode()}
    assert all(line[::-1] in lines for line in lines)


def test_the_road_mask_is_the_transit_area_of_its_district(transit):
    with (
        rasterio.open(DATA / "road_mask.tif") as mask,
        rasterio.open(DATA / "orthophoto.tif") as photo,
    ):
        assert (mask.transform, mask.shape, mask.crs) == (photo.transform, photo.shape, photo.crs)
        share = (mask.read(1) == 255).mean()
        district = shapely.box(*mask.bounds)
    expected = shapely.union_all(transit.geometry.array).intersection(district).area / district.area
    assert share == pytest.approx(expected, rel=0.01)


def test_the_district_shows_cars_at_the_kerb_on_driveways_and_in_a_car_park(cars):
    with rasterio.open(DATA / "orthophoto.tif") as photo:
        district = shapely.box(*photo.bounds)
    shown = cars[shapely.contains(district, np.asarray(cars.geometry.array.centroid))]
    assert shown.site.value_counts().min() >= 30
    assert set(shown.site) == {"on_street", "off_street", "lot"}


def test_the_study_says_that_it_is_synthetic():
    assert "synthetic" in (DATA / "README.md").read_text().lower()
    with rasterio.open(DATA / "orthophoto.tif") as photo:
        assert "Synthetic" in photo.tags()["TITLE"]

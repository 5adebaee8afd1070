import pickle

import numpy as np
import pytest
import shapely
from pyproj import CRS
from rasterio.transform import Affine
from scenes import BrightBoxes, paint

from covertool.errors import OptionError
from covertool.extract.sites import ParkedRule, depth_m, judge
from covertool.extract.vehicles import extract_vehicles
from covertool.model import TransitArea
from covertool.spread import Ledger

EAST, NORTH = 600_000.0, 750_000.0
CARS = [
    (EAST + 20, NORTH + 20, 0.0, 4.5, 1.8),
    (EAST + 40.3, NORTH + 31.7, 30.0, 4.5, 1.8),
    (EAST + 60.1, NORTH + 45.2, 120.0, 5.0, 2.0),
]


def matched(vehicles, cars):
    """Return the row of the vehicle nearest to each car, after a check that all were found."""
    assert len(vehicles) == len(cars)
    rows = [int(np.hypot(vehicles.x_m - x, vehicles.y_m - y).argmin()) for x, y, *_ in cars]
    assert sorted(rows) == list(range(len(cars)))
    return vehicles.take(rows)


def turned(affine, angle):
    return affine @ Affine.rotation(angle)


@pytest.mark.parametrize(
    ("affine", "size", "crs"),
    [
        (Affine(0.2, 0, EAST, 0, -0.2, NORTH + 60), (400, 300), "EPSG:2157"),
        (Affine(0.1, 0, EAST, 0, -0.1, NORTH + 60), (800, 600), "EPSG:2157"),
        (Affine(0.3, 0, EAST, 0, -0.15, NORTH + 60), (270, 400), "EPSG:2157"),
        (Affine(0.2, 0, EAST, 0, 0.2, NORTH), (400, 300), "EPSG:2157"),
        (turned(Affine(0.2, 0, EAST - 10, 0, -0.2, NORTH + 50), -25), (520, 520), "EPSG:2157"),
    ],
    ids=["north up", "finer", "anisotropic", "south up", "rotated"],
)
def test_place_heading_and_size_are_true_under_any_transform(tmp_path, affine, size, crs):
    raster = paint(tmp_path / "a.tif", CARS, affine=affine, size=size, crs=crs)
    found = matched(extract_vehicles(raster, BrightBoxes()).vehicles, CARS)
    for i, (x, y, heading, length, width) in enumerate(CARS):
        assert np.hypot(found.x_m[i] - x, found.y_m[i] - y) < 0.15
        assert abs((found.heading_deg[i] - heading + 90) % 180 - 90) < 4
        assert found.length_m[i] == pytest.approx(length, abs=0.45)
        assert found.width_m[i] == pytest.approx(width, abs=0.45)


@pytest.mark.parametrize("crs", ["EPSG:4326", "EPSG:3857"])
def test_degrees_and_web_mercator_give_true_metres(tmp_path, crs):
    step = {"EPSG:4326": (3e-6, 1.8e-6), "EPSG:3857": (0.334, 0.334)}[crs]
    from covertool.crs import transform

    x, y = transform(np.array([EAST + 40.0]), np.array([NORTH + 30.0]), CRS("EPSG:2157"), CRS(crs))
    affine = Affine(step[0], 0, x[0] - 200 * step[0], 0, -step[1], y[0] + 200 * step[1])
    raster = paint(tmp_path / "a.tif", CARS, affine=affine, size=(400, 400), crs=crs)
    assert raster.crs == CRS("EPSG:2157")
    found = matched(extract_vehicles(raster, BrightBoxes()).vehicles, CARS)
    for i, (east, north, heading, length, _) in enumerate(CARS):
        assert np.hypot(found.x_m[i] - east, found.y_m[i] - north) < 0.15
        assert abs((found.heading_deg[i] - heading + 90) % 180 - 90) < 4
        assert found.length_m[i] == pytest.approx(length, abs=0.5)


@pytest.mark.parametrize(
    "kind",
    [
        {"dtype": "uint16", "dark": 300, "bright": 3900},
        {"dtype": "uint16", "bands": 4, "dark": 9000, "bright": 52000},
        {"bands": 1},
        {"dtype": "float32", "dark": 0.05, "bright": 0.6},
        {"dark": 100, "bright": 140},
    ],
    ids=["16 bit", "16 bit, four bands", "grey", "reflectance", "hazy"],
)
def test_any_depth_and_contrast_is_stretched_alike(tmp_path, kind):
    raster = paint(tmp_path / "a.tif", CARS, **kind)
    matched(extract_vehicles(raster, BrightBoxes()).vehicles, CARS)


def test_trucks_are_counted_apart_once_across_windows_and_are_no_anchors(tmp_path):
    truck = (EAST + 40.0, NORTH + 50.0, 90.0, 9.0, 2.5)
    raster = paint(tmp_path / "a.tif", [*CARS, truck])
    for core_px in (64, 2000):
        found = extract_vehicles(raster, BrightBoxes(), core_px=core_px)
        matched(found.vehicles, CARS)
        assert found.trucks == 1
        assert len(found.anchors()) == len(CARS)


def test_nodata_hides_what_lies_there(tmp_path):
    raster = paint(tmp_path / "a.tif", CARS, nodata=230)
    assert len(extract_vehicles(raster, BrightBoxes()).vehicles) == 0


def many(count=60):
    chance = np.random.default_rng(3)
    spots = [(x, y) for x in range(6, 76, 8) for y in range(6, 56, 8)][:count]
    return [(EAST + x, NORTH + y, float(chance.integers(180)), 4.4, 1.8) for x, y in spots]


@pytest.mark.parametrize("core_px", [64, 97, 256])
def test_windows_of_any_size_find_the_same_cars(tmp_path, core_px):
    raster = paint(tmp_path / "a.tif", many())
    whole = extract_vehicles(raster, BrightBoxes(), core_px=2000).vehicles
    tiled = extract_vehicles(raster, BrightBoxes(), core_px=core_px).vehicles
    one, other = matched(whole, many()), matched(tiled, many())
    np.testing.assert_allclose(other.x_m, one.x_m, atol=0.11)
    np.testing.assert_allclose(other.y_m, one.y_m, atol=0.11)
    np.testing.assert_allclose(other.length_m, one.length_m, atol=0.25)


def test_a_seam_between_files_cuts_no_car_and_doubles_none(tmp_path):
    cars = [*many(), (EAST + 40.0, NORTH + 58.0, 90.0, 4.4, 1.8)]
    whole = paint(tmp_path / "whole.tif", cars)
    halves = [
        paint(tmp_path / f"{i}.tif", cars, size=(200, 300),
              affine=Affine(0.2, 0, EAST + 40 * i, 0, -0.2, NORTH + 60))
        for i in range(2)
    ]  # fmt: skip
    one = extract_vehicles(whole, BrightBoxes()).vehicles
    two = extract_vehicles(halves, BrightBoxes()).vehicles
    assert len(one) == len(two) == len(cars)
    assert set(two.image) == {"0.tif", "1.tif"}
    right = two.image == "1.tif"
    np.testing.assert_array_equal(right, two.x_m >= EAST + 40)
    np.testing.assert_allclose(
        two.x_m, EAST + np.where(right, 40, 0) + 0.2 * two.image_x_px, atol=1e-6
    )


def test_overlapping_files_off_each_others_grid_give_each_car_once(tmp_path):
    shifted = Affine(0.2, 0, EAST + 0.07, 0, -0.2, NORTH + 60.03)
    pair = [paint(tmp_path / "a.tif", CARS), paint(tmp_path / "b.tif", CARS, affine=shifted)]
    matched(extract_vehicles(pair, BrightBoxes()).vehicles, CARS)


def test_workers_and_a_ledger_change_nothing(tmp_path):
    raster = paint(tmp_path / "a.tif", many())
    plain = extract_vehicles(raster, BrightBoxes(), core_px=128)
    ledger = Ledger(tmp_path / "windows", "job")
    first = extract_vehicles(raster, BrightBoxes(), core_px=128, ledger=ledger)
    again = extract_vehicles(raster, BrightBoxes(), core_px=128, ledger=ledger)
    spread = extract_vehicles(pickle.loads(pickle.dumps(raster)), BrightBoxes(), core_px=128)
    for other in (first, again, spread):
        np.testing.assert_array_equal(other.vehicles.x_m, plain.vehicles.x_m)
        np.testing.assert_array_equal(other.vehicles.score, plain.vehicles.score)


def test_coarse_pixels_are_refused_unless_forced(tmp_path):
    affine = Affine(0.4, 0, EAST, 0, -0.4, NORTH + 60)
    raster = paint(tmp_path / "a.tif", CARS, affine=affine, size=(200, 150))
    with pytest.raises(OptionError, match="--force"):
        extract_vehicles(raster, BrightBoxes())
    assert extract_vehicles(raster, BrightBoxes(), force=True).gsd_m == pytest.approx(0.4, rel=1e-3)


def test_without_a_transit_area_nothing_is_judged_and_all_are_anchors(tmp_path):
    found = extract_vehicles(paint(tmp_path / "a.tif", CARS), BrightBoxes())
    assert all(parked is None for parked in found.vehicles.parked)
    assert all(site is None for site in found.vehicles.site)
    assert len(found.anchors()) == len(CARS)


def test_each_site_by_its_place_to_the_edge(tmp_path):
    street = shapely.box(EAST, NORTH + 28, EAST + 80, NORTH + 34)
    cars = [
        (EAST + 10, NORTH + 31, 90.0, 4.5, 1.8),  # in the lane
        (EAST + 30, NORTH + 26.9, 90.0, 4.5, 1.8),  # at the kerb
        (EAST + 50, NORTH + 45, 90.0, 4.5, 1.8),  # in a lot
        (EAST + 70, NORTH + 10, 90.0, 4.5, 1.8),  # in a garden
    ]
    transit = TransitArea(shapely.MultiPolygon([street]), CRS("EPSG:2157"))
    lot = shapely.MultiPolygon([shapely.box(EAST + 45, NORTH + 40, EAST + 55, NORTH + 50)])
    raster = paint(tmp_path / "a.tif", cars)
    found = extract_vehicles(raster, BrightBoxes(), transit=transit, lots=lot)
    by_place = matched(found.vehicles, cars)
    assert list(by_place.site) == ["carriageway", "on_street", "lot", "off_street"]
    assert list(by_place.parked) == [False, True, True, True]
    assert len(found.anchors()) == 3


def test_the_depth_is_the_distance_to_the_nearest_edge_with_its_sign():
    ring = shapely.MultiPolygon([shapely.box(0, 0, 10, 10) - shapely.box(4, 4, 6, 6)])
    x, y = np.array([1.0, 5.0, 3.0, -2.0]), np.array([5.0, 5.0, 5.0, 5.0])
    assert depth_m(x, y, ring).tolist() == [1.0, -1.0, 1.0, -2.0]


def test_the_pictures_border_is_no_kerb():
    road = shapely.MultiPolygon([shapely.box(0, 0, 50, 6)])
    car = np.array([0.3]), np.array([3.0])
    rectangle = np.array([shapely.box(-2, 2, 2.6, 4)], dtype=object)
    rule = ParkedRule(inside_m=1.3)
    outline = shapely.box(0, -20, 50, 20)
    assert judge(*car, rectangle, road, rule=rule)[1].tolist() == [True]
    assert judge(*car, rectangle, road, rule=rule, outline=outline)[1].tolist() == [False]

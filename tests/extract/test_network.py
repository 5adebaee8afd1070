"""The shipped network, run for real on pictures that the tests draw themselves."""

import json
import pickle
from importlib import resources

import cv2
import numpy as np
import pytest

from covertool.extract.detectors import runtime
from covertool.extract.detectors.network import CARD, WEIGHTS, NetworkDetector
from covertool.extract.vehicles import extract_vehicles
from covertool.gis.geotiff import open_raster

GSD_M = 0.20
FOLDER = resources.files("covertool.extract.detectors")


@pytest.fixture(scope="module")
def network():
    return NetworkDetector.shipped()


@pytest.fixture(scope="module")
def thorough():
    return NetworkDetector.shipped(tta=True)


def street(places, size=(256, 256), seed=0):
    """Return asphalt with cars at (x_m, y_m, heading_deg), drawn five times finer and averaged."""
    height, width = size
    fine = 5
    rng = np.random.default_rng(seed)
    image = np.full((height * fine, width * fine, 3), 110, np.uint8)
    for number, (x, y, heading) in enumerate(places):
        centre = np.array([x, y]) / GSD_M * fine
        paint = [(235, 235, 235), (35, 35, 40), (150, 30, 30), (150, 155, 160)][number % 4]
        for ahead, length, wide, colour in (
            (-0.1, 4.9, 2.3, (60, 60, 60)),
            (0.0, 4.4, 1.8, paint),
            (-0.25, 2.7, 1.6, (30, 35, 40)),
            (-0.35, 1.6, 1.4, paint),
        ):
            angle = np.radians(heading)
            middle = centre + ahead / GSD_M * fine * np.array([np.sin(angle), -np.cos(angle)])
            shape = (wide / GSD_M * fine, length / GSD_M * fine)
            corners = cv2.boxPoints((tuple(middle.tolist()), shape, heading))
            cv2.fillPoly(image, [np.round(corners).astype(np.int32)], colour)
    small = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA).astype(float)
    noisy = cv2.GaussianBlur(small, (0, 0), 0.6) + rng.normal(0, 2.5, small.shape)
    return np.clip(noisy, 0, 255).astype(np.uint8)


def cars(detector, rgb):
    found = detector.detect(rgb, np.ones(rgb.shape[:2], dtype=bool))
    return found.take((found.kind == "car") & (found.score >= detector.threshold))


def sorted_rows(found):
    rows = np.stack([found.x_px, found.y_px, found.heading_deg, found.score], axis=1)
    return rows[np.lexsort(np.round(rows[:, :2], 2).T)]


def angle_apart(a, b):
    turn = abs(a - b) % 180
    return min(turn, 180 - turn)


PLACES = [(12.0, 12.0, 0.0), (26.0, 14.0, 35.0), (38.0, 28.0, 90.0), (16.0, 36.0, 150.0)]


def test_the_weights_are_small_and_the_card_names_all_that_running_them_needs():
    assert len((FOLDER / WEIGHTS).read_bytes()) <= 2_500_000
    card = json.loads((FOLDER / CARD).read_text(encoding="utf-8"))
    assert card["gsd_m"] == GSD_M
    assert 0.1 < card["threshold"] < 0.9


def test_cars_are_found_within_half_a_metre_and_ten_degrees(network):
    found = cars(network, street(PLACES))
    assert len(found) == len(PLACES)
    for x, y, heading in PLACES:
        apart = np.hypot(found.x_px * GSD_M - x, found.y_px * GSD_M - y)
        nearest = int(np.argmin(apart))
        assert apart[nearest] < 0.5
        assert angle_apart(found.heading_deg[nearest], heading) < 10
        assert 3.4 < found.length_px[nearest] * GSD_M < 5.6
        assert 1.4 < found.width_px[nearest] * GSD_M < 2.4


def test_an_empty_street_holds_no_cars(network):
    assert len(cars(network, street([]))) == 0


def test_a_row_of_neighbours_is_counted_one_by_one(network):
    row = [(8.0 + 2.6 * i, 20.0, 0.0) for i in range(12)]
    assert len(cars(network, street(row))) == 12


def test_any_size_of_picture_is_taken(network):
    rgb = street(PLACES)[:251, :203]
    inside = sum(x < 40 for x, _, _ in PLACES)
    assert len(cars(network, rgb)) == inside
    assert len(cars(network, rgb[:1, :1])) == 0


def test_a_grey_picture_is_read_as_well(network):
    grey = np.repeat(street(PLACES).mean(axis=2, keepdims=True).astype(np.uint8), 3, axis=2)
    assert len(cars(network, grey)) == len(PLACES)


def test_nothing_is_reported_where_there_is_no_data(network):
    valid = np.ones((256, 256), dtype=bool)
    valid[:, 100:] = False
    found = network.detect(street(PLACES), valid)
    assert len(found) > 0
    assert (found.x_px < 100).all()


def test_windows_find_exactly_what_the_whole_picture_shows(network, tmp_path):
    rng = np.random.default_rng(3)
    places = [(6 + 7 * i, 6 + 7 * j, rng.uniform(0, 180)) for i in range(15) for j in range(16)]
    path = tmp_path / "street.png"
    cv2.imwrite(str(path), street(places, size=(590, 544))[..., ::-1])
    raster = open_raster(path, gsd_m=GSD_M)
    whole = extract_vehicles(raster, network).vehicles
    tiled = extract_vehicles(raster, network, core_px=160).vehicles
    assert len(whole) > 0.8 * len(places)
    assert len(tiled) == len(whole)
    np.testing.assert_allclose(tiled.x_m, whole.x_m, atol=1e-3)
    np.testing.assert_allclose(tiled.y_m, whole.y_m, atol=1e-3)
    np.testing.assert_allclose(tiled.score, whole.score, atol=1e-4)


def test_turning_a_picture_by_180_degrees_turns_what_the_thorough_detector_finds(thorough):
    rgb = street(PLACES)
    found = sorted_rows(cars(thorough, rgb))
    turned = cars(thorough, np.ascontiguousarray(rgb[::-1, ::-1]))
    back = np.stack([256 - turned.x_px, 256 - turned.y_px, turned.heading_deg, turned.score], 1)
    back = back[np.lexsort(np.round(back[:, :2], 2).T)]
    np.testing.assert_allclose(back[:, [0, 1, 3]], found[:, [0, 1, 3]], atol=1e-3)


def test_transposing_a_picture_transposes_what_the_thorough_detector_finds(thorough):
    rgb = street(PLACES)
    found = sorted_rows(cars(thorough, rgb))
    swapped = cars(thorough, np.ascontiguousarray(rgb.transpose(1, 0, 2)))
    back = np.stack(
        [swapped.y_px, swapped.x_px, np.mod(-90 - swapped.heading_deg, 180), swapped.score], axis=1
    )
    back = back[np.lexsort(np.round(back[:, :2], 2).T)]
    np.testing.assert_allclose(back[:, [0, 1, 3]], found[:, [0, 1, 3]], atol=1e-3)
    for ours, theirs in zip(back[:, 2], found[:, 2], strict=True):
        assert angle_apart(ours, theirs) < 0.01


def test_the_detector_travels_to_a_worker_with_its_network_loaded(network):
    rgb = street(PLACES)
    before = sorted_rows(cars(network, rgb))
    there = pickle.loads(pickle.dumps(network))
    np.testing.assert_array_equal(sorted_rows(cars(there, rgb)), before)


def test_both_runtimes_give_the_same_maps() -> None:
    """OpenCV is always there; onnxruntime is an extra, and only faster."""
    pytest.importorskip("onnxruntime")
    weights = NetworkDetector.shipped().weights
    picture = np.random.default_rng(1).standard_normal((1, 3, 96, 160)).astype(np.float32)
    one, other = runtime.load_network(weights)(picture), runtime.by_opencv(weights)(picture)
    np.testing.assert_allclose(one, other, atol=1e-4)
    assert one.shape == (1, 8, 24, 40)

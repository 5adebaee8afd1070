"""A user's YOLO-OBB model is read, run on real pixels and turned into headings and metres."""

import importlib.util
import pickle
from pathlib import Path

import numpy as np
import pytest

from covertool.errors import FileError
from covertool.extract.detectors.blocks import blocks
from covertool.extract.detectors.onnx_metadata import onnx_metadata
from covertool.extract.detectors.yolo_obb import YoloObbDetector

_spec = importlib.util.spec_from_file_location(
    "tiny_onnx", Path(__file__).with_name("tiny_onnx.py")
)
tiny_onnx = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(tiny_onnx)

NAMES = "{0: 'plane', 1: 'small vehicle', 2: 'large vehicle'}"
INPUT_PX = 256


def model(*columns, names=NAMES, imgsz=f"[{INPUT_PX}, {INPUT_PX}]"):
    candidates = np.array(columns, dtype=np.float32).T
    metadata = {"task": "obb", "names": names, "imgsz": imgsz}
    return tiny_onnx.yolo_like(candidates, metadata, INPUT_PX)


def detector(*columns, **kwargs):
    return YoloObbDetector(model(*columns, **kwargs), "own.onnx", 0.10)


def picture(height, width, red=255):
    rgb = np.zeros((height, width, 3), dtype=np.uint8)
    rgb[..., 0] = red
    return rgb, np.ones((height, width), dtype=bool)


def test_the_width_axis_at_angle_zero_heads_east():
    (found,) = [detector([100, 50, 44, 18, 0, 0.9, 0, 0.0]).detect(*picture(256, 256))]
    assert found.x_px.tolist() == [100]
    assert found.y_px.tolist() == [50]
    assert found.heading_deg.tolist() == pytest.approx([90])
    assert (found.length_px[0], found.width_px[0]) == (44, 18)
    assert found.kind.tolist() == ["car"]
    assert found.score[0] == pytest.approx(0.9, abs=1e-4)


def test_a_positive_angle_turns_clockwise():
    found = detector([100, 50, 44, 18, 0, 0.9, 0, np.radians(30)]).detect(*picture(256, 256))
    assert found.heading_deg.tolist() == pytest.approx([120], abs=1e-4)


def test_the_longer_side_is_the_length_whatever_it_is_called():
    found = detector([100, 50, 18, 44, 0, 0.9, 0, np.radians(30)]).detect(*picture(256, 256))
    assert found.heading_deg.tolist() == pytest.approx([30], abs=1e-4)
    assert (found.length_px[0], found.width_px[0]) == (44, 18)


def test_classes_that_are_no_vehicles_are_left_out_and_trucks_are_no_cars():
    found = detector(
        [100, 50, 44, 18, 0.9, 0.2, 0, 0],
        [100, 150, 90, 25, 0, 0.1, 0.7, 0],
    ).detect(*picture(256, 256))
    assert found.kind.tolist() == ["truck"]


def test_two_candidates_on_one_car_are_one_car():
    found = detector(
        [100, 50, 44, 18, 0, 0.6, 0, 0],
        [105, 52, 44, 18, 0, 0.9, 0, 0],
        [100, 75, 44, 18, 0, 0.5, 0, 0],
    ).detect(*picture(256, 256))
    assert found.y_px.tolist() == [52, 75]


def test_the_model_sees_the_picture_and_not_only_its_size():
    assert len(detector([100, 50, 44, 18, 0, 0.9, 0, 0]).detect(*picture(256, 256, red=0))) == 0


def test_every_block_finds_its_own_car_and_no_place_is_counted_twice():
    # The model sees one car in the middle of each block that it is shown.
    found = detector([128, 128, 44, 18, 0, 0.9, 0, 0]).detect(*picture(256, 512))
    assert sorted(found.x_px.tolist()) == [128, 256, 384]


@pytest.mark.parametrize("extent", [1, 100, 256, 257, 384, 385, 1000, 4097])
def test_blocks_own_every_pixel_once(extent):
    row = list(blocks(1, extent, 256, 64))
    owned = [x for block in row for x in range(*block.own_x)]
    assert owned == list(range(extent))
    for block in row:
        first, last = block.own_x
        assert first == 0 or first - block.x0 >= 64
        assert last == extent or block.x0 + 256 - last >= 64
        assert last <= block.x0 + 256


def test_places_without_data_hold_no_cars():
    rgb, valid = picture(256, 256)
    valid[:, :128] = False
    assert len(detector([100, 50, 44, 18, 0, 0.9, 0, 0]).detect(rgb, valid)) == 0


def test_metadata_is_read_behind_fields_of_any_kind():
    data = tiny_onnx.fixed_width_field() + model([1, 1, 1, 1, 0, 0.9, 0, 0])
    assert onnx_metadata(data, "own.onnx")["names"] == NAMES


def test_a_file_that_is_no_model_is_refused():
    with pytest.raises(FileError, match="not an ONNX model"):
        YoloObbDetector(b"\xff" * 40, "own.onnx", 0.10)


def test_a_model_cut_short_is_refused():
    whole = model([1, 1, 1, 1, 0, 0.9, 0, 0])
    with pytest.raises(FileError, match="not an ONNX model"):
        YoloObbDetector(whole[:-7], "own.onnx", 0.10)


def test_a_model_without_names_is_refused_and_told_how_to_export():
    with pytest.raises(FileError, match="yolo export"):
        detector([1, 1, 1, 1, 0, 0.9, 0, 0], names="")


def test_a_model_that_knows_no_vehicles_is_refused_with_its_classes():
    with pytest.raises(FileError, match="plane, ship"):
        detector([1, 1, 1, 1, 0, 0.9, 0], names="['plane', 'ship']")


def test_an_output_of_another_shape_is_refused():
    broken = detector([100, 50, 44, 18, 0.9, 0, 0], names=NAMES)  # one class fewer than named
    with pytest.raises(FileError, match="shape"):
        broken.detect(*picture(256, 256))


def test_a_detector_travels_to_a_worker_with_its_network_loaded():
    here = detector([100, 50, 44, 18, 0, 0.9, 0, 0])
    before = here.detect(*picture(256, 256))
    there = pickle.loads(pickle.dumps(here))
    assert there.detect(*picture(256, 256)).x_px.tolist() == before.x_px.tolist()

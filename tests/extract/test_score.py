import json

import numpy as np
import pytest
import shapely
from pyproj import CRS

from covertool.errors import FileError
from covertool.extract.score import Labels, score
from covertool.model import Vehicles

GSD = 0.125


def label(x_m, y_m, kind="point", **more):
    x, y = x_m / GSD, y_m / GSD
    ring = [[x, y]] * 4
    if kind == "obb":
        ring = shapely.get_coordinates(shapely.box(x - 8, y - 18, x + 8, y + 18)).tolist()
    return {
        "type": "Feature",
        "properties": {"kind": kind, "cx": x, "cy": y, **more},
        "geometry": {"type": "Polygon", "coordinates": [ring]},
    }


def labels(*features):
    return Labels.from_geojson(json.dumps({"features": features}).encode(), "labels")


def cars(*rows):
    """Return vehicles from (x_m, y_m, score, heading, parked)."""
    x, y, rank, heading, parked = (list(column) for column in zip(*rows, strict=True))
    size, nothing = np.ones(len(x)), np.full(len(x), None, dtype=object)
    flags = nothing.copy()
    flags[:] = parked
    x, y, rank, heading = (np.array(column, dtype=float) for column in (x, y, rank, heading))
    return Vehicles(
        nothing, x, -y, heading, 4 * size, 2 * size, rank, nothing, flags, nothing,
        x / GSD, y / GSD, CRS(2157),
    )  # fmt: skip


def judged(vehicles, known):
    return score(vehicles, known, (GSD, GSD), (800, 800))


def test_one_hit_one_miss_and_one_ghost():
    got = judged(
        cars((20, 20, 0.9, 0, None), (80, 80, 0.8, 0, None)), labels(label(20, 21), label(50, 50))
    )
    assert (got.true_positives, got.false_positives, got.false_negatives) == (1, 1, 1)
    assert (got.precision, got.recall, got.f1, got.count_error) == (0.5, 0.5, 0.5, 0.0)
    assert got.median_centre_error_m == pytest.approx(1.0)


def test_the_tolerance_is_a_metre_and_a_half():
    near = judged(cars((20, 21.49, 0.9, 0, None)), labels(label(20, 20)))
    far = judged(cars((20, 21.51, 0.9, 0, None)), labels(label(20, 20)))
    assert (near.true_positives, far.true_positives) == (1, 0)


def test_the_better_score_takes_the_label():
    got = judged(
        cars((20.0, 20.0, 0.4, 0, None), (20.5, 20.0, 0.9, 0, None)), labels(label(20, 20))
    )
    assert got.false_positives == 1
    assert got.median_centre_error_m == pytest.approx(0.5)


def test_ghosts_in_ignore_circles_and_at_the_border_count_neither_way():
    known = labels(label(20, 20), label(60, 60, "ignore", radius_px=16))
    got = judged(cars((62.4, 60, 0.9, 0, None), (0.7, 30, 0.9, 0, None)), known)
    assert (got.false_positives, got.false_negatives) == (0, 1)
    out = judged(cars((62.6, 60, 0.9, 0, None), (0.9, 30, 0.9, 0, None)), known)
    assert out.false_positives == 2


def test_angles_are_compared_round_the_half_turn_and_only_with_oriented_labels():
    known = labels(label(20, 20, "obb"), label(50, 50, "aabb"))
    got = judged(cars((20, 20, 0.9, 177.0, None), (50, 50, 0.9, 90.0, None)), known)
    assert got.median_angle_error_deg == pytest.approx(3.0)


def test_parked_shares_count_matched_cars_with_a_flag():
    known = labels(
        label(10, 10, parked=True),
        label(30, 30, parked=False),
        label(50, 50, parked=True),
        label(70, 70, parked=None),
    )
    got = judged(
        cars(
            (10, 10, 0.9, 0, True),
            (30, 30, 0.9, 0, True),
            (50, 50, 0.9, 0, False),
            (70, 70, 0.9, 0, True),
        ),
        known,
    )
    assert (got.parked_precision, got.parked_recall) == (0.5, 0.5)


def test_labels_that_are_none_are_refused():
    with pytest.raises(FileError, match="labels"):
        Labels.from_geojson(b'{"features": [{"properties": {}}]}', "x.geojson")

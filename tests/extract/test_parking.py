import geopandas as gpd
import numpy as np
import pytest
import shapely

from covertool.errors import GeometryError
from covertool.extract.bays import kerb_orientation, lot_bays
from covertool.extract.parking import JUNCTION_CLEARANCE_M, parked_anchors

NO_AREAS = gpd.GeoDataFrame({"tags": []}, geometry=[], crs="EPSG:2157")


def roads(*rows):
    lines = [shapely.LineString(points) for points, _ in rows]
    tags = [{"highway": "residential", "width": "6", **more} for _, more in rows]
    return gpd.GeoDataFrame({"tags": tags}, geometry=lines, crs="EPSG:2157")


def areas(*rows):
    return gpd.GeoDataFrame(
        {"tags": [{"amenity": "parking", **more} for _, more in rows]},
        geometry=[area for area, _ in rows],
        crs="EPSG:2157",
    )


STREET = [(0.0, 0.0), (120.0, 0.0)]


@pytest.mark.parametrize(
    ("tags", "left", "right"),
    [
        ({"parking:lane:both": "parallel"}, "parallel", "parallel"),
        ({"parking:lane:left": "perpendicular"}, "perpendicular", None),
        ({"parking:lane:right": "no_parking"}, None, None),
        ({"parking:lane:right": "marked"}, None, "parallel"),
        ({"parking:both": "no"}, None, None),
        ({"parking:left": "half_on_kerb"}, "parallel", None),
        ({"parking:right": "street_side", "parking:right:orientation": "diagonal"},
         None, "diagonal"),
        ({"parking:both": "lane", "parking:both:orientation": "perpendicular"},
         "perpendicular", "perpendicular"),
        ({"parking:right": "lane", "parking:right:restriction": "no_stopping"}, None, None),
        ({"parking:right": "no", "parking:lane:right": "parallel"}, None, None),
    ],
)  # fmt: skip
def test_both_tagging_schemas_are_read(tags, left, right):
    assert kerb_orientation(tags, "left") == left
    assert kerb_orientation(tags, "right") == right


@pytest.mark.parametrize(
    ("orientation", "count", "offset_m"), [("parallel", 20, 4.0), ("perpendicular", 50, 5.4)]
)
def test_a_full_kerb_holds_its_length_over_the_spacing(orientation, count, offset_m):
    cars = parked_anchors(
        roads((STREET, {"parking:lane:right": orientation})), NO_AREAS, occupancy=1.0
    )
    assert len(cars) == count
    np.testing.assert_allclose(cars.y_m, -offset_m, atol=1e-9)
    assert set(cars.origin) == {"parked"}


def test_left_is_left_of_the_ways_direction():
    cars = parked_anchors(roads((STREET[::-1], {"parking:left": "lane"})), NO_AREAS, occupancy=1.0)
    assert (cars.y_m < 0).all()


def test_no_car_stands_near_a_junction_or_on_a_crossing_road():
    cross = [(60.0, -50.0), (60.0, 50.0)]
    network = roads(
        ([*STREET[:1], (60.0, 0.0), *STREET[1:]], {"parking:both": "lane"}),
        ([*cross[:1], (60.0, 0.0), *cross[1:]], {}),
    )
    cars = parked_anchors(network, NO_AREAS, occupancy=1.0)
    nearest_end = np.abs(cars.x_m - 60.0) - 3.0
    assert nearest_end.min() > 3.0 + JUNCTION_CLEARANCE_M - 1.5
    assert len(cars) > 20


def test_a_lot_holds_rows_of_bays_and_its_capacity_caps_them():
    lot = shapely.box(0, 0, 24.0, 15.6)
    assert len(lot_bays(lot)) == 20
    network = roads(([(0, 100), (50, 100)], {}))
    full = parked_anchors(network, areas((lot, {})), occupancy=1.0)
    capped = parked_anchors(network, areas((lot, {"capacity": "7"})), occupancy=1.0)
    hidden = areas((lot, {"parking": "underground"}), (shapely.box(100, 0, 124, 16), {}))
    assert (len(full), len(capped)) == (20, 7)
    assert parked_anchors(network, hidden, occupancy=1.0).x_m.min() > 100


@pytest.mark.parametrize("angle", [0.0, 17.0, 90.0, 133.0])
def test_bays_lie_in_the_lot_and_apart_however_it_is_turned(angle):
    lot = shapely.affinity.rotate(shapely.box(0, 0, 40, 33), angle)
    bays = lot_bays(lot)
    assert len(bays) == 5 * 13  # five rows across the 40 m, 13 bays along the 33 m
    assert shapely.contains_xy(lot, bays[:, 0], bays[:, 1]).all()
    apart = np.hypot(*(bays[:, None] - bays[None]).transpose(2, 0, 1))
    assert apart[~np.eye(len(bays), dtype=bool)].min() == pytest.approx(2.4, abs=1e-6)


def test_occupancy_is_a_share_and_the_seed_decides_which():
    network = roads(([(0, 0), (6000, 0)], {"parking:both": "lane"}))
    first, again, other = (
        parked_anchors(network, NO_AREAS, occupancy=0.8, seed=seed) for seed in (1, 1, 2)
    )
    assert len(first) == pytest.approx(0.8 * 2000, abs=4 * np.sqrt(2000 * 0.8 * 0.2))
    np.testing.assert_array_equal(first.x_m, again.x_m)
    assert len(other) != len(first) or (other.x_m != first.x_m).any()


def test_an_extract_without_parking_is_refused():
    with pytest.raises(GeometryError, match="no place to park"):
        parked_anchors(roads((STREET, {})), NO_AREAS)

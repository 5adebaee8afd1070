import geopandas as gpd
import numpy as np
import pytest
import shapely
from rasterio.transform import Affine
from scenes import write_mask

from covertool.errors import GeometryError
from covertool.extract import masks
from covertool.extract.carriageways import RoadChoice, carriageway_width_m, is_transit
from covertool.extract.transit import seen_part, transit_from_mask, transit_from_roads


def ring_road(size=300, wobble=0.0):
    """Return a ring with spokes: curves, holes and slanted edges."""
    y, x = np.mgrid[:size, :size] - size / 2 + 0.5
    radius, angle = np.hypot(x, y), np.arctan2(y, x)
    ring = np.abs(radius - size / 3 - wobble * np.sin(9 * angle)) < 12
    spokes = np.abs(np.sin(1.5 * angle + 0.3)) * radius < 9
    return (ring | (spokes & (radius < size / 3))).astype(np.uint8)


@pytest.mark.parametrize(
    "affine",
    [
        Affine(0.5, 0, 600_000, 0, -0.5, 750_000),
        Affine(0.3, 0, 600_000, 0, 0.6, 750_000),
        Affine(0.5, 0, 600_000, 0, -0.5, 750_000) @ Affine.rotation(33),
    ],
    ids=["north up", "south up, anisotropic", "rotated"],
)
@pytest.mark.parametrize("wobble", [0.0, 8.0])
def test_area_is_within_half_a_percent_of_the_pixels(tmp_path, affine, wobble):
    on = ring_road(wobble=wobble)
    area = transit_from_mask(write_mask(tmp_path / "m.tif", on * 255, affine=affine))
    exact = on.sum() * abs(affine.determinant)
    assert area.area_m2 == pytest.approx(exact, rel=0.005)
    assert area.polygons.is_valid


def test_stair_steps_become_a_straight_line(tmp_path):
    y, x = np.mgrid[:200, :200]
    area = transit_from_mask(write_mask(tmp_path / "m.tif", (x * 0.37 > y).astype(np.uint8)))
    assert shapely.get_num_coordinates(area.polygons) < 12


def test_a_hole_stays_and_a_pinhole_and_a_speck_go(tmp_path):
    on = np.zeros((200, 200), np.uint8)
    on[20:180, 20:180] = 1
    on[80:110, 80:110] = 0
    on[150, 150] = 0
    on[5:7, 5:7] = 1
    area = transit_from_mask(write_mask(tmp_path / "m.tif", on))
    [polygon] = area.polygons.geoms
    assert len(polygon.interiors) == 1


def test_specks_stay_where_the_area_would_suffer(tmp_path):
    on = np.zeros((100, 100), np.uint8)
    on[::10, ::10] = 1
    area = transit_from_mask(write_mask(tmp_path / "m.tif", on))
    assert area.area_m2 == pytest.approx(100 * 0.25, rel=0.005)


def test_masks_of_one_of_255_in_colour_and_with_nodata_are_alike(tmp_path):
    on = ring_road()
    kinds = {
        "one": write_mask(tmp_path / "a.tif", on),
        "full": write_mask(tmp_path / "b.tif", on * 255),
        "colour": write_mask(tmp_path / "c.tif", np.stack([on * 255] * 3)),
        "nodata": write_mask(tmp_path / "d.tif", np.where(on, 255, 9).astype("uint8"), nodata=9),
    }
    areas = {name: transit_from_mask(mask).area_m2 for name, mask in kinds.items()}
    assert len({round(area, 6) for area in areas.values()}) == 1


def test_blocks_leave_no_seam(tmp_path, monkeypatch):
    mask = write_mask(tmp_path / "m.tif", ring_road())
    whole = transit_from_mask(mask)
    monkeypatch.setattr(masks, "_BLOCK_PX", 37)
    cut = transit_from_mask(mask)
    assert shapely.symmetric_difference(whole.polygons, cut.polygons).area < 1e-6


@pytest.mark.parametrize("empty", [True, False])
def test_an_empty_mask_and_a_photograph_are_refused(tmp_path, empty):
    noise = np.random.default_rng(0).integers(0, 255, (60, 60)).astype(np.uint8)
    with pytest.raises(GeometryError, match="mask"):
        transit_from_mask(write_mask(tmp_path / "m.tif", noise * (not empty)))


def test_a_mask_without_georeference_needs_the_images_pixels(tmp_path):
    image = write_mask(tmp_path / "i.tif", ring_road(300))
    mask = write_mask(tmp_path / "m.tif", ring_road(200))
    with pytest.raises(GeometryError, match="200 x 200"):
        transit_from_mask(mask, like=image)


def test_only_the_part_that_the_images_show_is_kept(tmp_path):
    mask = transit_from_mask(write_mask(tmp_path / "m.tif", np.ones((100, 100), np.uint8)))
    image = write_mask(
        tmp_path / "i.tif", np.ones((50, 100), np.uint8), affine=Affine(0.5, 0, 25, 0, -0.5, 0)
    )
    assert seen_part(mask, [image]).area_m2 == pytest.approx(25 * 25, rel=0.005)


def roads(*rows):
    lines = [shapely.LineString(points) for points, _ in rows]
    tags = [{"highway": "residential", **more} for _, more in rows]
    return gpd.GeoDataFrame({"tags": tags}, geometry=lines, crs="EPSG:2157")


def test_a_straight_road_is_its_length_times_its_width():
    area = transit_from_roads(roads(([(0, 0), (100, 0)], {"width": "6"})))
    assert area.area_m2 == pytest.approx(600, abs=1e-6)
    assert area.polygons.bounds == pytest.approx((0, -3, 100, 3))


def test_roads_that_meet_at_an_angle_leave_no_wedge():
    bent = transit_from_roads(
        roads(([(0, 0), (50, 0)], {"width": "6"}), ([(50, 0), (50, 50)], {"width": "6"}))
    )
    [polygon] = bent.polygons.geoms
    assert polygon.contains(shapely.Point(52, -2).buffer(0.05))
    assert bent.area_m2 == pytest.approx(2 * 50 * 6 - 9 + np.pi * 9 / 4, abs=0.1)


def test_a_wide_road_that_goes_on_narrow_does_not_swell_it():
    area = transit_from_roads(
        roads(([(0, 0), (50, 0)], {"width": "12"}), ([(50, 0), (100, 0)], {"width": "4"}))
    )
    assert area.area_m2 == pytest.approx(50 * 12 + 50 * 4, abs=1e-6)


@pytest.mark.parametrize(
    ("tags", "width_m"),
    [
        ({"width": "5.5"}, 5.5),
        ({"width": "5,5 m"}, 5.5),
        ({"width": "18'"}, 18 * 0.3048),
        ({"width": "16'6\""}, 16.5 * 0.3048),
        ({"width": "20 ft"}, 20 * 0.3048),
        ({"width": "wide", "lanes": "2"}, 5.5),
        ({"width": "900"}, 5.5),
        ({"lanes": "1"}, 2.75),
        ({"oneway": "yes"}, 2.75),
        ({"highway": "motorway"}, 7.5),
        ({"highway": "primary_link"}, 3.5),
        ({}, 5.5),
    ],
)
def test_widths_are_read_or_taken_from_lanes_and_class(tags, width_m):
    assert carriageway_width_m({"highway": "residential", **tags}) == pytest.approx(width_m)


@pytest.mark.parametrize(
    ("tags", "choice", "counts"),
    [
        ({}, RoadChoice(), True),
        ({"bridge": "yes", "layer": "1"}, RoadChoice(), True),
        ({"tunnel": "yes"}, RoadChoice(), False),
        ({"tunnel": "yes"}, RoadChoice(tunnels=True), True),
        ({"access": "private"}, RoadChoice(), False),
        ({"access": "private"}, RoadChoice(private=True), True),
        ({"access": "no", "motor_vehicle": "yes"}, RoadChoice(), True),
        ({"highway": "service", "service": "driveway"}, RoadChoice(), False),
        ({"highway": "service", "service": "driveway"}, RoadChoice(yards=True), True),
        ({"highway": "footway"}, RoadChoice(), False),
        ({"highway": "cycleway"}, RoadChoice(), False),
        ({"highway": "construction"}, RoadChoice(), False),
    ],
)
def test_what_counts_as_a_carriageway(tags, choice, counts):
    assert is_transit({"highway": "residential", **tags}, choice) is counts

"""What cars meet on their way, layouts of parked cars, and the experiment as a whole."""

import dataclasses
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import shapely
from pyproj import CRS

from covertool.errors import CrsError, GeometryError, OptionError
from covertool.model import Anchors, Trace
from covertool.traffic.encounters import anchors_on_way, encounters
from covertool.traffic.layouts import parked_layouts
from covertool.traffic.mobility import Mobility, recorded
from covertool.traffic.simulation import require_reach, simulate
from covertool.traffic.trajectories import trajectories

DATA = Path(__file__).parents[2] / "data"
IRELAND = CRS("EPSG:2157")


@pytest.fixture(scope="module")
def town():
    """The first 40 s of 25 cars of the shipped trace, and the parked cars along their ways."""
    from covertool.gis.read import read_anchors

    whole = recorded(DATA / "trace.parquet", crs=IRELAND, horizon_s=40)
    names = np.unique(whole.trace.vehicle.astype(str))[:25]
    trace = whole.trace.take(np.isin(whole.trace.vehicle.astype(str), names))
    anchors = read_anchors(f"{DATA / 'sample.gpkg'}:anchors", dst_crs=IRELAND)
    mobility = dataclasses.replace(whole, trace=trace)
    return mobility, anchors_on_way(anchors, trace, 15.0)


def line_of(cars=1, steps=3, speed=10.0):
    time = np.repeat(np.arange(steps, dtype=float), cars)
    name = np.tile(np.array([f"c{i}" for i in range(cars)], dtype=object), steps)
    lane, still = np.tile(100.0 * np.arange(cars), steps), np.zeros(time.size)
    return Trace(time, name, speed * time, lane, still + speed, still)


def test_encounters_are_those_of_a_plain_loop(town):
    mobility, anchors = town
    trace = mobility.trace
    met = encounters(trace, anchors, 15.0)
    for row in (0, len(met) // 2, len(met) - 1):
        mine = np.flatnonzero(trace.vehicle.astype(str) == met.vehicle[row])
        mine = mine[np.argsort(trace.time_s[mine])]
        heard = set()
        for x, y in zip(trace.x_m[mine], trace.y_m[mine], strict=True):
            heard |= set(np.flatnonzero(np.hypot(anchors.x_m - x, anchors.y_m - y) <= 15.0))
        steps = np.hypot(np.diff(trace.x_m[mine]), np.diff(trace.y_m[mine]))
        assert met.met[row] == len(heard)
        assert met.path_km[row] == pytest.approx(steps.sum() / 1000)


def test_the_longest_cars_come_first_and_ties_by_id():
    trace = line_of(cars=3)
    assert encounters(trace, Anchors.from_points([], [], IRELAND), 5.0).longest(2) == ("c0", "c1")


def test_anchors_between_two_steps_are_on_the_way():
    beside = Anchors.from_points([5.0, 5.0, 25.0], [4.0, 6.0, 0.0], IRELAND)
    assert anchors_on_way(beside, line_of(), 5.0).id.tolist() == ["1", "3"]


STRAIGHT = SimpleNamespace(edges={"a": SimpleNamespace(shape=np.array([[0.0, 0.0], [100.0, 0.0]]))})
"""A network of one straight street of 100 m, as far as layouts look at it."""


def test_a_layout_keeps_number_side_and_kerb_and_shifts_all_by_one_way():
    anchors = Anchors.from_points([10.0, 30.0, 80.0], [3.0, -3.0, 4.0], IRELAND)
    for layout in parked_layouts(anchors, 3, network=STRAIGHT, seed=7):
        assert layout.y_m == pytest.approx(anchors.y_m)
        shift = np.mod(layout.x_m - anchors.x_m, 100.0)
        assert shift == pytest.approx(np.full(3, shift[0]))
        assert ((layout.x_m >= 0) & (layout.x_m <= 100)).all()


def test_one_layout_with_all_cars_is_the_study_itself(town):
    anchors = town[1]
    (only,) = parked_layouts(anchors, 1)
    assert only.id.tolist() == anchors.id.tolist()


def test_penetration_keeps_a_share_of_the_cars_by_chance():
    anchors = Anchors.from_points(np.arange(4000.0), np.zeros(4000), IRELAND)
    one, two = parked_layouts(anchors, 2, share=0.25, seed=3)
    for layout in (one, two):  # 4 standard deviations
        assert abs(len(layout) - 1000) < 4 * np.sqrt(4000 * 0.25 * 0.75)
    assert one.id.tolist() != two.id.tolist()


def test_layouts_that_would_all_be_the_same_are_refused(town):
    with pytest.raises(OptionError, match="all layouts would be the same"):
        parked_layouts(town[1], 3)


def test_parked_cars_ten_kilometres_away_take_off_nothing(town):
    mobility, anchors = town
    far = dataclasses.replace(anchors, x_m=anchors.x_m + 10_000.0)
    found = simulate(mobility, far, runs=2, sigmas_m=(0.2,), bound=False)
    assert found.report.improvements
    for each in found.report.improvements:
        assert (each.percent, each.ci95) == (0.0, (0.0, 0.0))
    with pytest.raises(GeometryError, match="no anchor is within 15 m") as fault:
        require_reach([mobility], far, 15.0)
    assert fault.value.where.count(" to ") == 4  # both boxes


def test_parked_cars_on_the_way_help(town):
    mobility, anchors = town
    found = simulate(mobility, anchors, estimators=("ekf",), runs=4, sigmas_m=(0.2,), bound=False)
    every = [each for each in found.report.improvements if each.vehicle == "all"]
    assert every[0].percent > 5
    assert every[0].ci95[0] > 0


def test_the_reported_cars_are_the_five_longest_and_their_density_is_of_what_they_met(town):
    mobility, anchors = town
    found = simulate(
        mobility, anchors, estimators=("ekf", "gcpso"), runs=2, sigmas_m=(0.2, 4.0), bound=False
    )
    met = encounters(mobility.trace, anchors, 15.0)
    assert found.vehicles == met.longest(5)
    for density in found.densities():
        four = [e.percent for e in found.report.improvements if e.vehicle == density.vehicle]
        assert len(four) == 4
        assert density.percent[0] == pytest.approx(np.mean(four))
        assert density.met == (met.met[met.row(density.vehicle)],)


def test_two_workers_give_the_same_report(town):
    mobility, anchors = town
    given = {"estimators": ("gcpso",), "runs": 24, "sigmas_m": (4.0,), "bound": False}
    one, two = (simulate(mobility, anchors, workers=n, **given) for n in (1, 2))
    assert one.report == two.report
    assert [e.percent for e in one.report.layouts] == [e.percent for e in two.report.layouts]


def test_traffic_and_parked_cars_in_two_crs_are_refused(town):
    mobility, anchors = town
    with pytest.raises(CrsError, match="EPSG:32629"):
        simulate(mobility, dataclasses.replace(anchors, crs=CRS("EPSG:32629")))


def test_trajectories_are_the_ways_and_their_columns_agree_with_the_report(town):
    mobility, anchors = town
    found = simulate(mobility, anchors, estimators=("ekf",), runs=2, sigmas_m=(0.2,), bound=False)
    lines = trajectories(mobility.trace, mobility.crs, found.met[0], found.report.cars)
    assert lines.geometry.length.to_numpy() == pytest.approx(1000 * lines["path_km"].to_numpy())
    for name in found.vehicles:
        row = lines.set_index("vehicle").loc[name]
        named = [r for r in found.report.results if r.vehicle == name and r.estimator == "ekf"]
        by_arm = {result.arm: result.mean_error_m for result in named}
        assert row["mean_error_m"] == pytest.approx(by_arm["proposed"])
        assert row["traditional_m"] == pytest.approx(by_arm["traditional"])


def test_a_car_seen_once_is_still_a_trajectory():
    trace = line_of(steps=1)
    met = encounters(trace, Anchors.from_points([0.0], [0.0], IRELAND), 5.0)
    lines = trajectories(trace, IRELAND, met, [])
    assert (lines.geometry.length.tolist(), lines["met"].tolist()) == ([0.0], [1])
    assert np.isnan(lines["met_per_km"].iloc[0])
    assert not shapely.is_empty(lines.geometry.iloc[0])


def test_several_traffic_seeds_are_several_scenarios(town):
    mobility, anchors = town
    other = dataclasses.replace(mobility, facts={"seed": 2})
    found = simulate(
        [mobility, other], anchors, estimators=("ekf",), runs=2, sigmas_m=(0.2,), bound=False
    )
    assert found.report.scenarios == 2
    assert {each.traffic_seed for each in found.report.layouts} == {0, 2}
    assert isinstance(found.mobilities[0], Mobility)

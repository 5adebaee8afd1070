"""The experiment as a whole: arms, priorities, halted cars, divergence, and its statistics."""

import dataclasses
import math

import numpy as np
import pytest

from covertool.errors import GeometryError, OptionError
from covertool.model import Trace
from covertool.positioning.cases import Case, Scenario, Work
from covertool.positioning.ekf import Ekf
from covertool.positioning.estimators import State
from covertool.positioning.experiment import position_errors
from covertool.positioning.hearing import Hearing, steps_of
from covertool.positioning.options import PositioningOptions, rssi_growth
from covertool.positioning.second_order import SecondOrder
from covertool.positioning.smoothing import smoothed
from covertool.positioning.statistics import BINS, Sums, improvement, quantile_m, statistics_of

from .circuit import circuit
from .scenes import filtering, nowhere, straight

SMALL = {"runs": 4, "radii_m": (15.0,), "sigmas_m": (0.2,), "bound": False}


def small_town(**change):
    trace, anchors = circuit(cars=6, steps=40, **change)
    return Scenario(trace, anchors)


def rows(report):
    return {(r.arm, r.estimator, r.vehicle): r for r in report.results}


def walk(trace, anchors=(), **options):
    places = np.reshape(np.asarray(anchors, float), (-1, 2))
    given = PositioningOptions(**options)
    return list(Hearing(steps_of(trace), places, 15.0, given))


def halting_trace(moving=3, still=12):
    """One car drives east at 5 m/s, stands, and drives on."""
    speed = np.concatenate([np.full(moving, 5.0), np.zeros(still), np.full(3, 5.0)])
    n = speed.size
    name, zero = np.full(n, "a", dtype=object), np.zeros(n)
    return Trace(np.arange(n, dtype=float), name, np.cumsum(speed), zero, speed, zero)


def test_without_parked_cars_both_arms_are_the_same_to_the_bit():
    scenario = Scenario(small_town().trace, nowhere())
    report = position_errors([scenario], **SMALL)
    for estimator in ("gcpso", "ekf"):
        one, other = (
            dataclasses.replace(rows(report)[arm, estimator, "all"], arm="")
            for arm in ("traditional", "proposed")
        )
        assert one == other
    assert [i.percent for i in report.improvements] == [0.0, 0.0]


@pytest.mark.slow
def test_two_workers_give_the_same_bits_as_one():
    options = {"runs": 24, "estimators": ("gcpso", "ekf", "second_order"), "sigmas_m": (0.2,)}
    scenario = small_town()
    assert position_errors([scenario], **options) == position_errors(
        [scenario], workers=2, **options
    )


@pytest.mark.parametrize("estimator", ["ekf", "second_order"])
def test_runs_do_not_depend_on_the_block_they_are_computed_in(estimator):
    case = Case("proposed", estimator, 0.2, 15.0)
    work = Work([small_town()], PositioningOptions(), 1)
    piece = work.blocks(0, case, 6)[0]
    whole = work(piece)
    parts = [work(piece._replace(first_run=first, runs=2)) for first in (0, 2, 4)]
    assert (np.concatenate([part.error_m for part in parts]) == whole.error_m).all()


def test_seeds_change_the_noise_and_nothing_else():
    one, two = (position_errors([small_town()], seed=seed, **SMALL) for seed in (1, 2))
    same = position_errors([small_town()], seed=1, **SMALL)
    assert one == same
    assert rows(one)["gps", None, "all"].mean_error_m != rows(two)["gps", None, "all"].mean_error_m
    assert [r.samples for r in one.results] == [r.samples for r in two.results]


def test_parked_cars_help_and_second_order_is_better_than_gps_and_odometry():
    report = position_errors([small_town()], estimators=("ekf", "second_order"), **SMALL)
    found = rows(report)
    assert all(i.percent > 0 for i in report.improvements)
    best = found["proposed", "second_order", "all"].rmse_m
    assert best < found["gps_odometry", None, "all"].rmse_m < found["gps", None, "all"].rmse_m


def test_the_report_gives_the_bound_the_battery_and_the_cars_that_were_asked_for():
    report = position_errors([small_town()], **(SMALL | {"bound": True}), vehicles=["car002"])
    assert (report.battery_hours, report.mean_stay_h) == (48.0, 6.64)
    assert {r.vehicle for r in report.results} == {"all", "car002"}
    assert all(r.bound_rmse_m > 0 for r in report.results)
    assert all(r.rmse_over_bound > 0.8 for r in report.results)
    assert rows(report)["gps", None, "all"].bound_rmse_m == pytest.approx(
        6 * math.sqrt(2), rel=1e-3
    )
    assert len(report.to_frame()) == len(report.results)


@pytest.mark.slow
@pytest.mark.parametrize(("sigma_m", "most"), [(4.0, 1.10), (0.2, 1.40)])
@pytest.mark.parametrize("radius_m", [15.0, 100.0])
def test_second_order_is_near_the_bound_and_honest(sigma_m, most, radius_m):
    trace, anchors = circuit()
    report = position_errors(
        [Scenario(trace, anchors)],
        estimators=("second_order",),
        arms=("traditional", "proposed"),
        sigmas_m=(sigma_m,),
        radii_m=(radius_m,),
        runs=10,
    )
    for result in report.results:
        assert result.rmse_over_bound <= most
        assert 0.8 <= result.nees / 2 <= 1.5


def test_a_filter_that_trusts_its_neighbours_fixes_blindly_is_reported_as_diverged():
    options = PositioningOptions(divergence_m=30.0, literal_r=True)
    near = SMALL | {"radii_m": (100.0,)}
    report = position_errors([small_town()], estimators=("ekf",), options=options, **near)
    worst = rows(report)["traditional", "ekf", "all"]
    assert worst.diverged > 0
    assert worst.mean_error_m is worst.sd_error_m is worst.rmse_m is worst.p95_error_m is None
    assert report.improvements[0].percent is None


class Lost:
    name, uses_gps, gives_covariance = "lost", True, False

    def start(self, gps, variance_m2):
        return State(np.full_like(gps, np.nan), np.ones((len(gps), 3)))

    def predict(self, state, velocity, step_s):
        return state

    def update(self, predicted, heard):
        return predicted


def test_an_estimate_that_is_not_a_number_is_a_divergence():
    sums = filtering(straight(), Lost(), radius_m=15.0, runs=3).run()
    assert sums.diverged.tolist() == [[1], [1], [1]]
    assert statistics_of([sums]).mean_error_m is None


def test_an_estimator_of_ones_own_takes_part(tmp_path, monkeypatch):
    (tmp_path / "mine.py").write_text(
        "from covertool.positioning.ekf import Ekf\n\n\nclass Mine(Ekf):\n    name = 'mine'\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    found = rows(position_errors([small_town()], estimators=("ekf", "mine:Mine"), **SMALL))
    mine = found["proposed", "mine:Mine", "all"]
    assert dataclasses.replace(mine, estimator="ekf") == found["proposed", "ekf", "all"]


def test_sequential_updates_change_nothing_while_gps_fixes_are_shared():
    scenario = small_town()
    one = position_errors([scenario], **SMALL)
    other = position_errors([scenario], options=PositioningOptions(sequential=True), **SMALL)
    for a, b in zip(one.results, other.results, strict=True):
        assert a.mean_error_m == pytest.approx(b.mean_error_m, rel=1e-12)


@pytest.mark.parametrize(
    "option",
    [
        {"sharing": "prediction", "sequential": True},
        {"sharing": "truth"},
        {"choice": "measured"},
        {"choice": "gdop"},
        {"choice": "all"},
        {"pseudo_anchor": "covariance"},
        {"gps_tau_s": 30.0},
        {"gps_noise": "radial"},
        {"gps_reset_s": None},
        {"halted": False},
        {"literal_cost": True},
        {"range_growth": rssi_growth()},
        {"nlos_share": 0.3, "nlos_mean_m": 5.0},
        {"velocity": "current"},
    ],
    ids=str,
)
def test_every_option_changes_the_result(option):
    trace, anchors = circuit(cars=6, steps=60, halting=True)
    scenario = Scenario(trace, anchors)
    radius = {"radii_m": (200.0,), "runs": 2}
    plain = position_errors([scenario], **(SMALL | radius))
    changed = position_errors([scenario], options=PositioningOptions(**option), **(SMALL | radius))
    assert any(
        a.mean_error_m != b.mean_error_m
        for a, b in zip(plain.results, changed.results, strict=True)
    )


def test_looking_back_halves_the_variance_of_gps_and_odometry():
    """Far from the ends both directions know as much: ``P_s = P P- / (P + P-)``."""
    steps, q, r = 121, 0.25, 36.0
    trace = straight(cars=2, steps=steps)
    run = filtering(trace, SecondOrder(2), runs=500, velocity="current", smoothing=True)
    states = list(smoothed(list(run.passed()), 500, 2))
    step, state = states[steps // 2].step, states[steps // 2].known
    ahead = q / 2 + math.sqrt(q * q / 4 + q * r)
    known = ahead - q
    expected = 1 / (1 / known + 1 / ahead)
    assert state.covariance[:, 0] == pytest.approx(expected, rel=1e-4)
    error = state.position - np.tile(step.position, (500, 1))
    assert (error**2).mean() == pytest.approx(expected, rel=4 * math.sqrt(2 / 2000))


def test_smoothing_is_better_than_filtering_and_has_no_filters_bound():
    small = SMALL | {"estimators": ("second_order",), "bound": True}
    plain = rows(position_errors([small_town()], **small))["proposed", "second_order", "all"]
    options = PositioningOptions(smoothing=True)
    back = rows(position_errors([small_town()], options=options, **small))
    assert back["proposed", "second_order", "all"].rmse_m < plain.rmse_m
    assert back["proposed", "second_order", "all"].bound_rmse_m is None


def test_a_pseudo_anchor_one_step_later_comes_before_a_nearer_blind_car():
    three = [[-9.0, 3.0], [-10.0, -3.0], [-8.0, 0.0]]
    time = np.repeat(np.arange(2.0), 3)
    name = np.tile(np.array(["a", "b", "c"], dtype=object), 2)
    x, zero = np.tile([0.0, 14.0, 12.0], 2), np.zeros(6)  # a hears the anchors, b only a and c
    found = walk(Trace(time, name, x, zero, zero + 5.0, zero), three)
    assert [step.selection.neighbour[1, :2].tolist() for step in found] == [[2, 0], [0, 2]]


def test_a_halted_car_counts_as_an_anchor_after_its_dwell_and_until_it_moves():
    trace = halting_trace()
    three = [[15.0, 5.0], [18.0, -5.0], [12.0, -4.0]]
    found = walk(trace, three)
    assert [s.halted[0] for s in found] == [0] * 8 + [1, 2, 3, 4, 5, 6, 7] + [0] * 3
    assert [bool(s.fixed[0]) for s in found] == [False] * 9 + [True] * 6 + [False] * 3
    assert not any(s.fixed[0] for s in walk(trace, three[:2]))
    assert not any(s.halted[0] for s in walk(trace, three, halted=False))


def test_a_halted_car_with_two_anchors_ranges_and_with_one_averages_gps():
    trace, place = halting_trace(still=60), 15.0
    two = [[place + 6.0, 5.0], [place - 5.0, 6.0]]

    def variance(anchors):
        run = filtering(trace, Ekf(), anchors=anchors, radius_m=14.0, sigma_m=0.5, runs=40)
        states = [state for _, state in run.states()]
        return states[-5].covariance[0], np.array([s.position[:, 0].std() for s in states])[-5]

    ranging, _ = variance(two)
    averaging, spread = variance(two[:1])
    assert ranging[0] < 0.1
    assert averaging[0] < 36 / 40
    assert spread == pytest.approx(math.sqrt(averaging[0]), rel=0.35)


def test_growing_range_noise_and_blocked_ranges_have_their_stated_moments():
    def ranges(**model):
        run = filtering(
            straight(cars=1, steps=1),
            Recorder(),
            anchors=[[8.0, 0.0]],
            radius_m=15.0,
            runs=20_000,
            sigma_m=0.3,
            **model,
        )
        list(run.states())
        return Recorder.seen

    growing = ranges(range_growth=rssi_growth(4, 2))
    assert growing.mean() == pytest.approx(8.0, abs=0.1)
    assert growing.std() == pytest.approx(math.hypot(0.3, 0.4605 * 8), rel=0.02)
    blocked = ranges(nlos_share=0.4, nlos_mean_m=5.0)
    assert blocked.mean() == pytest.approx(8.0 + 0.4 * 5.0, abs=0.12)
    extra = 2 * 0.4 * 25 - (0.4 * 5) ** 2
    assert blocked.std() == pytest.approx(math.sqrt(0.09 + extra), rel=0.05)


class Recorder(Ekf):
    seen = None

    def update(self, predicted, heard):
        Recorder.seen = heard.range_m[:, 0].copy()
        return super().update(predicted, heard)


def test_correlated_gps_errors_have_the_stated_deviation_and_correlation():
    from covertool.positioning.linear import GpsOnly

    run = filtering(straight(cars=200, steps=40), GpsOnly(), runs=10, gps_tau_s=20.0)
    error = np.array([s.position - np.tile(t.position, (10, 1)) for t, s in run.states()])
    assert error.std() == pytest.approx(6.0, rel=0.03)
    lagged = (error[:-5] * error[5:]).mean() / error.var()
    assert lagged == pytest.approx(math.exp(-5 / 20), abs=0.03)


def test_quantiles_of_the_histogram_agree_with_numpy():
    errors = np.abs(np.random.default_rng(0).normal(0, 5, 20_000))
    sums = Sums.zero(1, 1)
    zero = np.zeros((1, 2))
    for error in errors:
        sums.add(np.array([0]), zero, np.array([[error, 0.0]]), np.zeros((1, 3)), 1e4)
    found = statistics_of([sums])
    assert sums.bins.shape == (1, BINS)
    assert found.mean_error_m == pytest.approx(errors.mean())
    assert found.sd_error_m == pytest.approx(errors.std())
    assert found.rmse_m == pytest.approx(math.sqrt((errors**2).mean()))
    assert quantile_m(sums.bins[0], 0.5) == pytest.approx(np.median(errors), rel=5e-3)
    assert found.p95_error_m == pytest.approx(np.quantile(errors, 0.95), rel=5e-3)


def _sums(errors):
    sums = Sums.zero(len(errors), 1)
    sums.error_m[:, 0], sums.count[:] = errors, 1
    return sums


def test_improvement_is_one_minus_the_ratio_of_means_and_its_interval_is_nested():
    same = [[_sums([4.0, 4.0])], [_sums([4.0, 4.0])]]
    half = [[_sums([2.0, 2.0])], [_sums([2.0, 2.0])]]
    assert improvement(same, half) == (50.0, (50.0, 50.0))
    differ = [[_sums([1.0, 1.0])], [_sums([3.0, 3.0])]]
    percent, (low, high) = improvement(same, differ)
    assert percent == 50.0
    assert (low, high) == (25.0, 75.0)  # only the layouts differ, and there are two
    one_layout = [[_sums([4.0, 4.0]), _sums([4.0, 4.0])]]
    assert improvement(one_layout, [[_sums([1.0, 3.0]), _sums([2.0, 2.0])]])[0] == 50.0


def test_one_run_has_no_interval():
    assert improvement([[_sums([4.0])]], [[_sums([3.0])]]) == (25.0, None)


def test_layouts_and_traffic_seeds_are_pooled():
    towns = [
        dataclasses.replace(small_town(seed=seed), layout=seed // 2, traffic_seed=seed % 2)
        for seed in range(4)
    ]
    report = position_errors(towns, estimators=("ekf",), **SMALL)
    assert report.scenarios == 4
    assert rows(report)["gps", None, "all"].samples == 4 * 4 * 6 * 40
    low, high = report.improvements[0].ci95
    assert low < report.improvements[0].percent < high


def test_an_anchor_that_does_not_know_its_place_misleads():
    scenario = small_town()
    vague = dataclasses.replace(scenario.anchors, sigma_m=np.full(len(scenario.anchors), 8.0))
    sharp = rows(position_errors([scenario], estimators=("ekf",), **SMALL))
    wrong = rows(position_errors([Scenario(scenario.trace, vague)], estimators=("ekf",), **SMALL))
    key = ("proposed", "ekf", "all")
    assert wrong[key].mean_error_m > sharp[key].mean_error_m


@pytest.mark.parametrize(
    "change",
    [
        {"arms": ("both",)},
        {"estimators": ("kalman",)},
        {"sigmas_m": (-1.0,)},
        {"radii_m": (math.nan,)},
        {"runs": 0},
        {"seed": -1},
        {"vehicles": ("nobody",)},
    ],
    ids=str,
)
def test_options_out_of_range_are_refused(change):
    with pytest.raises(OptionError):
        position_errors([small_town()], **(SMALL | change))


def test_a_broken_trace_is_refused():
    good = straight(steps=3)
    twice = dataclasses.replace(good, time_s=np.zeros(3))
    gap = dataclasses.replace(good, x_m=np.array([0.0, np.nan, 1.0]))
    for trace in (twice, gap, good.take(np.zeros(3, bool))):
        with pytest.raises(GeometryError):
            steps_of(trace)
    with pytest.raises(OptionError):
        position_errors([])
    with pytest.raises(OptionError):
        PositioningOptions(sigma_gps_m=-1.0)

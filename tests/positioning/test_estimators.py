"""Estimators against closed forms, plain references and other people's libraries."""

import math

import numpy as np
import pytest
from scipy import stats
from scipy.optimize import least_squares

from covertool.errors import OptionError
from covertool.positioning.ekf import Ekf
from covertool.positioning.estimators import Measurements, State, isotropic, load_estimator
from covertool.positioning.gcpso import LANES, Gcpso, Swarm, _draw
from covertool.positioning.linear import GpsOdometry, GpsOnly
from covertool.positioning.second_order import SecondOrder

from .reference import plain_cost, plain_ekf, plain_gcpso
from .scenes import filtering, straight


def heard_by(truth, anchors, sigma_m, *, rng, shared=None):
    """Ranges of every row to its own anchors (rows, most, 2)."""
    rows, most = anchors.shape[:2]
    d = np.linalg.norm(truth[:, None] - anchors, axis=2) + sigma_m * rng.normal(size=(rows, most))
    return Measurements(
        step_s=1.0,
        key=(1, 0),
        first_run=0,
        runs=1,
        time=3,
        car=np.arange(rows),
        velocity=np.zeros((rows, 2)),
        gps=truth,
        gps_variance_m2=36.0,
        count=np.full(rows, most),
        neighbour=np.zeros((rows, most), np.int64),
        range_m=d,
        range_variance_m2=np.full((rows, most), sigma_m**2),
        x=anchors[:, :, 0].copy(),
        y=anchors[:, :, 1].copy(),
        shared=np.zeros((rows, most, 3)) if shared is None else shared,
    )


def scene(rows=50, most=3, seed=0, sigma_m=0.2, spread_m=4.0):
    rng = np.random.default_rng(seed)
    truth = rng.uniform(0, 500, (rows, 2))
    heard = heard_by(
        truth, truth[:, None] + rng.uniform(-80, 80, (rows, most, 2)), sigma_m, rng=rng
    )
    return truth, State(truth + spread_m * rng.normal(size=(rows, 2)), isotropic(rows, 16.0)), heard


def errors_of(run):
    """Absolute errors (steps, rows) and the last state."""
    errors = []
    for step, state in run.states():
        truth = np.tile(step.position, (len(state.position) // len(step.car), 1))
        errors.append(state.position - truth)
    return np.array(errors), state


TRIANGLE = [[0.0, 40.0], [60.0, -30.0], [120.0, 45.0]]


@pytest.mark.parametrize(("estimator", "limit_m"), [(Ekf(), 1e-6), (Gcpso(), 5e-3)])
def test_without_noise_three_anchors_give_the_place(estimator, limit_m):
    run = filtering(
        straight(steps=25),
        estimator,
        anchors=TRIANGLE,
        radius_m=500.0,
        sigma_m=0.0,
        runs=20,
        sigma_velocity=0.0,
    )
    errors, _ = errors_of(run)
    assert np.hypot(*errors[0].T).max() < 6 * 6
    assert np.hypot(*errors[-1].T).max() < limit_m


def test_gps_alone_has_the_mean_and_sd_of_a_rayleigh_distribution():
    errors, _ = errors_of(filtering(straight(cars=50, steps=40), GpsOnly(), runs=20))
    absolute = np.hypot(errors[..., 0], errors[..., 1])
    assert 6 * math.sqrt(math.pi / 2) == pytest.approx(7.520, abs=5e-4)
    assert absolute.mean() == pytest.approx(7.520, abs=4 * 3.931 / 200)
    assert absolute.std() == pytest.approx(3.931, abs=4 * 3.931 / 200)


def test_dead_reckoning_error_grows_as_two_gps_and_two_velocity_variances_a_second():
    trace = straight(cars=100, steps=31)
    run = filtering(trace, Ekf(), radius_m=10.0, runs=20, gps_reset_s=math.inf)
    errors, _ = errors_of(run)
    squared = (errors**2).sum(axis=2).mean(axis=1)
    for t in (0, 10, 30):
        expected = 2 * 36 + 2 * 0.25 * t
        assert squared[t] == pytest.approx(expected, rel=4 / math.sqrt(2000))


def test_an_isolated_car_takes_its_fix_every_so_many_seconds():
    run = filtering(straight(steps=12), Ekf(), radius_m=10.0, runs=1, gps_reset_s=5.0)
    variance = [state.covariance[0, 0] for _, state in run.states()]
    assert [t for t, p in enumerate(variance) if p == 36.0] == [0, 5, 10]


def test_gps_with_odometry_is_the_steady_state_of_the_riccati_equation():
    q, r = 0.25, 36.0
    prior = q / 2 + math.sqrt(q * q / 4 + q * r)
    errors, state = errors_of(filtering(straight(cars=100, steps=120), GpsOdometry(), runs=20))
    assert state.covariance[:, 0] == pytest.approx(prior - q, rel=1e-6)
    squared = (errors[-1] ** 2).sum(axis=1).mean()
    assert squared == pytest.approx(2 * (prior - q), rel=4 / math.sqrt(2000))


def test_ekf_equals_the_plain_loop():
    truth, state, heard = scene(rows=200)
    ours = Ekf().update(state, heard)
    position, covariance = plain_ekf(state.position, state.covariance, heard)
    difference = np.sum((ours.position - truth) ** 2) - np.sum((position - truth) ** 2)
    assert abs(difference) <= 1e-7
    np.testing.assert_allclose(ours.covariance, covariance, rtol=1e-9, atol=1e-12)


def test_ekf_equals_filterpy():
    filterpy = pytest.importorskip("filterpy.kalman")
    truth, state, heard = scene(rows=20)
    ours = Ekf().update(state, heard)
    for i in range(len(truth)):
        oracle = filterpy.ExtendedKalmanFilter(dim_x=2, dim_z=3)
        oracle.x, oracle.P = state.position[i].copy(), 16.0 * np.eye(2)
        oracle.R = np.diag(heard.range_variance_m2[i])
        anchors = np.stack([heard.x[i], heard.y[i]], axis=1)
        oracle.update(
            heard.range_m[i],
            lambda x, a=anchors: (x - a) / np.linalg.norm(x - a, axis=1)[:, None],
            lambda x, a=anchors: np.linalg.norm(x - a, axis=1),
        )
        np.testing.assert_allclose(ours.position[i], oracle.x, atol=1e-9)
        expected = [oracle.P[0, 0], oracle.P[0, 1], oracle.P[1, 1]]
        np.testing.assert_allclose(ours.covariance[i], expected, atol=1e-9)


def test_gps_with_odometry_equals_filterpy():
    filterpy = pytest.importorskip("filterpy.kalman")
    oracle = filterpy.KalmanFilter(dim_x=2, dim_z=2)
    oracle.F = oracle.H = oracle.B = np.eye(2)
    oracle.P, oracle.Q, oracle.R = 1e8 * np.eye(2), 0.25 * np.eye(2), 36.0 * np.eye(2)
    ours = GpsOdometry()
    rng = np.random.default_rng(5)
    state = ours.start(np.zeros((1, 2)), 36.0)
    _, _, heard = scene(rows=1)
    for _ in range(10):
        velocity, fix = rng.normal(size=(1, 2)), rng.normal(size=(1, 2))
        state = ours.predict(state, velocity, 1.0)
        state = ours.update(state, Measurements(**(vars(heard) | {"gps": fix})))
        oracle.predict(u=velocity.reshape(2, 1))
        oracle.update(fix.reshape(2, 1))
    np.testing.assert_allclose(state.position[0], oracle.x.ravel(), atol=1e-8)
    np.testing.assert_allclose(state.covariance[0, 0], oracle.P[0, 0], rtol=1e-8)


def test_a_neighbours_own_error_counts_only_along_the_line_of_sight():
    truth, anchors = np.zeros((1, 2)), np.array([[[1000.0, 0.0]]])
    rng = np.random.default_rng(0)
    state = State(np.zeros((1, 2)), isotropic(1, 4.0))
    shared = np.array([[[5.0, 0.0, 1e6]]])
    heard = heard_by(truth, anchors, 1.0, rng=rng, shared=shared)
    augmented, literal = Ekf().update(state, heard), Ekf(literal=True).update(state, heard)
    assert augmented.covariance[0, 0] == pytest.approx(1 / (1 / 4 + 1 / 6))
    assert literal.covariance[0, 0] == pytest.approx(1 / (1 / 4 + 1))
    assert augmented.covariance[0, 2] == pytest.approx(4.0)


def test_with_two_anchors_in_line_a_car_settles_on_the_side_of_its_first_fix():
    runs = 4000
    still = straight(steps=6, speed=0.0)
    run = filtering(
        still,
        Ekf(sigma_q=0.0, sigma_gamma=0.0),
        anchors=[[-60.0, -4.0], [60.0, -4.0]],
        radius_m=100.0,
        sigma_m=0.2,
        runs=runs,
        halted=False,
        sigma_velocity=0.0,
    )
    errors, _ = errors_of(run)
    wrong = np.mean(errors[-1][:, 1] < -4.0)
    expected = stats.norm.cdf(-4 / 6)
    assert wrong == pytest.approx(expected, abs=4 * math.sqrt(expected * (1 - expected) / runs))


def test_gcpso_comes_near_the_least_of_its_own_cost():
    _, state, heard = scene(rows=60, sigma_m=4.0)
    ours = Gcpso().update(state, heard).position
    plain = plain_gcpso(state.position, heard, np.random.default_rng(1))
    excess = {"ours": [], "plain": []}
    for i in range(60):
        anchors = np.stack([heard.x[i], heard.y[i]], axis=1)
        ranges, start = heard.range_m[i], state.position[i]

        def residuals(p, a=anchors, r=ranges, s=start):
            return np.concatenate([r - np.linalg.norm(p - a, axis=1), p - s])

        starts = [start, *anchors, *(start + 30 * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]]))]
        least = min(2 * least_squares(residuals, s).cost for s in starts)
        for name, found in (("ours", ours[i]), ("plain", plain[i])):
            cost = plain_cost(found, ranges, anchors, start)
            assert cost >= least - 1e-6
            excess[name].append(cost - least)
    # The swarm of 4 and 20 steps is coarse; the plain one, with other chance, is no better.
    assert np.median(excess["ours"]) < 0.5
    assert np.median(excess["ours"]) < 2 * np.median(excess["plain"]) + 0.05


@pytest.mark.parametrize("particles", [11, 12])
def test_many_iterations_bring_the_swarm_to_the_least_cost(particles):
    _, state, heard = scene(rows=40)
    found = Gcpso(Swarm(particles, iterations=400)).update(state, heard).position
    for i in range(40):
        anchors = np.stack([heard.x[i], heard.y[i]], axis=1)

        def residuals(p, a=anchors, r=heard.range_m[i], s=state.position[i]):
            return np.concatenate([r - np.linalg.norm(p - a, axis=1), p - s])

        starts = [state.position[i], *anchors]
        least = min((least_squares(residuals, s) for s in starts), key=lambda fit: fit.cost)
        cost = plain_cost(found[i], heard.range_m[i], anchors, state.position[i])
        assert cost <= 2 * least.cost + 1e-3


@pytest.mark.parametrize("alone", [0, 57, LANES, 2 * LANES + 19])
def test_the_swarm_of_a_car_does_not_depend_on_who_moves_beside_it(alone):
    """Neither on its place in the vector registers nor on the run that is computed with it."""
    cars, run = 2 * LANES + 20, 1
    _, state, heard = scene(rows=2 * cars)
    both = Measurements(**(vars(heard) | {"runs": 2, "car": np.arange(cars)}))
    together = Gcpso().update(state, both).position
    row = slice(run * cars + alone, run * cars + alone + 1)
    arrays = {name: value for name, value in vars(heard).items() if isinstance(value, np.ndarray)}
    own = {name: value[row] for name, value in arrays.items()}
    one = vars(heard) | own | {"first_run": run, "car": np.array([alone])}
    single = Gcpso().update(State(state.position[row], state.covariance[row]), Measurements(**one))
    assert (single.position == together[row]).all()


def test_the_particles_of_a_swarm_draw_numbers_that_have_nothing_in_common():
    cars = np.arange(50_000)
    words, u = np.empty((4, cars.size), np.uint32), np.empty((8, cars.size))
    _draw((1, 0), np.zeros_like(cars), 3, cars, 5, words, u)
    assert u.min() > 0.0
    assert u.max() < 1.0
    common = np.corrcoef(u) - np.eye(8)
    assert np.abs(common).max() < 4.5 / np.sqrt(cars.size)
    assert stats.kstest(u.ravel(), "uniform").pvalue > 1e-3


def test_literal_gcpso_looks_near_the_origin_as_printed():
    _, state, heard = scene(rows=5)
    literal, meant = Gcpso(literal=True).update(state, heard), Gcpso().update(state, heard)
    assert (np.hypot(*literal.position.T) < np.hypot(*meant.position.T)).all()


def test_second_order_equals_the_ekf_where_ranges_are_straight():
    rng = np.random.default_rng(2)
    truth = rng.uniform(0, 10, (6, 2))
    angle = rng.uniform(0, 2 * np.pi, (6, 3))
    anchors = truth[:, None] + 1e6 * np.stack([np.cos(angle), np.sin(angle)], axis=2)
    heard = heard_by(truth, anchors, 1.0, rng=rng)
    far = (np.arange(18).reshape(6, 3) | (1 << 31)).astype(np.int64)
    state = State(truth + rng.normal(size=(6, 2)), isotropic(6, 4.0))
    no_gps = Measurements(**(vars(heard) | {"neighbour": far, "gps_variance_m2": 1e14}))
    ours, ekf = SecondOrder(6).update(state, no_gps), Ekf().update(state, heard)
    np.testing.assert_allclose(ours.position, ekf.position, atol=1e-4)
    np.testing.assert_allclose(ours.covariance, ekf.covariance, atol=1e-4)


def test_two_cars_that_range_again_and_again_do_not_count_their_fixes_twice():
    """East-west ranges without noise of note: their mean is known no better than by two fixes."""
    filter_, rng = SecondOrder(2), np.random.default_rng(0)
    truth = np.array([[0.0, 0.0], [5000.0, 0.0]])
    other = np.array([[1], [0]], dtype=np.int64)
    heard = heard_by(truth, truth[::-1][:, None], 0.01, rng=rng)
    heard = Measurements(**(vars(heard) | {"neighbour": other}))
    state = filter_.update(filter_.start(truth, 36.0), heard)
    blind = Measurements(**(vars(heard) | {"gps_variance_m2": 1e14}))
    for _ in range(20):
        state = filter_.update(state, blind)
    assert state.covariance[0, 0] == pytest.approx(18.0, rel=1e-3)


@pytest.mark.parametrize("turn", [0.0, 0.5])
def test_three_cars_in_a_row_know_their_middle_as_well_whatever_way_the_row_points(turn):
    """Correlations that lie along one axis only must not be taken for none."""
    filter_, rng = SecondOrder(3), np.random.default_rng(0)
    along = np.array([np.cos(np.pi * turn), np.sin(np.pi * turn)]).round(12)
    truth = np.array([0.0, 4000.0, 8000.0])[:, None] * along
    order = np.array([[1], [2], [1]], dtype=np.int64)
    heard = heard_by(truth, truth[order[:, 0]][:, None], 0.01, rng=rng)
    heard = Measurements(**(vars(heard) | {"neighbour": order}))
    state = filter_.update(filter_.start(truth, 36.0), heard)
    for _ in range(3):
        state = filter_.update(state, heard)
    row = np.stack([state.covariance[:, 0], state.covariance[:, 2]], axis=1) @ along**2
    assert (row > 0.95 * 36 / (4 * 3)).all()  # four fixes of three cars, and no more


def test_second_order_refuses_more_cars_than_it_can_remember():
    with pytest.raises(OptionError, match="correlations of 2000 cars"):
        SecondOrder(2001)


@pytest.mark.parametrize("name", ["nosuchmodule:Name", "math:nothing", "math:pi", "ekf"])
def test_what_is_no_estimator_is_refused(name):
    with pytest.raises(OptionError):
        load_estimator(name)

"""Positioning beside the plain ways to do it, and beside its bound, in one run on one thread.

Times are the CPU time of one thread (best of several), so that a busy machine counts less. The
town and the circuit are made here: nothing of them is measured.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np
from scipy.spatial import KDTree

from benchmarks.rows import Row, main, seconds, side_by_side
from covertool.positioning.cases import Case, Piece, Scenario, Work
from covertool.positioning.ekf import Ekf
from covertool.positioning.estimators import Measurements, State, isotropic
from covertool.positioning.experiment import position_errors
from covertool.positioning.gcpso import Gcpso
from covertool.positioning.grid import ANCHOR, BLIND, build_grid
from covertool.positioning.neighbours import anchor_codes, select_nearest
from covertool.positioning.options import PositioningOptions
from tests.positioning.circuit import circuit
from tests.positioning.reference import plain_ekf, plain_gcpso


def best_seconds(work: Callable[[], object], repeats: int) -> float:
    """Return the least CPU time of a few runs, after one to warm up."""
    work()
    found = []
    for _ in range(repeats):
        started = time.thread_time()
        work()
        found.append(time.thread_time() - started)
    return min(found)


def scene(rows: int, seed: int = 0) -> tuple[State, Measurements, np.ndarray]:
    """Return predictions, ranges to three neighbours, and the truth, of unrelated cars."""
    rng = np.random.default_rng(seed)
    truth = rng.uniform(0, 500, (rows, 2))
    anchors = truth[:, None] + rng.uniform(-80, 80, (rows, 3, 2))
    ranges = np.linalg.norm(truth[:, None] - anchors, axis=2) + 0.2 * rng.normal(size=(rows, 3))
    heard = Measurements(
        1.0, (1, 0), 0, 1, 3, np.arange(rows), np.zeros((rows, 2)), truth, 36.0,
        np.full(rows, 3), np.zeros((rows, 3), np.int64), ranges, np.full((rows, 3), 0.04),
        anchors[:, :, 0].copy(), anchors[:, :, 1].copy(), np.zeros((rows, 3, 3)),
    )  # fmt: skip
    state = State(truth + 2 * rng.normal(size=(rows, 2)), isotropic(rows, 4.0))
    return state, heard, truth


def estimators(quick: bool) -> Iterator[Row]:
    """Yield both estimators beside a plain numpy loop over the cars, and per car-step."""
    few, many = (100, 2_000) if quick else (400, 20_000)
    turns = 2 if quick else 5
    for name, ours, plain, limit_us, times in (
        ("EKF", Ekf(), plain_ekf_update, 0.5, 100),
        ("GCPSO", Gcpso(), plain_gcpso_update, 3.0, 500),
    ):
        fast = partial(ours.update, *scene(many)[:2])
        slow = partial(plain, *scene(few)[:2])
        cost = [best_seconds(fast, 3) / many for _ in range(turns)]
        beside = [seconds(slow, time.thread_time) / few for _ in range(turns)]
        ratios = tuple(b / c for b, c in zip(beside, cost, strict=True))
        work = f"{name}, update alone"
        yield Row(work, "numpy, a loop over the cars", ratios, limit=times)
        yield Row(f"{work}, a car-step", "", micro(cost), "us", False, limit_us)


def micro(taken: Sequence[float]) -> tuple[float, ...]:
    return tuple(1e6 * value for value in taken)


def other_libraries(quick: bool) -> Iterator[Row]:
    """Yield ratios to what others would take: one filter, or one swarm, for each car."""
    rows = 50 if quick else 200
    state, heard, _ = scene(rows)
    works = (
        ("EKF, update alone", "filterpy ExtendedKalmanFilter", filterpy_ekf, Ekf()),
        ("GCPSO, update alone", "pyswarms GlobalBestPSO (4 particles, 20 steps)", swarm, Gcpso()),
    )
    for work, beside, peer, ours in works:
        try:
            peer(state, heard, 1)
        except ImportError as missing:
            print(f"{beside}: not installed ({missing.name})", file=sys.stderr)
            continue
        many = scene(20 * rows)[:2]
        ours.update(*many)
        turns = [
            (seconds(partial(peer, state, heard, rows), time.thread_time) / rows,
             best_seconds(partial(ours.update, *many), 3) / (20 * rows))
            for _ in range(1 if quick else 3)
        ]  # fmt: skip
        yield Row(work, beside, tuple(theirs / own for theirs, own in turns))


def filterpy_ekf(state: State, heard: Measurements, rows: int) -> None:
    from filterpy.kalman import ExtendedKalmanFilter

    for i in range(rows):
        place = np.stack([heard.x[i], heard.y[i]], axis=1)

        def ranges(x: np.ndarray, place: np.ndarray = place) -> np.ndarray:
            return np.hypot(*(x[:, 0] - place).T)[:, None]

        def slopes(x: np.ndarray, place: np.ndarray = place) -> np.ndarray:
            return (x[:, 0] - place) / ranges(x, place)

        one = ExtendedKalmanFilter(dim_x=2, dim_z=3)
        one.x, one.P = state.position[i][:, None], 4.0 * np.eye(2)
        one.R = np.diag(heard.range_variance_m2[i])
        one.update(heard.range_m[i][:, None], slopes, ranges)


def swarm(state: State, heard: Measurements, rows: int) -> None:
    from pyswarms.single import GlobalBestPSO

    options = {"c1": 2.0, "c2": 2.0, "w": 0.9}
    for i in range(rows):
        place = np.stack([heard.x[i], heard.y[i]], axis=1)

        def cost(p: np.ndarray, i: int = i, place: np.ndarray = place) -> np.ndarray:
            miss = heard.range_m[i] - np.linalg.norm(p[:, None] - place, axis=2)
            return (miss**2).sum(axis=1) + ((p - state.position[i]) ** 2).sum(axis=1)

        GlobalBestPSO(4, 2, options).optimize(cost, 20, verbose=False)


def plain_ekf_update(state: State, heard: Measurements) -> object:
    return plain_ekf(state.position, state.covariance, heard)


def plain_gcpso_update(state: State, heard: Measurements) -> object:
    return plain_gcpso(state.position, heard, np.random.default_rng(0))


def agreement() -> Row:
    """Return how far the squared errors of the engine and of the plain loop differ."""
    state, heard, truth = scene(500)
    ours = Ekf().update(state, heard).position
    plain, _ = plain_ekf(state.position, state.covariance, heard)
    difference = np.abs(((ours - truth) ** 2).sum(axis=1) - ((plain - truth) ** 2).sum(axis=1))
    beside = "numpy, a loop over the cars"
    return Row("EKF, squared error", beside, (float(difference.max()),), "m2", False, 1e-7)


def whole_step(quick: bool) -> Iterator[Row]:
    """Yield the cost of a whole car-step: noise, choice, ranges, estimate and sums."""
    trace, anchors = circuit(cars=100 if quick else 295, steps=40, anchors=200)
    work = Work([Scenario(trace, anchors)], PositioningOptions(), 1)
    for name in ("ekf", "gcpso"):
        piece = Piece(0, Case("proposed", name, 0.2, 15.0), 0, 20)
        cost = [best_seconds(partial(work, piece), 1) / (20 * len(trace)) for _ in range(3)]
        yield Row(f"{name.upper()}, whole car-step", "", micro(cost), "us", False)


def dense_town(quick: bool) -> Iterator[Row]:
    """Yield the cost of the second-order filter and of the bound where many cars hear many."""
    cars, steps = (100, 20) if quick else (295, 60)
    trace, anchors = circuit(cars=cars, steps=steps, anchors=600, halting=True)
    work = Work([Scenario(trace, anchors)], PositioningOptions(), 1)
    for radius_m in (15.0, 100.0):
        for arm in ("traditional", "proposed"):
            case = Case(arm, "second_order", 0.2, radius_m)
            title = f"{cars} cars on one circuit, {arm}, {radius_m:g} m"
            cost = best_seconds(partial(work, Piece(0, case, 0, 8)), 1) / (8 * len(trace))
            yield Row(f"second order, whole car-step: {title}", "", micro([cost]), "us", False)
            below = 1e3 * best_seconds(partial(work, Piece(0, case, 0, 0)), 1) / steps
            yield Row(f"joint bound, a step: {title}", "", (below,), "ms", False)


def neighbours(quick: bool) -> Iterator[Row]:
    """Yield the selection beside a KD-tree with lists of pairs."""
    cars, parked = (5_000, 10_000) if quick else (50_000, 100_000)
    side = (parked / 1e-3) ** 0.5
    rng = np.random.default_rng(0)
    car, anchor = rng.uniform(0, side, (cars, 2)), rng.uniform(0, side, (parked, 2))
    x, y = car.T.copy()
    priority, known = np.full(cars, BLIND), np.full(parked, ANCHOR)
    for radius_m in (15.0, 100.0):
        places = build_grid(*anchor.T.copy(), anchor_codes(parked), known, radius_m)
        tree = KDTree(anchor)

        def ours(radius_m: float = radius_m, places: object = places) -> object:
            grid = build_grid(x, y, np.arange(cars), priority, radius_m)
            return select_nearest(grid, places, radius_m)

        work = f"neighbours of {cars:,} cars among {parked:,} anchors, {radius_m:g} m"
        ours()
        row = side_by_side(
            work, "scipy KD-tree with lists of pairs", ours,
            partial(pairs_by_tree, car, tree, radius_m), 1 if quick else 3,
            at_least=10, clock=time.thread_time, repeats=3,
        )  # fmt: skip
        yield row
        taken = tuple(seconds(ours, time.thread_time) for _ in range(3))
        yield Row(f"{work}, a step", "", taken, "s", False, 0.1)


def pairs_by_tree(car: np.ndarray, tree: KDTree, radius_m: float) -> np.ndarray:
    """Return the three best of each car: all pairs from trees, sorted by priority and distance."""
    moving = KDTree(car)
    pairs = []
    for other, rank in ((tree, ANCHOR), (moving, BLIND)):
        near = moving.sparse_distance_matrix(other, radius_m, output_type="coo_matrix")
        keep = np.ones(near.nnz, bool) if rank == ANCHOR else near.row != near.col
        pairs.append((near.row[keep], np.full(keep.sum(), rank), near.data[keep], near.col[keep]))
    who, rank, distance, code = (np.concatenate(parts) for parts in zip(*pairs, strict=True))
    order = np.lexsort((distance, rank, who))
    who, code = who[order], code[order]
    place = np.arange(who.size) - np.searchsorted(who, who)
    chosen = np.full((len(car), 3), -1)
    best = place < 3
    chosen[who[best], place[best]] = code[best]
    return chosen


def second_order(quick: bool) -> Iterator[Row]:
    """Yield how near the second-order filter comes to the bound, and how honest it is."""
    for title, both_sides in (("both kerbs", True), ("one kerb", False)):
        trace, anchors = circuit(both_sides=both_sides)
        report = position_errors(
            [Scenario(trace, anchors)],
            estimators=("second_order",),
            arms=("traditional", "proposed"),
            radii_m=(15.0, 100.0),
            runs=10 if quick else 40,
        )
        for r in report.results:
            case = f"parked at {title}, {r.arm}, {r.radius_m:g} m, sigma {r.sigma_range_m:g} m"
            limit = 1.10 if r.sigma_range_m == 4.0 else 1.40
            over = (r.rmse_over_bound,)
            yield Row(f"second order, RMSE: {case}", "the bound", over, "x bound", False, limit)
            yield Row(
                f"second order, NEES/2 (0.8 to 1.5): {case}", "", (r.nees / 2,), "", False, 1.5
            )


def rows(quick: bool) -> Iterator[Row]:
    """Yield all figures of positioning."""
    for part in (estimators, other_libraries, whole_step, dense_town, neighbours, second_order):
        yield from part(quick)
    yield agreement()


if __name__ == "__main__":
    main(rows, __doc__)

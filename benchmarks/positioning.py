"""Positioning beside the plain ways to do it, and beside its bound, in one run on one thread.

Times are the CPU time of one thread (best of several), so that a busy machine counts less. The
town and the circuit are made here: nothing of them is measured.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.spatial import KDTree

from covertool.positioning.cases import Case, Piece, Scenario, Work
from covertool.positioning.ekf import Ekf
from covertool.positioning.estimators import Measurements, State, isotropic
from covertool.positioning.experiment import position_errors
from covertool.positioning.gcpso import Gcpso
from covertool.positioning.grid import build_grid
from covertool.positioning.neighbours import (
    ANCHOR,
    BLIND,
    anchor_codes,
    select_nearest,
)
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


def estimators(quick: bool) -> list[list[str]]:
    """Return rows that set both estimators beside a plain numpy loop over the cars."""
    few, many = (100, 2_000) if quick else (400, 20_000)
    repeats = 3 if quick else 7
    out = []
    for name, ours, plain, target in (
        ("EKF", Ekf(), plain_ekf_update, "<= 0.5, >= 100 x"),
        ("GCPSO", Gcpso(), plain_gcpso_update, "<= 3, >= 500 x"),
    ):
        fast = best_seconds(partial(ours.update, *scene(many)[:2]), repeats) / many
        slow = best_seconds(partial(plain, *scene(few)[:2]), 1) / few
        out.append(
            [f"{name}, update alone, microseconds a car-step", f"{fast * 1e6:.3f}",
             f"{slow * 1e6:.1f}", f"{slow / fast:.0f} x", target]
        )  # fmt: skip
    return out


def plain_ekf_update(state: State, heard: Measurements) -> object:
    return plain_ekf(state.position, state.covariance, heard)


def plain_gcpso_update(state: State, heard: Measurements) -> object:
    return plain_gcpso(state.position, heard, np.random.default_rng(0))


def agreement() -> list[list[str]]:
    """Return how far the squared errors of the engine and of the plain loop differ."""
    state, heard, truth = scene(500)
    ours = Ekf().update(state, heard).position
    plain, _ = plain_ekf(state.position, state.covariance, heard)
    difference = np.abs(((ours - truth) ** 2).sum(axis=1) - ((plain - truth) ** 2).sum(axis=1))
    return [["EKF against the plain loop, m^2", f"{difference.max():.1e}", "", "", "<= 1e-7"]]


def whole_step(quick: bool) -> list[list[str]]:
    """Return the cost of a whole car-step: noise, choice, ranges, estimate and sums."""
    trace, anchors = circuit(cars=100 if quick else 295, steps=40, anchors=200)
    work = Work([Scenario(trace, anchors)], PositioningOptions(), 1)
    out = []
    for name in ("ekf", "gcpso"):
        piece = Piece(0, Case("proposed", name, 0.2, 15.0), 0, 20)
        steps = 20 * len(trace)
        seconds = best_seconds(partial(work, piece), 2) / steps
        label = f"{name.upper()}, whole step (noise, choice, ranges, sums), microseconds a car-step"
        out.append([label, f"{seconds * 1e6:.3f}", "", "", ""])
    return out


def dense_town(quick: bool) -> list[list[str]]:
    """Return the cost of the second-order filter and of the bound where many cars hear many."""
    cars, steps = (100, 20) if quick else (295, 60)
    trace, anchors = circuit(cars=cars, steps=steps, anchors=600, halting=True)
    work = Work([Scenario(trace, anchors)], PositioningOptions(), 1)
    out = []
    for radius_m in (15.0, 100.0):
        for arm in ("traditional", "proposed"):
            case = Case(arm, "second_order", 0.2, radius_m)
            title = f"{cars} cars on one circuit, {arm}, {radius_m:g} m"
            filtering = partial(work, Piece(0, case, 0, 8))
            seconds = best_seconds(filtering, 1) / (8 * len(trace))
            label = f"second order, whole step, microseconds a car-step: {title}"
            out.append([label, f"{seconds * 1e6:.1f}", "", "", ""])
            below = best_seconds(partial(work, Piece(0, case, 0, 0)), 1) / steps
            out.append(
                [f"joint bound, milliseconds a step: {title}", f"{below * 1e3:.1f}", "", "", ""]
            )
    return out


def neighbours(quick: bool) -> list[list[str]]:
    """Return rows that set the selection beside a KD-tree with lists of pairs."""
    cars, parked = (5_000, 10_000) if quick else (50_000, 100_000)
    side = (parked / 1e-3) ** 0.5
    rng = np.random.default_rng(0)
    car, anchor = rng.uniform(0, side, (cars, 2)), rng.uniform(0, side, (parked, 2))
    x, y = car.T.copy()
    priority, known = np.full(cars, BLIND), np.full(parked, ANCHOR)
    out = []
    for radius_m in (15.0, 100.0):
        places = build_grid(*anchor.T.copy(), anchor_codes(parked), known, radius_m)
        tree = KDTree(anchor)

        def ours(radius_m=radius_m, places=places):
            grid = build_grid(x, y, np.arange(cars), priority, radius_m)
            return select_nearest(grid, places, radius_m)

        def plain(radius_m=radius_m, tree=tree):
            return pairs_by_tree(car, tree, radius_m)

        fast, slow = best_seconds(ours, 3), best_seconds(plain, 1)
        label = f"neighbours of {cars:,} cars among {parked:,} anchors, {radius_m:g} m, s a step"
        out.append([label, f"{fast:.4f}", f"{slow:.3f}", f"{slow / fast:.0f} x", "<= 0.1, >= 10 x"])
    return out


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


def second_order(quick: bool) -> list[list[str]]:
    """Return how near the second-order filter comes to the bound, and how honest it is."""
    out = []
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
            least = 1.10 if r.sigma_range_m == 4.0 else 1.40
            out.append(
                [
                    f"second order over bound, parked at {title}, {r.arm}, {r.radius_m:g} m, "
                    f"sigma {r.sigma_range_m:g} m",
                    f"{r.rmse_over_bound:.3f}, NEES/2 {r.nees / 2:.2f}",
                    f"{r.bound_rmse_m:.2f} m",
                    "",
                    f"<= {least:.2f}, 0.8 to 1.5",
                ]
            )
    return out


def main() -> None:
    """Print one Markdown table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small sizes, a minute")
    quick = parser.parse_args().quick
    print("| what | covertool | beside it | ratio | aim |")
    print("| --- | --- | --- | --- | --- |")
    for rows in (estimators, whole_step, dense_town, neighbours, second_order):
        for row in rows(quick):
            print("| " + " | ".join(row) + " |", flush=True)
    for row in agreement():
        print("| " + " | ".join(row) + " |")


if __name__ == "__main__":
    main()

"""Error statistics as sums that grow step by step, and what parked cars save, with its interval."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from covertool.model import Floats
from covertool.positioning.kernel import kernel
from covertool.positioning.noise import Indices, log

LEAST_M, BINS_A_DECADE, DECADES = 1e-3, 80, 8
BINS = BINS_A_DECADE * DECADES
"""Bins of the error histograms: 2.9 % wide, from a millimetre to 100 km."""

BOOTSTRAPS = 1000

_BINS_A_UNIT = BINS_A_DECADE / math.log(10.0)


@dataclass
class Sums:
    """Sums over steps of one block of runs; never an array of cars x steps x runs.

    ``count``, ``error_m``, ``squared_m2`` and ``diverged`` are (runs, cars); ``bins`` is
    (cars, BINS); ``nees`` and ``nees_count`` are (cars,).
    """

    count: Indices
    error_m: Floats
    squared_m2: Floats
    diverged: Indices
    bins: Indices
    nees: Floats
    nees_count: Indices

    @classmethod
    def zero(cls, runs: int, cars: int) -> Sums:
        """Return sums of nothing."""
        whole, real = (np.int64, float)
        return cls(
            np.zeros((runs, cars), whole),
            np.zeros((runs, cars), real),
            np.zeros((runs, cars), real),
            np.zeros((runs, cars), whole),
            np.zeros((cars, BINS), whole),
            np.zeros(cars, real),
            np.zeros(cars, whole),
        )

    @classmethod
    def of_blocks(cls, blocks: Sequence[Sums]) -> Sums:
        """Return the sums of blocks of runs over the same cars, added in their order."""
        by_run = {"count", "error_m", "squared_m2", "diverged"}
        joined = {}
        for field in fields(cls):
            parts = [getattr(block, field.name) for block in blocks]
            joined[field.name] = (
                np.concatenate(parts) if field.name in by_run else np.sum(parts, axis=0)
            )
        return cls(**joined)

    def only(self, car: int) -> Sums:
        """Return the sums of one car."""
        some = slice(car, car + 1)
        return Sums(
            self.count[:, some],
            self.error_m[:, some],
            self.squared_m2[:, some],
            self.diverged[:, some],
            self.bins[some],
            self.nees[some],
            self.nees_count[some],
        )

    def add(
        self, car: Indices, truth: Floats, position: Floats, covariance: Floats, limit_m: float
    ) -> None:
        """Add one step of all rows; a car whose error passes the limit is out for that run."""
        runs = len(self.count)
        _add(
            runs,
            car,
            truth,
            position,
            covariance,
            limit_m,
            self.count,
            self.error_m,
            self.squared_m2,
            self.diverged,
            self.bins,
            self.nees,
            self.nees_count,
        )


@kernel
def _add(
    runs: int,
    car: Indices,
    truth: Floats,
    position: Floats,
    covariance: Floats,
    limit_m: float,
    count: Indices,
    error_m: Floats,
    squared_m2: Floats,
    diverged: Indices,
    bins: Indices,
    nees: Floats,
    nees_count: Indices,
) -> None:
    n = car.size
    for r in range(runs):
        for i in range(n):
            c, row = car[i], r * n + i
            dx, dy = position[row, 0] - truth[i, 0], position[row, 1] - truth[i, 1]
            squared = dx * dx + dy * dy
            if not squared < limit_m * limit_m:  # NaN too
                diverged[r, c] = 1
            if diverged[r, c]:
                continue
            error = math.sqrt(squared)
            count[r, c] += 1
            error_m[r, c] += error
            squared_m2[r, c] += squared
            place = log(max(error, LEAST_M) / LEAST_M) * _BINS_A_UNIT
            bins[c, min(max(int(place), 0), BINS - 1)] += 1
            xx, xy, yy = covariance[row, 0], covariance[row, 1], covariance[row, 2]
            determinant = xx * yy - xy * xy
            if determinant > 0.0:
                nees[c] += (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / determinant
                nees_count[c] += 1


@dataclass(frozen=True)
class ErrorStatistics:
    """Statistics of the pooled absolute error; None when a car diverged or nothing was seen."""

    samples: int
    diverged: int
    mean_error_m: float | None
    sd_error_m: float | None
    rmse_m: float | None
    median_error_m: float | None
    p95_error_m: float | None
    nees: float | None


def statistics_of(scenarios: Sequence[Sums]) -> ErrorStatistics:
    """Return the statistics of all errors in the sums of several scenarios, pooled."""
    samples = sum(int(s.count.sum()) for s in scenarios)
    diverged = sum(int(s.diverged.sum()) for s in scenarios)
    if samples == 0 or diverged:
        return ErrorStatistics(samples, diverged, None, None, None, None, None, None)
    mean = sum(float(s.error_m.sum()) for s in scenarios) / samples
    square = sum(float(s.squared_m2.sum()) for s in scenarios) / samples
    bins = np.sum([s.bins.sum(axis=0) for s in scenarios], axis=0)
    nees_count = sum(int(s.nees_count.sum()) for s in scenarios)
    nees = sum(float(s.nees.sum()) for s in scenarios)
    return ErrorStatistics(
        samples,
        0,
        mean,
        math.sqrt(max(square - mean * mean, 0.0)),
        math.sqrt(square),
        quantile_m(bins, 0.5),
        quantile_m(bins, 0.95),
        nees / nees_count if nees_count else None,
    )


def quantile_m(bins: Indices, share: float) -> float:
    """Return a quantile of the errors in a histogram, linear within its bin.

    >>> bins = np.zeros(BINS, dtype=np.int64)
    >>> bins[[240, 240, 241]] = 1
    >>> 1.0 <= quantile_m(bins, 0.5) <= 1.06
    True
    """
    reached = np.cumsum(bins)
    wanted = share * reached[-1]
    k = int(np.searchsorted(reached, wanted))
    below = reached[k - 1] if k else 0
    part = (wanted - below) / max(bins[k], 1)
    low, high = LEAST_M * 10 ** (np.array([k, k + 1]) / BINS_A_DECADE)
    return float(low + part * (high - low))


def improvement(
    traditional: Sequence[Sequence[Sums]], proposed: Sequence[Sequence[Sums]], seed: int = 0
) -> tuple[float, tuple[float, float] | None] | None:
    """Return what parked cars take off the mean error in percent, and its 95 % interval.

    ``100 (1 - mean proposed / mean traditional)``, the average improvement of the paper. The
    interval is a percentile bootstrap that draws layouts, then traffic seeds within each, then
    runs within each, all with replacement, both arms together.

    Parameters
    ----------
    traditional, proposed : sums by layout and, within it, by traffic seed
    seed : of the bootstrap

    Returns
    -------
    None when a car diverged or nothing was seen; no interval when there is but one run, from which
    nothing can be drawn.
    """
    arms = (traditional, proposed)
    if any(sums.diverged.any() for arm in arms for layout in arm for sums in layout):
        return None
    tables = [
        [(s.error_m.sum(axis=1), p.error_m.sum(axis=1)) for s, p in zip(*layout, strict=True)]
        for layout in zip(*arms, strict=True)
    ]
    total = np.sum([[a.sum(), b.sum()] for layout in tables for a, b in layout], axis=0)
    if total[0] <= 0:
        return None
    percent_all = 100 * (1 - float(total[1] / total[0]))
    if sum(a.size for layout in tables for a, _ in layout) < 2:
        return percent_all, None
    rng = np.random.Generator(np.random.Philox(seed))
    drawn = np.array([_resample(tables, rng) for _ in range(BOOTSTRAPS)])
    with np.errstate(invalid="ignore", divide="ignore"):
        percent = 100 * (1 - drawn[:, 1] / drawn[:, 0])
    low, high = np.nanpercentile(percent, [2.5, 97.5])
    return percent_all, (float(low), float(high))


def _resample(tables: list[list[tuple[Floats, Floats]]], rng: np.random.Generator) -> Floats:
    total = np.zeros(2)
    for layout in rng.integers(len(tables), size=len(tables)):
        seeds = tables[layout]
        for k in rng.integers(len(seeds), size=len(seeds)):
            a, b = seeds[k]
            runs = rng.integers(a.size, size=a.size)
            total += a[runs].sum(), b[runs].sum()
    return total

"""Guaranteed-convergence particle swarm (van den Bergh and Engelbrecht 2010), the paper's cost."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from covertool.model import Floats
from covertool.positioning.estimators import Measurements, State, isotropic
from covertool.positioning.kernel import kernel
from covertool.positioning.linear import carry_on
from covertool.positioning.noise import SWARM, Indices, Words, philox

LANES = 128
"""Cars whose swarms move side by side in vector registers: as many as fit into the first cache."""

_LOW_HALF, _HALF_WORD, _UNIT_16 = np.uint32(0xFFFF), np.uint32(16), 2.0**-16


class Swarm(NamedTuple):
    """Parameters of the swarm; the defaults are the paper's."""

    particles: int = 4
    iterations: int = 20
    most_successes: int = 15
    most_failures: int = 5
    rho_m: float = 1.0
    attraction: float = 2.0
    first_inertia: float = 0.9
    last_inertia: float = 0.2
    most_velocity: float = math.inf


class Lanes(NamedTuple):
    """Cars whose swarms move side by side; every array ends in one axis over these cars.

    ``x, y, range_m`` and ``weight`` are (most, lanes): neighbours, with weight 0 where a car has
    fewer; ``a_x, a_y`` (lanes,) is where each car would be by its last estimate and velocity (or,
    read literally, its velocity alone).
    """

    x: Floats
    y: Floats
    range_m: Floats
    weight: Floats
    a_x: Floats
    a_y: Floats


@kernel
def cost(px: Floats, py: Floats, lanes: Lanes, out: Floats) -> None:
    """Write ``sum (d_j - |p - x_j|)^2 + |p - a|^2``, the paper's cost, at one place a car."""
    for i in range(px.size):
        ax, ay = px[i] - lanes.a_x[i], py[i] - lanes.a_y[i]
        out[i] = ax * ax + ay * ay
    for m in range(lanes.x.shape[0]):
        x, y, ranges, weight = lanes.x[m], lanes.y[m], lanes.range_m[m], lanes.weight[m]
        for i in range(px.size):
            dx, dy = px[i] - x[i], py[i] - y[i]
            miss = ranges[i] - math.sqrt(dx * dx + dy * dy)
            out[i] += weight[i] * miss * miss


@kernel
def _move(
    p: int,
    particle: Floats,
    leader: Indices,
    goal: Floats,
    rho: Floats,
    inertia: float,
    swarm: Swarm,
    u: Floats,
) -> None:
    """Move particle p of each car; ``particle`` is x, y, vx, vy, best x, best y; ``u`` uniform."""
    most = swarm.most_velocity
    for axis in range(2):
        x, v, best, g = particle[axis], particle[axis + 2], particle[axis + 4], goal[axis]
        own, other, around = u[2 * axis], u[2 * axis + 1], u[axis]
        for i in range(x.size):
            pull = own[i] * (best[i] - x[i]) + other[i] * (g[i] - x[i])
            follow = inertia * v[i] + swarm.attraction * pull
            lead = g[i] - x[i] + inertia * v[i] + rho[i] * (1.0 - 2.0 * around[i])
            new = lead if leader[i] == p else follow
            v[i] = min(max(new, -most), most)
            x[i] += v[i]


@kernel
def _draw(
    key: tuple[int, int], run: Indices, time: int, car: Indices, draw: int, words: Words, u: Floats
) -> None:
    """Write four numbers for each of two particles, uniform in (0, 1).

    Both halves of a word serve: 16 bits resolve 2^-16 of the way that a particle may go, which is
    far below what twenty steps of a swarm leave.
    """
    a, b, c, d = words[0], words[1], words[2], words[3]  # unpacking would lose contiguity
    for i in range(car.size):
        a[i], b[i], c[i], d[i] = time, car[i], draw, (run[i] << 8) | SWARM
    philox(a, b, c, d, key)
    for k in range(4):
        row, low, high = words[k], u[k], u[k + 4]
        for i in range(car.size):
            low[i] = (np.float64(np.int32(row[i] & _LOW_HALF)) + 0.5) * _UNIT_16
            high[i] = (np.float64(np.int32(row[i] >> _HALF_WORD)) + 0.5) * _UNIT_16


@kernel
def _remember(particle: Floats, best: Floats, found: Floats) -> None:
    x, y, best_x, best_y = particle[0], particle[1], particle[4], particle[5]
    for i in range(best.size):
        better = found[i] < best[i]
        best_x[i] = x[i] if better else best_x[i]
        best_y[i] = y[i] if better else best_y[i]
        best[i] = found[i] if better else best[i]


@kernel
def _best_of(particle: Floats, best: Floats, first: Indices, least: Floats, goal: Floats) -> None:
    """Write which particle of each car has found the least cost, how much, and where."""
    goal_x, goal_y = goal[0], goal[1]
    first[:], least[:], goal_x[:], goal_y[:] = 0, best[0], particle[0, 4], particle[0, 5]
    for p in range(1, len(best)):
        x, y, value = particle[p, 4], particle[p, 5], best[p]
        for i in range(least.size):
            better = value[i] < least[i]
            first[i] = p if better else first[i]
            least[i] = value[i] if better else least[i]
            goal_x[i] = x[i] if better else goal_x[i]
            goal_y[i] = y[i] if better else goal_y[i]


@kernel
def _elect(
    swarm: Swarm,
    first: Indices,
    least: Floats,
    leader: Indices,
    record: Floats,
    tally: Indices,
    rho: Floats,
) -> None:
    """Let the best particle of each car lead, and widen or narrow its search."""
    won, lost = tally[0], tally[1]
    for i in range(leader.size):
        same, better = first[i] == leader[i], least[i] < record[i]
        won[i] = won[i] + 1 if same and better else 0
        lost[i] = lost[i] + 1 if same and not better else 0
        narrow = rho[i] * 0.5 if lost[i] > swarm.most_failures else rho[i]
        rho[i] = rho[i] * 2.0 if won[i] > swarm.most_successes else narrow
        leader[i], record[i] = first[i], least[i]


@kernel
def search(
    key: tuple[int, int], run: Indices, time: int, car: Indices, lanes: Lanes, swarm: Swarm
) -> Floats:
    """Return (2, lanes): the best place that its swarm finds for each car.

    Half of the particles start at the first neighbour, half at ``a``, all at rest.
    """
    n, size = swarm.particles, car.size
    particle = np.zeros((n, 6, size))  # x, y, vx, vy, best x, best y
    best, found, goal = np.empty((n, size)), np.empty(size), np.empty((2, size))
    for p in range(n):
        particle[p, 0] = lanes.x[0] if p < n // 2 else lanes.a_x
        particle[p, 1] = lanes.y[0] if p < n // 2 else lanes.a_y
        particle[p, 4:] = particle[p, :2]
        cost(particle[p, 0], particle[p, 1], lanes, best[p])
    leader, record = np.empty(size, np.int64), np.empty(size)
    _best_of(particle, best, leader, record, goal)
    rho, tally = np.full(size, swarm.rho_m), np.zeros((2, size), np.int64)
    first, least = np.empty(size, np.int64), np.empty(size)
    words, u = np.empty((4, size), np.uint32), np.empty((8, size))
    slope = (swarm.last_inertia - swarm.first_inertia) / max(swarm.iterations - 1, 1)
    for k in range(swarm.iterations):
        inertia = swarm.first_inertia + slope * k
        for p in range(n):
            if p % 2 == 0:
                _draw(key, run, time, car, k * ((n + 1) // 2) + p // 2, words, u)
            own, half = particle[p], 4 * (p % 2)
            _move(p, own, leader, goal, rho, inertia, swarm, u[half : half + 4])
            cost(own[0], own[1], lanes, found)
            _remember(own, best[p], found)
        _best_of(particle, best, first, least, goal)
        _elect(swarm, first, least, leader, record, tally, rho)
    return goal


@kernel
def _lanes(
    rows: Indices, count: Indices, ranges: Floats, x: Floats, y: Floats, start: Floats
) -> Lanes:
    size, most = rows.size, ranges.shape[1]
    all_x, all_y = np.zeros((most, size)), np.zeros((most, size))
    all_ranges, weight = np.zeros((most, size)), np.zeros((most, size))
    for i in range(size):
        row = rows[i]
        for m in range(count[row]):
            all_x[m, i], all_y[m, i] = x[row, m], y[row, m]
            all_ranges[m, i], weight[m, i] = ranges[row, m], 1.0
    return Lanes(all_x, all_y, all_ranges, weight, start[rows, 0], start[rows, 1])


@kernel
def _update(
    key: tuple[int, int],
    first_run: int,
    time: int,
    car: Indices,
    start: Floats,
    count: Indices,
    ranges: Floats,
    x: Floats,
    y: Floats,
    swarm: Swarm,
    new: Floats,
) -> None:
    heard = np.flatnonzero(count)
    for first in range(0, heard.size, LANES):
        rows = heard[first : first + LANES]
        lanes = _lanes(rows, count, ranges, x, y, start)
        run, own = first_run + rows // car.size, car[rows % car.size]
        best = search(key, run, time, own, lanes, swarm)
        for i in range(rows.size):
            new[rows[i], 0], new[rows[i], 1] = best[0, i], best[1, i]


class Gcpso:
    """Least squares of the ranges and of the step since the last estimate, sought by a swarm.

    It has no covariance: what it carries in its place is that of GPS at each fix, and what dead
    reckoning has added since.

    Parameters
    ----------
    swarm : Swarm
        Its parameters.
    sigma_velocity : float
        Noise of the velocity in m/s, for that variance.
    literal : bool
        Use ``Ts v`` where the previous estimate plus ``Ts v`` is meant, as printed.
    """

    name = "gcpso"
    uses_gps = False
    gives_covariance = False

    def __init__(
        self, swarm: Swarm | None = None, sigma_velocity: float = 0.5, literal: bool = False
    ) -> None:
        self.swarm, self.sigma_velocity = swarm or Swarm(), sigma_velocity
        self.literal = literal

    def start(self, gps: Floats, variance_m2: float) -> State:
        """Return the first GPS fix."""
        return State(gps.copy(), isotropic(len(gps), variance_m2))

    def predict(self, state: State, velocity: Floats, step_s: float) -> State:
        """Return the state carried on by the velocity."""
        return carry_on(state, velocity, step_s, (self.sigma_velocity * step_s) ** 2)

    def update(self, predicted: State, heard: Measurements) -> State:
        """Return the best place found by the swarm; without neighbours the prediction."""
        start = predicted.position
        position, covariance = start.copy(), predicted.covariance.copy()
        address = (heard.key, heard.first_run, heard.time, heard.car)
        if self.literal:
            start = heard.step_s * heard.velocity
        _update(
            *address,
            start,
            heard.count,
            heard.range_m,
            heard.x,
            heard.y,
            self.swarm,
            position,
        )
        covariance[heard.count > 0] = heard.gps_variance_m2 * np.array([1.0, 0.0, 1.0])
        return State(position, covariance)

"""A synthetic street circuit with moving and parked cars, for tests and benchmarks only.

A closed loop of about 300 m by 100 m with round corners; moving cars drive round it at a speed that
changes with time; cars are parked along its first part, on both sides or one. Nothing of it is
measured.
"""

import numpy as np
from pyproj import CRS

from covertool.model import Anchors, Trace

CRS_METRES = CRS("EPSG:2157")
LENGTH_M, WIDTH_M, CORNER_M, KERB_M = 300.0, 100.0, 15.0, 3.5


def _loop():
    straight = [(LENGTH_M, 0.0), (WIDTH_M, 90.0), (LENGTH_M, 180.0), (WIDTH_M, 270.0)]
    points, at, step = [], np.zeros(2), 0.5
    for length, heading in straight:
        forward = np.array([np.cos(np.radians(heading)), np.sin(np.radians(heading))])
        for s in np.arange(0.0, length, step):
            points.append(at + s * forward)
        at = at + length * forward
        left = np.array([-forward[1], forward[0]])
        centre = at + CORNER_M * left
        for angle in np.arange(0.0, 90.0, 2.0):
            a = np.radians(heading - 90.0 + angle)
            points.append(centre + CORNER_M * np.array([np.cos(a), np.sin(a)]))
        at = at + CORNER_M * (left + forward)
    points = np.array(points)
    steps = np.hypot(*np.diff(points, axis=0, append=points[:1]).T)
    return points, np.concatenate([[0.0], np.cumsum(steps)])


def circuit(cars=12, steps=120, anchors=30, seed=0, halting=False, both_sides=True):
    """Return a trace whose v(t) is the way since t-1 (as SUMO moves cars), and parked cars."""
    rng = np.random.default_rng(seed)
    points, way = _loop()
    closed = np.concatenate([points, points[:1]])
    total = way[-1]

    def place(s):
        s = np.mod(s, total)
        return np.stack([np.interp(s, way, closed[:, 0]), np.interp(s, way, closed[:, 1])], axis=-1)

    start = np.sort(rng.uniform(0, total, cars))
    speed = 8.0 + 3.0 * np.sin(2 * np.pi * np.arange(-1, steps) / 60.0)
    if halting:
        speed = np.where(np.arange(-1, steps) % 60 > 40, 0.0, speed)
    gone = np.cumsum(speed)
    xy = place(start[None, :] + gone[:, None])
    velocity = np.diff(xy, axis=0)
    time = np.repeat(np.arange(steps, dtype=float), cars)
    names = np.tile(np.array([f"car{i:03d}" for i in range(cars)], dtype=object), steps)
    x, y = xy[1:].reshape(-1, 2).T
    vx, vy = velocity.reshape(-1, 2).T
    trace = Trace(time, names, x.copy(), y.copy(), vx.copy(), vy.copy())
    at = rng.uniform(0.0, 0.6 * total, anchors)
    ahead = place(at + 0.5) - place(at)
    left = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1) / np.hypot(*ahead.T)[:, None]
    side = rng.choice([-1.0, 1.0], anchors) if both_sides else np.ones(anchors)
    parked = place(at) + (side * rng.normal(KERB_M, 0.3, anchors))[:, None] * left
    return trace, Anchors.from_points(parked[:, 0], parked[:, 1], CRS_METRES)

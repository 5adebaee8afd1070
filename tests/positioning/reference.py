"""The paper's two estimators as one would write them first: plain numpy, one car at a time."""

import numpy as np


def plain_ekf(position, covariance, heard, literal=False):
    """Batch EKF in covariance form, with a matrix inverse, for each row."""
    new, new_covariance = position.copy(), covariance.copy()
    for i in range(len(position)):
        k = int(heard.count[i])
        if k == 0:
            continue
        x = position[i]
        p = np.array([[covariance[i, 0], covariance[i, 1]], [covariance[i, 1], covariance[i, 2]]])
        delta = x - np.stack([heard.x[i, :k], heard.y[i, :k]], axis=1)
        d = np.linalg.norm(delta, axis=1)
        h = delta / d[:, None]
        r = np.diag(heard.range_variance_m2[i, :k])
        if not literal:
            for m in range(k):
                a, b, c = heard.shared[i, m]
                r[m, m] += h[m] @ np.array([[a, b], [b, c]]) @ h[m]
        gain = p @ h.T @ np.linalg.inv(h @ p @ h.T + r)
        new[i] = x + gain @ (heard.range_m[i, :k] - d)
        p = (np.eye(2) - gain @ h) @ p
        new_covariance[i] = p[0, 0], p[0, 1], p[1, 1]
    return new, new_covariance


def plain_cost(p, ranges, anchors, start):
    return np.sum((ranges - np.linalg.norm(p - anchors, axis=1)) ** 2) + np.sum((p - start) ** 2)


def plain_gcpso(position, heard, rng, particles=4, iterations=20):
    """The swarm with a loop over cars, iterations and particles."""
    new = position.copy()
    for i in range(len(position)):
        k = int(heard.count[i])
        if k == 0:
            continue
        ranges = heard.range_m[i, :k]
        anchors = np.stack([heard.x[i, :k], heard.y[i, :k]], axis=1)
        start = position[i]
        x = np.array([anchors[0], anchors[0], start, start])
        v, best = np.zeros((particles, 2)), x.copy()
        value = np.array([plain_cost(p, ranges, anchors, start) for p in x])
        leader, rho, wins, losses = int(np.argmin(value)), 1.0, 0, 0
        for step in range(iterations):
            inertia = 0.9 - 0.7 * step / (iterations - 1)
            goal, record = best[leader].copy(), value[leader]
            for p in range(particles):
                if p == leader:
                    v[p] = goal - x[p] + inertia * v[p] + rho * (1 - 2 * rng.random(2))
                else:
                    pull = rng.random(2) * (best[p] - x[p]) + rng.random(2) * (goal - x[p])
                    v[p] = inertia * v[p] + 2.0 * pull
                x[p] = x[p] + v[p]
                found = plain_cost(x[p], ranges, anchors, start)
                if found < value[p]:
                    value[p], best[p] = found, x[p]
            last, leader = leader, int(np.argmin(value))
            better = value[leader] < record
            wins = wins + 1 if leader == last and better else 0
            losses = losses + 1 if leader == last and not better else 0
            rho = rho * 2 if wins > 15 else rho * 0.5 if losses > 5 else rho
        new[i] = best[leader]
    return new

"""Level areas by the most obvious exact way, with numpy alone: the oracle of the engine.

Every circle is cut at every other circle and at every transit edge; every transit edge is cut at
every circle. The middle of each piece says how many discs lie over it and whether it lies inside
the transit area, by trying all of them. Green's theorem adds the pieces that bound each level.
There is no grid, no pruning, no ordering by neighbours and no shared code with the engine.
"""

import numpy as np

LEVELS = np.arange(1, 4)


def reference_level_areas(x, y, radius, polygons, weights=None):
    """Return the areas of Levels 0 to 3 and the lengths of the arcs of levels >= 1, 2, 3."""
    starts, ends = directed_edges(polygons)
    if len(starts) == 0:
        return np.zeros(4), np.zeros(3)
    x, y = np.asarray(x, float).ravel(), np.asarray(y, float).ravel()
    radius = np.broadcast_to(np.asarray(radius, float), x.shape)
    origin = starts.mean(axis=0)
    starts, ends = starts - origin, ends - origin
    weight = np.ones(x.size) if weights is None else np.asarray(weights, float)
    discs, index = np.unique(
        np.column_stack([x - origin[0], y - origin[1], radius]).reshape(-1, 3),
        axis=0,
        return_inverse=True,
    )
    weight = np.bincount(np.ravel(index), weight, minlength=len(discs))
    at_least, lengths = np.zeros(3), np.zeros(3)
    for i in range(len(discs)):
        area, length = _circle(i, discs, weight, starts, ends)
        at_least += area
        lengths += length
    for a, b in zip(starts, ends, strict=True):
        at_least += _edge(a, b, discs, weight)
    total = 0.5 * np.sum(starts[:, 0] * ends[:, 1] - starts[:, 1] * ends[:, 0])
    covered = np.concatenate([[total], at_least])
    return covered - np.append(covered[1:], 0.0), lengths


def directed_edges(polygons):
    """Return the start and end points of all edges, the interior on their left."""
    starts, ends = [np.empty((0, 2))], [np.empty((0, 2))]
    for polygon in getattr(polygons, "geoms", [polygons]):
        rings = (
            []
            if polygon.is_empty
            else [(polygon.exterior, 1), *((h, -1) for h in polygon.interiors)]
        )
        for ring, turn in rings:
            points = np.asarray(ring.coords)[:, :2]
            shifted = points - points[0]
            twice = np.sum(shifted[:-1, 0] * shifted[1:, 1] - shifted[1:, 0] * shifted[:-1, 1])
            points = points if twice * turn > 0 else points[::-1]
            starts.append(points[:-1])
            ends.append(points[1:])
    return np.concatenate(starts), np.concatenate(ends)


def depth_at(points, discs, weight):
    """Return the weight of the discs over each point."""
    squared = (points[:, None, 0] - discs[:, 0]) ** 2 + (points[:, None, 1] - discs[:, 1]) ** 2
    return (squared < discs[:, 2] ** 2) @ weight


def inside(points, starts, ends):
    """Return whether each point lies in the polygons: a ray to the right crosses an odd number."""
    px, py = points[:, None, 0], points[:, None, 1]
    spans = (starts[:, 1] > py) != (ends[:, 1] > py)
    rise = np.where(ends[:, 1] == starts[:, 1], 1.0, ends[:, 1] - starts[:, 1])
    at = starts[:, 0] + (py - starts[:, 1]) * (ends[:, 0] - starts[:, 0]) / rise
    return np.sum(spans & (at > px), axis=1) % 2 == 1


def _circle(i, discs, weight, starts, ends):
    cx, cy, r = discs[i]
    others, their_weight = np.delete(discs, i, axis=0), np.delete(weight, i)
    cuts = np.concatenate(
        [[-np.pi, np.pi], _circle_angles(cx, cy, r, others), _edge_angles(cx, cy, r, starts, ends)]
    )
    cuts = np.unique(np.clip(cuts, -np.pi, np.pi))
    t0, t1 = cuts[:-1], cuts[1:]
    middle = (t0 + t1) / 2
    points = np.column_stack([cx + r * np.cos(middle), cy + r * np.sin(middle)])
    near = np.hypot(others[:, 0] - cx, others[:, 1] - cy) <= r + others[:, 2]
    depth = depth_at(points, others[near], their_weight[near])
    kept = inside(points, starts, ends)
    sines, cosines = np.sin(t1) - np.sin(t0), np.cos(t1) - np.cos(t0)
    area = 0.5 * r * (r * (t1 - t0) + cx * sines - cy * cosines)
    bounds = kept & (depth < LEVELS[:, None]) & (LEVELS[:, None] <= depth + weight[i])
    return bounds @ area, bounds @ (r * (t1 - t0))


def _circle_angles(cx, cy, r, others):
    dx, dy = others[:, 0] - cx, others[:, 1] - cy
    d = np.hypot(dx, dy)
    cross = (d < r + others[:, 2]) & (d > np.abs(r - others[:, 2]))
    dx, dy, d, other = dx[cross], dy[cross], d[cross], others[cross, 2]
    half = np.arccos(np.clip((d**2 + (r - other) * (r + other)) / (2 * r * d), -1, 1))
    turn = np.arctan2(dy, dx)
    angles = np.concatenate([turn - half, turn + half])
    return np.arctan2(np.sin(angles), np.cos(angles))


def _chords(cx, cy, r, starts, ends):
    """Return where the lines of the edges enter and leave the disc, as shares of the edge."""
    along = ends - starts
    length = np.hypot(along[:, 0], along[:, 1])
    foot = ((cx - starts[:, 0]) * along[:, 0] + (cy - starts[:, 1]) * along[:, 1]) / length**2
    off = ((cx - starts[:, 0]) * along[:, 1] - (cy - starts[:, 1]) * along[:, 0]) / length
    half = np.sqrt(np.maximum(r**2 - off**2, 0)) / length
    return foot - half, foot + half


def _edge_angles(cx, cy, r, starts, ends):
    shares = np.concatenate(_chords(cx, cy, r, starts, ends))
    hit = (shares >= 0) & (shares <= 1)
    points = (np.tile(starts, (2, 1)) + shares[:, None] * np.tile(ends - starts, (2, 1)))[hit]
    return np.arctan2(points[:, 1] - cy, points[:, 0] - cx)


def _edge(a, b, discs, weight):
    tiled = np.broadcast_to(a, (len(discs), 2)), np.broadcast_to(b, (len(discs), 2))
    cuts = np.concatenate([[0.0, 1.0], *_chords(discs[:, 0], discs[:, 1], discs[:, 2], *tiled)])
    cuts = np.unique(np.clip(cuts, 0, 1))
    t0, t1 = cuts[:-1], cuts[1:]
    depth = depth_at(a + ((t0 + t1) / 2)[:, None] * (b - a), discs, weight)
    area = 0.5 * (a[0] * b[1] - a[1] * b[0]) * (t1 - t0)
    return (depth >= LEVELS[:, None]) @ area

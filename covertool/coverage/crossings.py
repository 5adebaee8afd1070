"""Where circles, transit edges and grid cells meet: the one place for each of these questions.

A place where circles cross, and a place where a circle crosses an edge, is computed by one
function of the two in a fixed order, so that it has the same bits wherever it is met. Ties
(tangents, circles through a vertex) are decided once for both sides, by a relative tolerance of
1e-12 or a half-open rule.

Positions on a circle are ordered within a quadrant by ``u = y - x`` after turning the quadrant
to the first one; u grows from -r to r, and no angle is needed.
"""

# mypy: disable-error-code="no-untyped-def,no-untyped-call"

from __future__ import annotations

import math

from covertool.coverage.compiled import inlined

TANGENT = 1e-12
"""Circles and edges that overlap by less than this share of a radius only touch."""

APART, CROSSING, FIRST_WITHIN, SECOND_WITHIN = 0, 1, 2, 3


@inlined
def circle_crossings(xa, ya, ra, xb, yb, rb):
    """Return how two circles lie, and the two places where they cross."""
    dx, dy = xb - xa, yb - ya
    d = math.sqrt(dx * dx + dy * dy)
    slack = TANGENT * (ra + rb)
    if d >= ra + rb - slack:
        return APART, 0.0, 0.0, 0.0, 0.0
    if d <= abs(ra - rb) + slack:
        return (FIRST_WITHIN if rb > ra else SECOND_WITHIN), 0.0, 0.0, 0.0, 0.0
    # Heron's product: exact near tangency, and the same for both circles.
    both, less = ra + rb, ra - rb
    half = 0.5 * math.sqrt(((both - d) * (both + d)) * ((d - less) * (d + less))) / d
    along = 0.5 * (d + less * (both / d))
    ex, ey = dx / d, dy / d
    foot_x, foot_y = xa + along * ex, ya + along * ey
    across_x, across_y = -half * ey, half * ex
    return CROSSING, foot_x + across_x, foot_y + across_y, foot_x - across_x, foot_y - across_y


@inlined
def edge_crossings(ax, ay, bx, by, cx, cy, r):
    """Return whether an edge starts in a disc, how often it crosses the circle, and where.

    The places are shares of the edge. A vertex on the circle counts as outside for all edges.
    """
    limit = r * r * (1.0 - 2.0 * TANGENT)
    to_x, to_y, ex, ey = cx - ax, cy - ay, bx - ax, by - ay
    starts_in = to_x * to_x + to_y * to_y < limit
    ends_in = (bx - cx) ** 2 + (by - cy) ** 2 < limit
    squared, along = ex * ex + ey * ey, to_x * ex + to_y * ey
    if starts_in == ends_in and (starts_in or along <= 0.0 or along >= squared):
        return starts_in, 0, 0.0, 0.0
    across = to_x * ey - to_y * ex
    if not starts_in and not ends_in and across * across >= limit * squared:
        return starts_in, 0, 0.0, 0.0
    # (r - off) (r + off), each over the edge's length: exact near tangency.
    length = math.sqrt(squared)
    off = abs(across) / length
    half = math.sqrt(max((r - off) * (r + off), 0.0)) / length
    foot = along / squared
    enter, leave = min(max(foot - half, 0.0), 1.0), min(max(foot + half, 0.0), 1.0)
    if starts_in:
        return starts_in, 1, leave, leave
    return starts_in, 1 if ends_in else 2, enter, leave


@inlined
def quadrant_of(x, y):
    """Return the quadrant of a vector, half-open: its first axis belongs to it."""
    if y >= 0.0:
        if x > 0.0:
            return 0
        return 1 if y > 0.0 else 2
    return 2 if x < 0.0 else 3


@inlined
def turned(x, y, quadrant):
    """Return a vector turned back by quarter circles, so that the quadrant becomes the first."""
    if quadrant == 0:
        return x, y
    if quadrant == 1:
        return y, -x
    if quadrant == 2:
        return -x, -y
    return -y, x


@inlined
def turned_back(x, y, quadrant):
    """Return a vector of the first quadrant in its own quadrant."""
    if quadrant == 0:
        return x, y
    if quadrant == 1:
        return -y, x
    if quadrant == 2:
        return -x, -y
    return y, -x


@inlined
def point_at(u, r, quadrant):
    """Return the vector to the place u of a quadrant of a circle of radius r."""
    s = 0.5 * u
    t = math.sqrt(max(0.5 * r * r - s * s, 0.0))
    return turned_back(t - s, t + s, quadrant)


@inlined
def quadrant_in_cell(cx, cy, r, quadrant, x_low, y_low, x_high, y_high):
    """Return the part of a quarter circle in a cell: its u from and to, and both end vectors."""
    x0, y0 = turned(x_low - cx, y_low - cy, quadrant)
    x1, y1 = turned(x_high - cx, y_high - cy, quadrant)
    x0, x1, y0, y1 = min(x0, x1), max(x0, x1), min(y0, y1), max(y0, y1)
    from_x, from_y, to_x, to_y = r, 0.0, 0.0, r
    if x0 >= r or y0 >= r or x1 <= 0.0 or y1 <= 0.0:
        return 1.0, 0.0, from_x, from_y, to_x, to_y
    if x1 < r:
        from_x, from_y = x1, math.sqrt((r - x1) * (r + x1))
    if y0 > 0.0:
        x = math.sqrt((r - y0) * (r + y0))
        if y0 - x > from_y - from_x:
            from_x, from_y = x, y0
    if y1 < r:
        to_x, to_y = math.sqrt((r - y1) * (r + y1)), y1
    if x0 > 0.0:
        y = math.sqrt((r - x0) * (r + x0))
        if y - x0 < to_y - to_x:
            to_x, to_y = x0, y
    u0, u1 = from_y - from_x, to_y - to_x
    from_x, from_y = turned_back(from_x, from_y, quadrant)
    to_x, to_y = turned_back(to_x, to_y, quadrant)
    return u0, u1, from_x, from_y, to_x, to_y


@inlined
def is_inside(px, py, qx, qy, centre_inside, edges, e0, e1):
    """Return whether p lies in the transit area: count edges between it and the cell's centre q.

    Vertices on the line through p and q count as left of it for all edges.
    """
    winding = 1 if centre_inside else 0
    for e in range(e0, e1):
        ax, ay, bx, by = edges[e, 0], edges[e, 1], edges[e, 2], edges[e, 3]
        a_left = (qx - px) * (ay - py) - (qy - py) * (ax - px) >= 0.0
        b_left = (qx - px) * (by - py) - (qy - py) * (bx - px) >= 0.0
        if a_left != b_left:
            p_left = (bx - ax) * (py - ay) - (by - ay) * (px - ax) >= 0.0
            q_left = (bx - ax) * (qy - ay) - (by - ay) * (qx - ax) >= 0.0
            if p_left != q_left:
                winding += 1 if p_left else -1
    return winding > 0

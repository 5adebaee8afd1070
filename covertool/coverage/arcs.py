"""The boundaries of the levels within one grid cell: arcs of circles and parts of transit edges.

A place where circles cross, and a place where a circle crosses an edge, is computed by one
function of the two in a fixed order, so that it has the same bits wherever it is met. Ties
(tangents, circles through a vertex) are decided once for both sides, by a relative tolerance of
1e-12 or a half-open rule. Which side a stretch lies on is asked in the middle of its longest free
part, never near a crossing: rounding can therefore misjudge only slivers of rounding's own size.

Positions on a circle are ordered within a quadrant by ``u = y - x`` after turning the quadrant
to the first one; u grows from -r to r, and no angle is needed.
"""

# mypy: disable-error-code="no-untyped-def,no-untyped-call"

from __future__ import annotations

import math

import numpy as np

from covertool.coverage.compiled import compiled

TANGENT = 1e-12
"""Circles and edges that overlap by less than this share of a radius only touch."""

APART, CROSSING, FIRST_WITHIN, SECOND_WITHIN = 0, 1, 2, 3


@compiled
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
    half = 0.5 * math.sqrt(((ra + rb - d) * (ra + rb + d)) * ((d - ra + rb) * (d + ra - rb))) / d
    along = 0.5 * (d + (ra - rb) * ((ra + rb) / d))
    ex, ey = dx / d, dy / d
    foot_x, foot_y = xa + along * ex, ya + along * ey
    across_x, across_y = -half * ey, half * ex
    return CROSSING, foot_x + across_x, foot_y + across_y, foot_x - across_x, foot_y - across_y


@compiled
def edge_crossings(ax, ay, bx, by, cx, cy, r):
    """Return whether an edge starts in a disc, how often it crosses the circle, and where.

    The places are shares of the edge. A vertex on the circle counts as outside for all edges.
    """
    limit = r * r * (1.0 - 2.0 * TANGENT)
    starts_in = (ax - cx) ** 2 + (ay - cy) ** 2 < limit
    ends_in = (bx - cx) ** 2 + (by - cy) ** 2 < limit
    ex, ey = bx - ax, by - ay
    squared = ex * ex + ey * ey
    if (starts_in and ends_in) or squared == 0.0:
        return starts_in, 0, 0.0, 0.0
    foot = ((cx - ax) * ex + (cy - ay) * ey) / squared
    off = abs((cx - ax) * ey - (cy - ay) * ex) / math.sqrt(squared)
    crosses = starts_in != ends_in
    if not crosses and (foot <= 0.0 or foot >= 1.0 or off >= r * (1.0 - TANGENT)):
        return starts_in, 0, 0.0, 0.0
    half = math.sqrt(max((r - off) * (r + off), 0.0) / squared)
    enter, leave = min(max(foot - half, 0.0), 1.0), min(max(foot + half, 0.0), 1.0)
    if starts_in:
        return starts_in, 1, leave, leave
    return starts_in, 1 if ends_in else 2, enter, leave


@compiled
def quadrant_of(x, y):
    """Return the quadrant of a vector, half-open: its first axis belongs to it."""
    if y >= 0.0:
        if x > 0.0:
            return 0
        return 1 if y > 0.0 else 2
    return 2 if x < 0.0 else 3


@compiled
def turned(x, y, quadrant):
    """Return a vector turned back by quarter circles, so that the quadrant becomes the first."""
    if quadrant == 0:
        return x, y
    if quadrant == 1:
        return y, -x
    if quadrant == 2:
        return -x, -y
    return -y, x


@compiled
def turned_back(x, y, quadrant):
    """Return a vector of the first quadrant in its own quadrant."""
    if quadrant == 0:
        return x, y
    if quadrant == 1:
        return -y, x
    if quadrant == 2:
        return -x, -y
    return y, -x


@compiled
def point_at(u, r, quadrant):
    """Return the vector to the place u of a quadrant of a circle of radius r."""
    s = 0.5 * u
    t = math.sqrt(max(0.5 * r * r - s * s, 0.0))
    return turned_back(t - s, t + s, quadrant)


@compiled
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


@compiled
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


@compiled
def sort_events(events, n):
    """Sort the first n events by their place (Shell's method: few of them, nearly sorted)."""
    gap = 1
    while gap < n // 3:
        gap = 3 * gap + 1
    while gap > 0:
        for i in range(gap, n):
            at, kind, px, py = events[i, 0], events[i, 1], events[i, 2], events[i, 3]
            j = i
            while j >= gap and events[j - gap, 0] > at:
                events[j] = events[j - gap]
                j -= gap
            events[j, 0], events[j, 1], events[j, 2], events[j, 3] = at, kind, px, py
        gap //= 3


@compiled
def add_event(events, n, u, change, px, py):
    """Write one event (place, change of depth or 0 for a transit edge, point); return n + 1."""
    events[n, 0], events[n, 1], events[n, 2], events[n, 3] = u, change, px, py
    return n + 1


@compiled
def longest_gap(u0, u1, events, n0, n):
    """Return the middle of the longest free part between sorted events, and how many precede."""
    best, middle, before, last = -1.0, 0.5 * (u0 + u1), 0, u0
    for i in range(n0, n + 1):
        here = events[i, 0] if i < n else u1
        if here - last > best:
            best, middle, before = here - last, 0.5 * (here + last), i - n0
        last = here
    return middle, before


@compiled
def transit_events(cx, cy, r, quadrant, u0, u1, edges, e0, e1, events):
    """Write the places where transit edges cross an arc; return their number."""
    n = 0
    for e in range(e0, e1):
        ax, ay, bx, by = edges[e, 0], edges[e, 1], edges[e, 2], edges[e, 3]
        _, count, enter, leave = edge_crossings(ax, ay, bx, by, cx, cy, r)
        for which in range(count):
            share = enter if which == 0 else leave
            px, py = ax + share * (bx - ax), ay + share * (by - ay)
            if quadrant_of(px - cx, py - cy) == quadrant:
                x, y = turned(px - cx, py - cy, quadrant)
                if u0 <= y - x < u1:
                    n = add_event(events, n, y - x, 0.0, px, py)
    sort_events(events, n)
    return n


@compiled
def disc_events(i, j, near, quadrant, u0, u1, mid_x, mid_y, reach, events, n):
    """Write the places where disc j begins or ends to cover an arc of disc i.

    Returns whether it covers the arc's start, whether it covers all of it, and the number of
    events so far. The arc lies within ``reach`` of its own point mid.
    """
    cx, cy, r = near[i, 0], near[i, 1], near[i, 2]
    ox, oy, other = near[j, 0], near[j, 1], near[j, 2]
    squared = (mid_x - ox) ** 2 + (mid_y - oy) ** 2
    if squared >= (other + reach) ** 2:
        return False, False, n
    if other > reach and squared <= (other - reach) ** 2:
        return True, True, n
    if near[i, 4] < near[j, 4]:
        kind, ax, ay, bx, by = circle_crossings(cx, cy, r, ox, oy, other)
        within = kind == FIRST_WITHIN
    else:
        kind, ax, ay, bx, by = circle_crossings(ox, oy, other, cx, cy, r)
        within = kind == SECOND_WITHIN
    if kind != CROSSING:
        return within, within, n
    weight, first = near[j, 3], n
    for which in range(2):
        px, py = (ax, ay) if which == 0 else (bx, by)
        if quadrant_of(px - cx, py - cy) == quadrant:
            x, y = turned(px - cx, py - cy, quadrant)
            if u0 <= y - x < u1:
                n = add_event(events, n, y - x, weight, px, py)
    if n - first == 2 and events[first, 0] > events[first + 1, 0]:
        for c in range(4):
            events[first, c], events[first + 1, c] = events[first + 1, c], events[first, c]
    middle, before = longest_gap(u0, u1, events, first, n)
    vx, vy = point_at(middle, r, quadrant)
    covers = (cx + vx - ox) ** 2 + (cy + vy - oy) ** 2 < other * other
    covers_start = covers if before % 2 == 0 else not covers
    covered = covers_start
    for e in range(first, n):
        events[e, 1] = -weight if covered else weight
        covered = not covered
    return covers_start, covers_start and n == first, n


@compiled
def sweep_quadrant(i, near, k, base, quadrant, box, centre_inside, edges, e0, e1, events, out, m):
    """Write the level boundaries on one quarter of circle i in a cell; return their number."""
    cx, cy, r = near[i, 0], near[i, 1], near[i, 2]
    u0, u1, from_x, from_y, to_x, to_y = quadrant_in_cell(
        cx, cy, r, quadrant, box[0], box[1], box[2], box[3]
    )
    if u0 >= u1:
        return m
    n = transit_events(cx, cy, r, quadrant, u0, u1, edges, e0, e1, events)
    middle, before = longest_gap(u0, u1, events, 0, n)
    vx, vy = point_at(middle, r, quadrant)
    qx, qy = 0.5 * (box[0] + box[2]), 0.5 * (box[1] + box[3])
    inside = is_inside(cx + vx, cy + vy, qx, qy, centre_inside, edges, e0, e1)
    if n == 0 and not inside:
        return m
    inside = inside if before % 2 == 0 else not inside
    vx, vy = point_at(0.5 * (u0 + u1), r, quadrant)
    reach = math.sqrt(
        max((vx - from_x) ** 2 + (vy - from_y) ** 2, (vx - to_x) ** 2 + (vy - to_y) ** 2)
    )
    reach *= 1.0 + TANGENT
    depth, whole = base, base
    for j in range(k):
        if j != i:
            starts, all_of_it, n = disc_events(
                i, j, near, quadrant, u0, u1, cx + vx, cy + vy, reach, events, n
            )
            depth += near[j, 3] if starts else 0.0
            whole += near[j, 3] if all_of_it else 0.0
            if whole >= 3.0:
                return m
    sort_events(events, n)
    px, py = cx + from_x, cy + from_y
    for e in range(n + 1):
        x, y = (events[e, 2], events[e, 3]) if e < n else (cx + to_x, cy + to_y)
        if inside and depth < 2.5:
            if m >= out.shape[0]:
                return -1
            out[m, 0], out[m, 1], out[m, 2], out[m, 3] = px, py, x, y
            out[m, 4], out[m, 5], out[m, 6], out[m, 7] = r, depth, depth + near[i, 3], near[i, 4]
            m += 1
        if e < n and events[e, 1] == 0.0:
            inside = not inside
        elif e < n:
            depth += events[e, 1]
        px, py = x, y
    return m


@compiled
def sweep_edge(near, k, base, edges, e, events, out, m):
    """Write the covered parts of one transit edge with their depth; return their number."""
    ax, ay, bx, by = edges[e, 0], edges[e, 1], edges[e, 2], edges[e, 3]
    depth, n = base, 0
    for j in range(k):
        weight = near[j, 3]
        starts_in, count, enter, leave = edge_crossings(
            ax, ay, bx, by, near[j, 0], near[j, 1], near[j, 2]
        )
        depth += weight if starts_in else 0.0
        if count == 2 or (count == 1 and not starts_in):
            px, py = ax + enter * (bx - ax), ay + enter * (by - ay)
            n = add_event(events, n, enter, weight, px, py)
        if count == 2 or (count == 1 and starts_in):
            px, py = ax + leave * (bx - ax), ay + leave * (by - ay)
            n = add_event(events, n, leave, -weight, px, py)
    sort_events(events, n)
    px, py = ax, ay
    for i in range(n + 1):
        x, y = (events[i, 2], events[i, 3]) if i < n else (bx, by)
        if depth > 0.5:
            if m >= out.shape[0]:
                return -1
            out[m, 0], out[m, 1], out[m, 2], out[m, 3] = px, py, x, y
            out[m, 4], out[m, 5], out[m, 6], out[m, 7] = 0.0, 0.0, depth, -1.0
            m += 1
        if i < n:
            depth += events[i, 1]
        px, py = x, y
    return m


@compiled
def sweep_cell(near, k, base, box, centre_inside, edges, e0, e1, events, out):
    """Write every level boundary of one cell to ``out``; return their number, -1 if too many.

    Parameters
    ----------
    near : (>= k, 5) discs whose circle may cross the cell: x, y, radius, weight, index
    base : depth of the discs that cover the whole cell
    box : x and y of the cell's lower left and upper right corner
    edges, e0, e1 : the transit edges of the cell are ``edges[e0:e1]``
    events : (>= 2 k + 2 (e1 - e0) + 2, 4) working space
    out : (capacity, 8) rows of start x, y, end x, y, radius (0 for an edge), depth on the right,
        depth on the left, disc (-1 for an edge)
    """
    m = 0
    for i in range(k):
        for quadrant in range(4):
            m = sweep_quadrant(
                i, near, k, base, quadrant, box, centre_inside, edges, e0, e1, events, out, m
            )
            if m < 0:
                return -1
    for e in range(e0, e1):
        m = sweep_edge(near, k, base, edges, e, events, out, m)
        if m < 0:
            return -1
    return m


@compiled
def gather(qx, qy, half, discs, shape, place, first, near, k):
    """Find the discs that matter within ``half`` of q, nearest ring of grid cells first.

    Returns the depth of the discs that cover all of it, and how many others reach it; these are
    written to ``near``. Stops at depth 3. Their number is -1 when ``near`` is too small.
    """
    base = 0.0
    for c in range(shape.shape[0]):
        columns, rows, offset = shape[c, 0], shape[c, 1], shape[c, 2]
        size, reach = place[c, 2], place[c, 3] + half
        column, row = int((qx - place[c, 0]) // size), int((qy - place[c, 1]) // size)
        for ring in range(int(reach // size) + 2):
            for y in range(max(row - ring, 0), min(row + ring, rows - 1) + 1):
                step = 1 if abs(y - row) == ring or ring == 0 else 2 * ring
                for x in range(column - ring, column + ring + 1, step):
                    if 0 <= x < columns:
                        at = offset + y * columns + x
                        base, k = gather_cell(
                            qx, qy, half, discs, first[at], first[at + 1], near, base, k
                        )
                        if base >= 3.0 or k < 0:
                            return base, k
    return base, k


@compiled
def gather_cell(qx, qy, half, discs, d0, d1, near, base, k):
    """Sort the discs of one grid cell into those that cover, cross, and miss; see ``gather``."""
    for d in range(d0, d1):
        r = discs[d, 2]
        squared = (discs[d, 0] - qx) ** 2 + (discs[d, 1] - qy) ** 2
        if squared >= (r + half) ** 2:
            continue
        if r > half and squared <= (r - half) ** 2:
            base += discs[d, 3]
            if base >= 3.0:
                return base, k
            continue
        if k >= near.shape[0]:
            return base, -1
        near[k, 0], near[k, 1], near[k, 2] = discs[d, 0], discs[d, 1], r
        near[k, 3], near[k, 4] = discs[d, 3], np.float64(d)
        k += 1
    return base, k

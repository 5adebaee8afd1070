"""The level boundaries on one quarter circle, and on one transit edge, within a grid cell.

Which side a stretch lies on is asked in the middle of its longest free part, never near a
crossing: rounding can therefore misjudge only slivers of rounding's own size.
"""

# mypy: disable-error-code="no-untyped-def,no-untyped-call"

from __future__ import annotations

import math

import numpy as np

from covertool.coverage.compiled import borrowing, inlined
from covertool.coverage.crossings import (
    CROSSING,
    FIRST_WITHIN,
    SECOND_WITHIN,
    TANGENT,
    circle_crossings,
    edge_crossings,
    is_inside,
    point_at,
    quadrant_of,
    turned,
)


@inlined
def add_event(events, n, u, change, px, py):
    """Write one event (place, change of depth or 0 for a transit edge, point); return n + 1."""
    events[n, 0], events[n, 1], events[n, 2], events[n, 3] = u, change, px, py
    return n + 1


@inlined
def move_event(events, source, target):
    """Copy one event number by number; copying a row would make a temporary array."""
    events[target, 0], events[target, 1] = events[source, 0], events[source, 1]
    events[target, 2], events[target, 3] = events[source, 2], events[source, 3]


@borrowing
def sort_events(events, n):
    """Sort the first n events by their place (Shell's method: few of them, nearly sorted)."""
    gap = 1
    while gap < n // 3:
        gap = 3 * gap + 1
    while gap > 0:
        for i in range(gap, n):
            at = events[i, 0]
            j = i
            if events[j - gap, 0] > at:
                kind, px, py = events[i, 1], events[i, 2], events[i, 3]
                while j >= gap and events[j - gap, 0] > at:
                    move_event(events, j - gap, j)
                    j -= gap
                add_event(events, j, at, kind, px, py)
        gap //= 3


@inlined
def longest_gap(u0, u1, events, n0, n):
    """Return the middle of the longest free part between sorted events, and how many precede."""
    best, middle, before, last = -1.0, 0.5 * (u0 + u1), 0, u0
    for i in range(n0, n + 1):
        here = events[i, 0] if i < n else u1
        if here - last > best:
            best, middle, before = here - last, 0.5 * (here + last), i - n0
        last = here
    return middle, before


@inlined
def transit_events(i, near, quadrant, u0, u1, hits, events):
    """Write the places where transit edges cross an arc of disc i; return their number."""
    n, h = 0, int(near[i, 5])
    while h >= 0:
        px, py = hits[h, 0], hits[h, 1]
        x, y = px - near[i, 0], py - near[i, 1]
        if quadrant_of(x, y) == quadrant:
            x, y = turned(x, y, quadrant)
            if u0 <= y - x < u1:
                n = add_event(events, n, y - x, 0.0, px, py)
        h = int(hits[h, 2])
    sort_events(events, n)
    return n


@inlined
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
    if n == first:
        covers = squared < other * other
        return covers, covers, n
    if n - first == 2 and events[first, 0] > events[first + 1, 0]:
        u, px, py = events[first, 0], events[first, 2], events[first, 3]
        move_event(events, first + 1, first)
        add_event(events, first + 1, u, weight, px, py)
    middle, before = longest_gap(u0, u1, events, first, n)
    vx, vy = point_at(middle, r, quadrant)
    covers = (cx + vx - ox) ** 2 + (cy + vy - oy) ** 2 < other * other
    covers_start = covers if before % 2 == 0 else not covers
    covered = covers_start
    for e in range(first, n):
        events[e, 1] = -weight if covered else weight
        covered = not covered
    return covers_start, False, n


@borrowing
def sweep_arc(
    i, near, k, base, quadrant, u0, u1, from_x, from_y, to_x, to_y,
    qx, qy, centre_inside, edges, e0, e1, hits, events, out, m,
):  # fmt: skip
    """Write the level boundaries on one quarter of circle i in a cell; return their number.

    ``quadrant_in_cell`` describes the arc from u0 on; q is the centre of the cell.
    """
    cx, cy, r = near[i, 0], near[i, 1], near[i, 2]
    n = transit_events(i, near, quadrant, u0, u1, hits, events)
    middle, before = longest_gap(u0, u1, events, 0, n)
    vx, vy = point_at(middle, r, quadrant)
    inside = is_inside(cx + vx, cy + vy, qx, qy, centre_inside, edges, e0, e1)
    if n == 0 and not inside:
        return m
    inside = inside if before % 2 == 0 else not inside
    px, py, end_x, end_y = cx + from_x, cy + from_y, cx + to_x, cy + to_y
    if not inside:
        u0, px, py = events[0, 0], events[0, 2], events[0, 3]
        n -= 1
        for e in range(n):
            move_event(events, e + 1, e)
    if n % 2 == 1:
        n -= 1
        u1, end_x, end_y = events[n, 0], events[n, 2], events[n, 3]
    inside = True
    vx, vy = point_at(0.5 * (u0 + u1), r, quadrant)
    mid_x, mid_y = cx + vx, cy + vy
    reach = (1.0 + TANGENT) * math.sqrt(
        max((mid_x - px) ** 2 + (mid_y - py) ** 2, (mid_x - end_x) ** 2 + (mid_y - end_y) ** 2)
    )
    depth, whole = base, base
    for j in range(k):
        if j != i:
            starts, all_of_it, n = disc_events(
                i, j, near, quadrant, u0, u1, mid_x, mid_y, reach, events, n
            )
            depth += near[j, 3] if starts else 0.0
            whole += near[j, 3] if all_of_it else 0.0
            if whole >= 3.0:
                return m
    sort_events(events, n)
    for e in range(n + 1):
        x, y = (events[e, 2], events[e, 3]) if e < n else (end_x, end_y)
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


@borrowing
def sweep_edge(near, k, base, edges, e, hits, h, events, out, m):
    """Write the parts of one transit edge with their depth; return their number.

    Every place where a circle crosses the edge is also noted in ``hits`` for that circle; the
    number of hits so far is returned too.
    """
    ax, ay, bx, by = edges[e, 0], edges[e, 1], edges[e, 2], edges[e, 3]
    depth, n = base, 0
    if h + 2 * k > hits.shape[0]:
        return -1, h
    for j in range(k):
        weight = near[j, 3]
        starts_in, count, enter, leave = edge_crossings(
            ax, ay, bx, by, near[j, 0], near[j, 1], near[j, 2]
        )
        depth += weight if starts_in else 0.0
        if count == 2 or (count == 1 and not starts_in):
            px, py = ax + enter * (bx - ax), ay + enter * (by - ay)
            n = add_event(events, n, enter, weight, px, py)
            h = add_hit(hits, h, near, j, px, py)
        if count == 2 or (count == 1 and starts_in):
            px, py = ax + leave * (bx - ax), ay + leave * (by - ay)
            n = add_event(events, n, leave, -weight, px, py)
            h = add_hit(hits, h, near, j, px, py)
    sort_events(events, n)
    px, py = ax, ay
    for i in range(n + 1):
        x, y = (events[i, 2], events[i, 3]) if i < n else (bx, by)
        if m >= out.shape[0]:
            return -1, h
        out[m, 0], out[m, 1], out[m, 2], out[m, 3] = px, py, x, y
        out[m, 4], out[m, 5], out[m, 6], out[m, 7] = 0.0, 0.0, depth, -1.0
        m += 1
        if i < n:
            depth += events[i, 1]
        px, py = x, y
    return m, h


@inlined
def add_hit(hits, h, near, j, px, py):
    """Note that disc j crosses a transit edge in p, before its earlier hits; return h + 1."""
    hits[h, 0], hits[h, 1], hits[h, 2] = px, py, near[j, 5]
    near[j, 5] = np.float64(h)
    return h + 1

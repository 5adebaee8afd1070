"""Suppression of double detections, decided in each vehicle's own frame."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from covertool.extract.detectors.protocol import Detections
from covertool.model import Floats

ALONG_M, ACROSS_M = 2.4, 1.25
"""Two cars cannot have their centres nearer than this, nose to tail and side by side."""

_SAME_BODY = 0.42
"""Share of a long vehicle's length and width, from its centre, in which no other centre lies."""


def oriented_nms(
    x_m: Floats,
    y_m: Floats,
    heading_deg: Floats,
    length_m: Floats,
    width_m: Floats,
    score: Floats,
    *,
    along_m: float = ALONG_M,
    across_m: float = ACROSS_M,
) -> npt.NDArray[np.bool_]:
    """Return which detections stay when none may lie within the body of a better one.

    A detection falls when its centre, seen in the frame of one with a higher score, is nearer than
    ``max(along_m, 0.42 length)`` ahead or behind and ``max(across_m, 0.42 width)`` to the side. An
    overlap of boxes would not do: cars in neighbouring bays at an angle overlap, doubles of a
    long van may not.

    Parameters
    ----------
    x_m, y_m : (N,) centres, x to the right and y down
    heading_deg : (N,) long axis, clockwise from up
    length_m, width_m, score : (N,)
    along_m, across_m : least distances of two centres

    Returns
    -------
    (N,) bool

    Examples
    --------
    >>> import numpy as np
    >>> x, y = np.array([0.0, 0.5, 2.5]), np.zeros(3)
    >>> up, size = np.zeros(3), np.full(3, 1.8)
    >>> oriented_nms(x, y, up, 2.5 * size, size, np.array([0.9, 0.8, 0.7])).tolist()
    [True, False, True]
    """
    from scipy.spatial import cKDTree

    count = x_m.size
    keep = np.ones(count, dtype=bool)
    if count < 2:
        return keep
    half_length = np.maximum(along_m, _SAME_BODY * length_m)
    half_width = np.maximum(across_m, _SAME_BODY * width_m)
    centres = np.stack([x_m, y_m], axis=1)
    near = cKDTree(centres).query_ball_point(centres, np.hypot(half_length, half_width))
    angle = np.radians(heading_deg)
    ahead = np.stack([np.sin(angle), -np.cos(angle)], axis=1)
    for best in np.argsort(-score, kind="stable"):
        if not keep[best]:
            continue
        others = np.array([i for i in near[best] if i != best and keep[i]], dtype=int)
        offset = centres[others] - centres[best]
        along = np.abs(offset @ ahead[best])
        across = np.abs(offset @ np.array([-ahead[best, 1], ahead[best, 0]]))
        weaker = (score[others] < score[best]) | ((score[others] == score[best]) & (others > best))
        inside = (along < half_length[best]) & (across < half_width[best])
        keep[others[inside & weaker]] = False
    return keep


def without_doubles(found: Detections, gsd_m: float) -> Detections:
    """Return the detections of one picture, best first, without those inside a better one.

    >>> twice = Detections.of_cars([9, 10], [9, 9], [0, 0], [22, 22], [9, 9], [1.0, 0.9])
    >>> len(without_doubles(twice, 0.2))
    1
    """
    keep = oriented_nms(
        found.x_px * gsd_m,
        found.y_px * gsd_m,
        found.heading_deg,
        found.length_px * gsd_m,
        found.width_px * gsd_m,
        found.score,
    )
    order = np.argsort(-found.score, kind="stable")
    return found.take(order[keep[order]])

"""Queued cars as anchors: cars synthesised from the stop line backwards, lane by lane."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt
import shapely

from covertool.congestion.fill import QUEUE_SHARE, SPACING_M
from covertool.congestion.streets import Streets
from covertool.errors import OptionError
from covertool.model import Anchors, Floats, Integers, Objects

CAR_M = 5.0
STOP_GAP_M = 1.0
"""From the stop line to the front of the first car."""
LANE_WIDTH_M = 3.25

Side = Literal["left", "right"]


@dataclass(frozen=True)
class QueueOptions:
    """How queues are laid out.

    Attributes
    ----------
    shares : share of a segment's length that queued cars fill, by status
    drive : the side of the road on which traffic runs
    lane_width_m : width of a lane
    stop_line_m : from the stop line to the end of the segment, which is drawn to the junction's
        middle
    seed : of the rounding of queues that are only known as a share
    """

    shares: Mapping[str, float] = field(default_factory=lambda: dict(QUEUE_SHARE))
    drive: Side = "left"
    lane_width_m: float = LANE_WIDTH_M
    stop_line_m: float = 0.0
    seed: int = 1

    def __post_init__(self) -> None:
        if self.drive not in ("left", "right"):
            raise OptionError(
                f"traffic does not drive on the {self.drive!r}",
                "--driving-side",
                "use left or right",
            )
        if not (self.lane_width_m > 0 and self.stop_line_m >= 0):
            raise OptionError(
                "a length is out of range",
                f"lane width {self.lane_width_m} m, stop line {self.stop_line_m} m",
                "use a positive lane width and a stop line at or before the segment's end",
            )


def cars_in_queue(queue_m: npt.ArrayLike) -> Integers:
    """Return how many cars stand in a queue of a measured length.

    n cars take 1.0 m to the stop line, n - 1 spacings of 7.5 m and the last car's 5.0 m, together
    7.5 n - 1.5 m; so ``n = floor((L + 1.5) / 7.5)``.

    Parameters
    ----------
    queue_m : array
        From the stop line to the rear of the last car, in metres.

    Examples
    --------
    >>> cars_in_queue([5.9, 6.0, 13.5, 30.0]).tolist()
    [0, 1, 2, 4]
    """
    surplus = SPACING_M - CAR_M - STOP_GAP_M
    length = np.asarray(queue_m, dtype=float)
    # A hair of slack: 13.5 m written as 13.499999999999998 still holds two cars.
    return np.floor((length + surplus) / SPACING_M + 1e-9).clip(min=0).astype(np.int64)


def queue_anchors(
    network: Streets,
    status: Objects,
    queue_m: Floats,
    options: QueueOptions | None = None,
) -> tuple[Anchors, Objects]:
    """Return the queued cars of a network as anchors, and the segment each stands on.

    Each lane of a segment holds its own queue. A measured queue has ``cars_in_queue`` cars; else
    the status's share of the length divided by 7.5 m, rounded up or down at random so that the
    mean is kept. No queue is longer than its segment. The cars are synthetic.

    Parameters
    ----------
    network : Streets
        Directed pieces; traffic stops at the end of each line.
    status : (N,) object array
        The status of each piece.
    queue_m : (N,) array
        The measured queue of each piece in metres, NaN for none.
    options : QueueOptions

    Examples
    --------
    >>> import geopandas as gpd
    >>> from covertool.congestion.streets import streets
    >>> line = shapely.LineString([(0, 0), (100, 0)])
    >>> net = streets(gpd.GeoDataFrame({"segment_id": ["a"]}, geometry=[line], crs=2157))
    >>> cars, where = queue_anchors(net, np.array(["slow"], dtype=object), np.array([14.0]))
    >>> cars.x_m.tolist(), cars.origin.tolist()
    ([96.5, 89.0], ['queue', 'queue'])
    """
    chosen = options or QueueOptions()
    piece, lane, count = _lane_counts(network, status, queue_m, chosen)
    owner = np.repeat(np.arange(count.size), count)
    place = np.arange(owner.size) - np.repeat(np.cumsum(count) - count, count)
    piece_of, lane_of = piece[owner], lane[owner]
    back_m = chosen.stop_line_m + STOP_GAP_M + CAR_M / 2 + SPACING_M * place
    along_m = shapely.length(network.line)[piece_of] - back_m
    aside_m = _aside(network, piece_of, lane_of, chosen)
    x, y = _beside(network.line[piece_of], along_m, aside_m)
    names = zip(network.segment_id[piece_of], lane_of, place, strict=True)
    cars = Anchors.from_points(x, y, network.crs, origin="queue")
    ids = [f"queue-{segment}-{which}-{number + 1}" for segment, which, number in names]
    columns = {**cars.columns(), "id": _unique(ids)}
    return Anchors(**columns, crs=network.crs), network.segment_id[piece_of]


def _lane_counts(
    network: Streets, status: Objects, queue_m: Floats, options: QueueOptions
) -> tuple[Integers, Integers, Integers]:
    """Return piece, lane and number of cars for each lane of each piece."""
    lanes = network.lanes.astype(np.int64)
    piece = np.repeat(np.arange(len(network)), lanes)
    lane = np.arange(piece.size) - np.repeat(np.cumsum(lanes) - lanes, lanes)
    # Cars stand on the line as it is drawn, whatever length it declares.
    drawn_m = shapely.length(network.line)
    room_m = drawn_m - options.stop_line_m
    share = np.array([options.shares[word] for word in status.tolist()])
    chance = np.random.default_rng(options.seed).random(piece.size)
    expected = (share * drawn_m)[piece] / SPACING_M
    by_status = np.floor(expected + chance).astype(np.int64)
    measured = cars_in_queue(np.nan_to_num(queue_m))[piece]
    count = np.where(np.isfinite(queue_m)[piece], measured, by_status)
    return piece, lane, np.minimum(count, cars_in_queue(room_m)[piece])


def _aside(
    network: Streets,
    piece: Integers,
    lane: Integers,
    options: QueueOptions,
) -> Floats:
    """Return how far to the right of the line each lane's middle lies, in metres.

    A two-way street is drawn by one line in its middle, so its lanes lie on the driving side; the
    lanes of a one-way street lie about the line.
    """
    width = options.lane_width_m
    side = 1.0 if options.drive == "right" else -1.0
    two_way = side * (lane + 0.5) * width
    one_way = (lane + 0.5 - network.lanes[piece] / 2) * width
    return np.where(network.two_way[piece], two_way, one_way)


def _beside(lines: Objects, along_m: Floats, aside_m: Floats) -> tuple[Floats, Floats]:
    """Return the points at a distance along each line and to the right of it."""
    half = 0.5
    x0, y0 = _xy(lines, along_m - half)
    x1, y1 = _xy(lines, along_m + half)
    x, y = _xy(lines, along_m)
    length = np.hypot(x1 - x0, y1 - y0)
    length[length == 0] = 1.0
    return x + aside_m * (y1 - y0) / length, y - aside_m * (x1 - x0) / length


def _xy(lines: Objects, along_m: Floats) -> tuple[Floats, Floats]:
    points = shapely.line_interpolate_point(lines, np.maximum(along_m, 0.0))
    return shapely.get_x(points), shapely.get_y(points)


def _unique(ids: list[str]) -> Objects:
    """Return ids of which none is given twice: a segment may consist of several pieces."""
    seen: dict[str, int] = {}
    unique = []
    for name in ids:
        seen[name] = seen.get(name, 0) + 1
        unique.append(name if seen[name] == 1 else f"{name}.{seen[name]}")
    return np.array(unique, dtype=object)

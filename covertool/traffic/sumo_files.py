"""Files for SUMO: parked cars and coverage as additional file, estimates as floating car data."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TextIO
from xml.sax.saxutils import quoteattr

import numpy as np
import shapely

from covertool.errors import OptionError
from covertool.gis import guard
from covertool.gis.formats import Format
from covertool.gis.styles import LEVEL_COLOURS, PARKED_COLOUR, rgb
from covertool.model import Anchors, Floats, Objects, PositionTracks, Trace
from covertool.traffic.network import Network
from covertool.traffic.trace import CAR_LENGTH_M

ADDITIONAL_FORMATS = (Format("SUMO additional file", "", (".add.xml", ".xml")),)
FCD_FORMATS = (Format("SUMO FCD", "", (".xml",)),)
_LEVEL_OPACITY = 160
_HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'


def write_additional(
    path: str | Path,
    anchors: Anchors,
    levels: Mapping[int, shapely.MultiPolygon],
    *,
    network: Network | None = None,
    overwrite: bool = False,
) -> None:
    """Write anchors as POIs and coverage levels as polygons, in the coordinates of the net.

    SUMO's polygons have no holes, so that a region with holes is cut through them.

    Parameters
    ----------
    levels : regions of Levels 1, 2 and 3 in the CRS of the anchors
    network : whose coordinates to write; those of the anchors' CRS when None
    """
    target, _ = guard.output_file(path, ADDITIONAL_FORMATS, overwrite=overwrite)
    with guard.replacing(target) as temporary, _text(temporary) as file:
        file.write(f"{_HEAD}<additional>\n")
        file.writelines(_polygons(levels, network))
        file.writelines(_pois(anchors, network))
        file.write("</additional>\n")


def _pois(anchors: Anchors, network: Network | None) -> Iterator[str]:
    x, y = _in_net(anchors.x_m, anchors.y_m, network)
    for name, origin, px, py in zip(anchors.id, anchors.origin, x, y, strict=True):
        yield (
            f"    <poi id={quoteattr(f'anchor {name}')} type={quoteattr(f'anchor.{origin}')} "
            f'color="{_colour(PARKED_COLOUR)}" layer="100" x="{px:.3f}" y="{py:.3f}"/>\n'
        )


def _polygons(levels: Mapping[int, shapely.MultiPolygon], network: Network | None) -> Iterator[str]:
    for level, region in levels.items():
        parts = [part for whole in _polygon_parts(region) for part in without_holes(whole)]
        for number, part in enumerate(parts, 1):
            ring = shapely.get_coordinates(part.exterior)
            x, y = _in_net(ring[:, 0], ring[:, 1], network)
            shape = " ".join(f"{px:.2f},{py:.2f}" for px, py in zip(x, y, strict=True))
            yield (
                f'    <poly id="level {level} part {number}" type="coverage.level_{level}" '
                f'color="{_colour(LEVEL_COLOURS[level])},{_LEVEL_OPACITY}" fill="1" layer="-1" '
                f'shape="{shape}"/>\n'
            )


def _colour(colour: str) -> str:
    """Return #rrggbb as SUMO writes it."""
    return ",".join(map(str, rgb(colour)))


def without_holes(polygon: shapely.Polygon) -> list[shapely.Polygon]:
    """Return polygons without holes that together are the given one: it is cut at its holes.

    >>> ring = shapely.box(0, 0, 9, 9).difference(shapely.box(4, 4, 5, 5))
    >>> parts = without_holes(ring)
    >>> sum(part.area for part in parts), any(part.interiors for part in parts)
    (80.0, False)
    """
    if not polygon.interiors:
        return [polygon]
    x0, y0, x1, y1 = polygon.bounds
    holes = sorted(float(shapely.Polygon(ring).centroid.x) for ring in polygon.interiors)
    cut = holes[len(holes) // 2]
    halves = (shapely.box(x0, y0, cut, y1), shapely.box(cut, y0, x1, y1))
    return [
        whole
        for half in halves
        for part in _polygon_parts(polygon.intersection(half))
        for whole in without_holes(part)
    ]


def _polygon_parts(geometry: shapely.Geometry) -> list[shapely.Polygon]:
    parts = shapely.get_parts(geometry)
    return [part for part in parts if isinstance(part, shapely.Polygon) and not part.is_empty]


def write_estimated_fcd(
    path: str | Path,
    tracks: PositionTracks,
    trace: Trace,
    *,
    network: Network | None = None,
    overwrite: bool = False,
) -> None:
    """Write the estimates of the first run as SUMO's floating car data in XML.

    SUMO gives the front bumper: half the length of a car ahead of its centre, along its heading.

    Parameters
    ----------
    tracks : estimates; a car is left out where it has diverged
    trace : the true velocities, which give heading and speed
    network : whose coordinates to write; those of the working CRS when None
    """
    target, _ = guard.output_file(path, FCD_FORMATS, overwrite=overwrite)
    rows = np.flatnonzero((tracks.run == 0) & np.isfinite(tracks.estimated_x_m))
    if not rows.size:
        raise OptionError("there is no estimate to write", str(target), "look at the divergences")
    first = tracks.take(rows)
    angle, speed = _headings(first, trace)
    ahead = CAR_LENGTH_M / 2 * np.stack([np.sin(np.radians(angle)), np.cos(np.radians(angle))])
    x, y = _in_net(first.estimated_x_m + ahead[0], first.estimated_y_m + ahead[1], network)
    with guard.replacing(target) as temporary, _text(temporary) as file:
        file.write(f"{_HEAD}<fcd-export>\n")
        file.writelines(_timesteps(first.time_s, first.vehicle, x, y, angle, speed))
        file.write("</fcd-export>\n")


def _timesteps(
    time_s: Floats, vehicle: Objects, x: Floats, y: Floats, angle: Floats, speed: Floats
) -> Iterator[str]:
    """Yield the lines of each step; rows come in the order of time."""
    starts = np.flatnonzero(np.diff(time_s, prepend=np.nan) != 0)
    for start, stop in zip(starts, [*starts[1:], time_s.size], strict=True):
        yield f'    <timestep time="{time_s[start]:.2f}">\n'
        for i in range(start, stop):
            yield (
                f"        <vehicle id={quoteattr(str(vehicle[i]))} "
                f'x="{x[i]:.2f}" y="{y[i]:.2f}" angle="{angle[i]:.2f}" type="estimate" '
                f'speed="{speed[i]:.2f}"/>\n'
            )
        yield "    </timestep>\n"


def _headings(tracks: PositionTracks, trace: Trace) -> tuple[Floats, Floats]:
    """Return angle (clockwise from north, degrees) and speed of each row, true ones.

    A car that stands keeps the heading that it had, or the first that it gets.
    """
    import pandas as pd

    speed = np.hypot(trace.vx, trace.vy)
    angle = np.degrees(np.arctan2(trace.vx, trace.vy)) % 360
    frame = pd.DataFrame(
        {
            "vehicle": trace.vehicle.astype(str),
            "time_s": trace.time_s,
            "angle": np.where(speed > 0, angle, np.nan),
            "speed": speed,
        }
    ).sort_values(["vehicle", "time_s"])
    frame["angle"] = frame.groupby("vehicle")["angle"].ffill()
    frame["angle"] = frame.groupby("vehicle")["angle"].bfill().fillna(0.0)
    rows = pd.MultiIndex.from_arrays([tracks.vehicle.astype(str), tracks.time_s])
    found = frame.set_index(["vehicle", "time_s"]).loc[rows]
    return found["angle"].to_numpy(dtype=float), found["speed"].to_numpy(dtype=float)


def _in_net(x_m: Floats, y_m: Floats, network: Network | None) -> tuple[Floats, Floats]:
    return (x_m, y_m) if network is None else network.projection.to_net(x_m, y_m)


def _text(path: Path) -> TextIO:
    return path.open("w", encoding="utf-8", newline="\n")

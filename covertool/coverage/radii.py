"""Anchors to discs: which radius each has, and whether the coordinates can be used."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from covertool.dsrc import DEVICE_CLASSES, device_class
from covertool.errors import ColumnError, CrsError, GeometryError, OptionError
from covertool.model import Anchors, Floats, TransitArea

Radius = float | str | None
"""Metres, a device class (A to D), or None for each anchor's own radius or class."""

LARGEST_RADIUS_M = 1e6
"""Beyond any radio, and beyond what one map projection can show."""


@dataclass(frozen=True)
class Radii:
    """The radius of every anchor, and what to call it in a report.

    Attributes
    ----------
    each_m : (N,) radius of every anchor in metres
    radius_m : the common radius, or None when several are mixed
    device_class : the common device class, or None
    """

    each_m: Floats
    radius_m: float | None
    device_class: str | None


def radii_of(anchors: Anchors, radius: Radius) -> Radii:
    """Return the radius of every anchor for what the user asked.

    Raises
    ------
    OptionError
        When a radius is not a positive number, or the class is none of A to D.
    ColumnError
        When anchors' own radii are asked for and some have neither a radius nor a class.

    Examples
    --------
    >>> from pyproj import CRS
    >>> radii_of(Anchors.from_points([0.0, 1.0], [0.0, 0.0], CRS(2157)), "B").each_m.tolist()
    [100.0, 100.0]
    """
    if radius is None:
        return _own_radii(anchors)
    if isinstance(radius, str):
        chosen = device_class(radius)
        return Radii(np.full(len(anchors), chosen.radius_m), chosen.radius_m, chosen.name)
    if not 0 < radius <= LARGEST_RADIUS_M:
        raise OptionError(
            f"a radius of {radius:g} m is not possible",
            "radius",
            f"use metres above zero, up to {LARGEST_RADIUS_M:,.0f}",
        )
    return Radii(np.full(len(anchors), float(radius)), float(radius), None)


def check_anchors(anchors: Anchors, transit: TransitArea) -> None:
    """Raise when anchors and transit area do not share a CRS, or a coordinate is not finite."""
    if anchors.crs != transit.crs:
        raise CrsError(
            "the anchors and the transit area are in different coordinate reference systems",
            f"{anchors.crs.name} and {transit.crs.name}",
            "transform one of them with covertool.crs, or pass --dst-crs",
        )
    check_points(anchors.x_m, anchors.y_m)


def check_points(x_m: Floats, y_m: Floats) -> None:
    """Raise GeometryError when a coordinate is not a finite number."""
    bad = np.flatnonzero(~(np.isfinite(x_m) & np.isfinite(y_m)))
    if bad.size:
        raise GeometryError(
            f"{bad.size} anchors have coordinates that are not finite numbers",
            f"anchor row {bad[0] + 1}: x {x_m[bad[0]]}, y {y_m[bad[0]]}",
            "remove these rows or repair their coordinates",
        )


def check_radii(radius_m: Floats) -> None:
    """Raise GeometryError when a radius is not above zero, or beyond any radio and projection."""
    bad = np.flatnonzero(~((radius_m > 0) & (radius_m <= LARGEST_RADIUS_M)))
    if bad.size:
        raise GeometryError(
            f"{bad.size} radii are not possible",
            f"anchor row {bad[0] + 1}: radius {radius_m[bad[0]]} m",
            f"give every anchor a radius above 0 m, up to {LARGEST_RADIUS_M:,.0f} m",
        )


def _own_radii(anchors: Anchors) -> Radii:
    """Return the radius that each anchor names, itself or by its class."""
    each = np.array(anchors.radius_m, dtype=float)
    classes = np.array(anchors.device_class, dtype=object)
    classes[np.isfinite(each)] = None
    for name in {str(c) for c in classes if c is not None}:
        each[classes == name] = device_class(name).radius_m
    missing = np.flatnonzero(np.isnan(each))
    if missing.size:
        names = ", ".join(f"{c.name} {c.radius_m:g} m" for c in DEVICE_CLASSES.values())
        raise ColumnError(
            f"{missing.size} of {len(anchors)} anchors have neither a radius_m nor a device_class",
            f"anchor {anchors.id[missing[0]]}",
            f"fill column radius_m or device_class ({names}), or pass --radius METRES",
        )
    check_radii(each)
    same_radius = each.size > 0 and bool(np.all(each == each[0]))
    same_class = same_radius and classes[0] is not None and bool(np.all(classes == classes[0]))
    return Radii(
        each, float(each[0]) if same_radius else None, str(classes[0]) if same_class else None
    )

"""What `covertool coverage` was asked for in numbers: radii, nodes of a curve, shares."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from covertool.cli.console import say

if TYPE_CHECKING:
    from covertool.coverage.radii import Radius
    from covertool.model import Anchors

DEFAULT_RADIUS_M = 15.0
OWN = "own"


def asked_radii(radius: list[str] | None, classes: list[str] | None) -> list[Radius]:
    """Return the radii that the options name; none when they name none."""
    asked: list[Radius] = [
        None if text.strip().lower() == OWN else _number(text, "--radius") for text in radius or []
    ]
    return asked + [name.strip().upper() for name in classes or []]


def choose_radii(
    radius: list[str] | None, classes: list[str] | None, anchors: Anchors
) -> list[Radius]:
    """Return the radii that the options ask for, or the default, which is told."""
    from covertool.coverage.radii import radii_of
    from covertool.errors import ColumnError

    asked = asked_radii(radius, classes)
    if asked:
        return asked
    try:
        radii_of(anchors, None)
    except ColumnError:
        return default_radii(all_own=False)
    return default_radii(all_own=len(anchors) > 0)


def default_radii(all_own: bool) -> list[Radius]:
    """Return the radii for options that name none, and say which on stderr."""
    if all_own:
        say("no --radius was given: using each anchor's own radius or device class")
        return [None]
    say(f"no --radius was given: using {DEFAULT_RADIUS_M:g} m (device class A)")
    return [DEFAULT_RADIUS_M]


def shares_of(text: str | None) -> list[float]:
    """Return the shares of a list with commas; none without a text.

    >>> shares_of("0.05,0.1")
    [0.05, 0.1]
    """
    return [_number(part, "--penetration") for part in text.split(",")] if text is not None else []


def _number(text: str, option: str) -> float:
    try:
        return float(text)
    except ValueError:
        also = f" (nor '{OWN}')" if option == "--radius" else ""
        raise typer.BadParameter(f"{text!r} is not a number{also}", param_hint=option) from None

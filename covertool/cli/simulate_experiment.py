"""What `covertool simulate` is asked to compare: arms, estimators, noises and zones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import typer

from covertool.cli.coverage_radii import asked_radii
from covertool.cli.simulate_reading import positioning_options

if TYPE_CHECKING:
    from covertool.positioning import PositioningOptions

PRESETS = {"paper": ("gcpso", "ekf"), "best": ("second_order",)}
"""Estimators that run as the paper does, and the one that takes all that can be known."""


@dataclass(frozen=True)
class Experiment:
    """What is compared, and how the paper is read."""

    arms: tuple[str, ...]
    estimators: tuple[str, ...]
    sigmas_m: tuple[float, ...]
    radii_m: tuple[float, ...]
    runs: int
    seed: int
    options: PositioningOptions
    layouts: int
    penetration: float
    vehicles: tuple[str, ...]
    bound: bool


def choose_experiment(
    kind: str,
    *,
    radius: Sequence[str] | None,
    device_class: Sequence[str] | None,
    arms: Sequence[str] | None,
    estimators: Sequence[str] | None,
    preset: str | None,
    sigmas_m: Sequence[float] | None,
    sigma_gps_m: float,
    gps_tau_s: float,
    readings: Sequence[str] | None,
    runs: int,
    seed: int,
    layouts: int,
    penetration: float,
    vehicles: Sequence[str] | None,
    bound: bool,
) -> Experiment:
    """Return what the options ask for; the campus also has the paper's zone of 100 m."""
    from covertool.positioning import ARMS
    from covertool.traffic.simulation import RADII_M, SIGMAS_M

    return Experiment(
        arms=tuple(dict.fromkeys(arms or ARMS)),
        estimators=_estimators(estimators, preset),
        sigmas_m=tuple(dict.fromkeys(sigmas_m or SIGMAS_M)),
        radii_m=_radii_m(radius, device_class) or RADII_M.get(kind, RADII_M["town"]),
        runs=runs,
        seed=seed,
        options=positioning_options(
            readings, sigma_gps_m=sigma_gps_m, gps_tau_s=gps_tau_s, scenario=kind
        ),
        layouts=layouts,
        penetration=penetration,
        vehicles=tuple(vehicles or ()),
        bound=bound,
    )


def estimators_of(preset: str | None) -> tuple[str, ...]:
    """Return the estimators of a preset, or of all.

    >>> estimators_of("paper")
    ('gcpso', 'ekf')
    """
    if preset is None:
        return tuple(name for names in PRESETS.values() for name in names)
    if preset not in PRESETS:
        raise typer.BadParameter(f"use {' or '.join(PRESETS)}", param_hint="--preset")
    return PRESETS[preset]


def _estimators(named: Sequence[str] | None, preset: str | None) -> tuple[str, ...]:
    """Return the estimators that the options name; with a preset they must be among its own."""
    known = estimators_of(preset)
    if not named:
        return known
    if preset is None:
        return tuple(dict.fromkeys(named))
    others = [name for name in named if name not in known and ":" not in name]
    if others:
        raise typer.BadParameter(
            f"{', '.join(others)} does not run by the preset {preset}, which has "
            f"{', '.join(known)}",
            param_hint="--estimator",
        )
    return tuple(dict.fromkeys(named))


def _radii_m(radius: Sequence[str] | None, classes: Sequence[str] | None) -> tuple[float, ...]:
    from covertool.dsrc import device_class

    found = []
    for asked in asked_radii(list(radius or ()), list(classes or ())):
        if asked is None:
            raise typer.BadParameter(
                "a zone is one length for all: name it in metres", param_hint="--radius"
            )
        found.append(device_class(asked).radius_m if isinstance(asked, str) else asked)
    if any(not value > 0 for value in found):
        raise typer.BadParameter("use metres above 0", param_hint="--radius")
    return tuple(dict.fromkeys(found))

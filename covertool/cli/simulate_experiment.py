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

SIGMAS_M = (0.2, 4.0)
"""Range noises of the paper: UWB and radio ranging."""

PRESETS = {"paper": ("gcpso", "ekf"), "best": ("second_order",)}


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


def choose_experiment(
    kind: str,
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
) -> Experiment:
    """Return what the options ask for; the campus also has the paper's zone of 100 m."""
    from covertool.positioning import ARMS

    return Experiment(
        arms=tuple(dict.fromkeys(arms or ARMS)),
        estimators=_estimators(estimators, preset),
        sigmas_m=tuple(dict.fromkeys(sigmas_m or SIGMAS_M)),
        radii_m=_radii_m(radius, device_class) or ((15.0, 100.0) if kind == "campus" else (15.0,)),
        runs=runs,
        seed=seed,
        options=positioning_options(
            readings, sigma_gps_m=sigma_gps_m, gps_tau_s=gps_tau_s, scenario=kind
        ),
    )


def _estimators(named: Sequence[str] | None, preset: str | None) -> tuple[str, ...]:
    if preset is None:
        every = tuple(name for names in PRESETS.values() for name in names)
        return tuple(dict.fromkeys(named or every))
    if preset not in PRESETS:
        raise typer.BadParameter("use paper or best", param_hint="--preset")
    if not named:
        return PRESETS[preset]
    others = [name for name in named if name not in PRESETS[preset] and ":" not in name]
    if others:
        raise typer.BadParameter(
            f"{', '.join(others)} does not run by the preset {preset}, which has "
            f"{', '.join(PRESETS[preset])}",
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

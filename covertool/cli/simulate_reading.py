"""How the paper is read: `--reading NAME=VALUE` becomes the options of the positioning."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from covertool.positioning import PositioningOptions

_WORDS = {
    "velocity": ("previous", "current"),
    "sharing": ("gps", "prediction", "truth"),
    "choice": ("nearest", "measured", "gdop", "all"),
    "gps_noise": ("axis", "radial"),
}
_OWN_OPTION = {"sigma_gps_m": "--sigma-gps", "gps_tau_s": "--gps-tau"}


def positioning_options(
    readings: Sequence[str] | None, *, sigma_gps_m: float, gps_tau_s: float, scenario: str
) -> PositioningOptions:
    """Return the reading that the options ask for.

    Raises
    ------
    typer.BadParameter
        When a reading names nothing or its value does not fit.
    """
    from covertool.positioning import PositioningOptions
    from covertool.traffic.simulation import GPS_RESET_S

    known = {field.name: field for field in dataclasses.fields(PositioningOptions)}
    chosen: dict[str, Any] = {
        "sigma_gps_m": sigma_gps_m,
        "gps_tau_s": gps_tau_s,
        "gps_reset_s": GPS_RESET_S.get(scenario, GPS_RESET_S["town"]),
    }
    for text in readings or []:
        name, equals, value = text.partition("=")
        name = name.strip().replace("-", "_")
        if name in _OWN_OPTION:
            raise _bad(f"{name} has an option of its own: {_OWN_OPTION[name]}")
        if not equals or name not in known:
            names = ", ".join(sorted(set(known) - set(_OWN_OPTION)))
            raise _bad(f"{text!r} is not NAME=VALUE with a NAME of {names}")
        chosen[name] = _value(name, value.strip().lower(), known[name].default)
    return PositioningOptions(**chosen)


def _value(name: str, text: str, default: Any) -> Any:
    """Return a value of the kind that an option takes."""
    if name in _WORDS:
        return _word(name, text, _WORDS[name])
    if isinstance(default, bool):
        return _word(name, text, ("true", "false")) == "true"
    if name == "gps_reset_s" and text == "none":
        return None
    if name == "pseudo_anchor" and text == "covariance":
        return text
    try:
        return int(text) if name == "pseudo_anchor" else float(text)
    except ValueError:
        raise _bad(f"{name}={text} is not a number") from None


def _word(name: str, text: str, words: tuple[str, ...]) -> str:
    if text not in words:
        raise _bad(f"{name} is one of {', '.join(words)}, not {text!r}")
    return text


def _bad(message: str) -> typer.BadParameter:
    return typer.BadParameter(message, param_hint="--reading")

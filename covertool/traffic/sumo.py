"""SUMO as a child process: found, started, watched and checked; never imported."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Sumo:
    """An installed SUMO: its folder, its version and the environment of its child processes."""

    home: Path
    version: str
    environment: Mapping[str, str]


def find_sumo() -> Sumo:
    """Return the SUMO of the ``simulate`` extra.

    Raises
    ------
    MissingExtraError
        When it is not installed, or too old.
    """
    raise NotImplementedError

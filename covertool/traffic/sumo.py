"""SUMO as a child process: found and given its own environment; never imported.

Importing the package ``sumo`` points this process's PROJ at SUMO's database, which is too old for
rasterio. So the package is only looked up, and its programs run as children.
"""

from __future__ import annotations

import importlib.metadata
import importlib.util
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from covertool.errors import MissingExtraError

OLDEST = (1, 24)
"""The first version that writes floating car data as CSV."""
_INSTALL = "pip install 'covertool[simulate]'"
_OURS = ("SUMO_", "PROJ_", "GDAL_", "PYTHON", "LD_")
"""What of our own environment a child must not see: other PROJ data, other libraries."""


@dataclass(frozen=True)
class Sumo:
    """An installed SUMO: its folder, its version and the environment of its child processes."""

    home: Path
    version: str
    environment: Mapping[str, str] = field(repr=False)

    def program(self, name: str) -> str:
        """Return the path of one of its programs.

        Raises
        ------
        MissingExtraError
            When the installation lacks it.
        """
        for path in (self.home / "bin" / name, self.home / "bin" / f"{name}.exe"):
            if path.is_file() and os.access(path, os.X_OK):
                return str(path)
        raise MissingExtraError(
            f"the installed SUMO {self.version} has no program {name}",
            str(self.home),
            f"install it again: {_INSTALL} --force-reinstall",
        )


def find_sumo() -> Sumo:
    """Return the SUMO of the ``simulate`` extra, without importing it.

    Raises
    ------
    MissingExtraError
        When it is not installed, or too old.
    """
    spec = importlib.util.find_spec("sumo")
    folders = list(spec.submodule_search_locations or ()) if spec is not None else []
    home = next((Path(folder) for folder in folders if (Path(folder) / "bin").is_dir()), None)
    if home is None:
        raise MissingExtraError("SUMO is not installed", "the package eclipse-sumo", _INSTALL)
    try:
        version = importlib.metadata.version("eclipse-sumo")
    except importlib.metadata.PackageNotFoundError:
        raise MissingExtraError(
            f"the package sumo in {home} is not the one of PyPI's eclipse-sumo",
            str(home),
            _INSTALL,
        ) from None
    _refuse_old(version, home)
    return Sumo(home, version, _environment(home))


def _refuse_old(version: str, home: Path) -> None:
    numbers = tuple(int(part) for part in re.findall(r"\d+", version)[:2])
    if numbers < OLDEST:
        oldest = ".".join(map(str, OLDEST))
        raise MissingExtraError(
            f"SUMO {version} is too old; covertool needs {oldest} or newer",
            str(home),
            f"{_INSTALL} --upgrade",
        )


def _environment(home: Path) -> dict[str, str]:
    """Return our environment without what is ours, and with what is SUMO's own."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(_OURS)}
    proj = str(home / "data" / "proj")
    return kept | {"SUMO_HOME": str(home), "PROJ_DATA": proj, "PROJ_LIB": proj}

"""Where a result comes from: inputs, options, seeds and the versions of every engine."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from covertool import __version__
from covertool.gis import guard

_CHUNK = 1 << 20
_PREFIX = "provenance "
"""Of the key under which a study keeps what a verb was given."""


@dataclass(frozen=True)
class Provenance:
    """What a result was made from and with.

    Attributes
    ----------
    verb : the verb that made it
    command : the arguments after ``covertool``
    inputs : path as given and sha256 of each input file
    options : the options that shape the result
    seeds : name and value of each seed
    versions : name and version of covertool and each engine
    """

    verb: str
    command: tuple[str, ...]
    inputs: tuple[tuple[str, str], ...]
    options: tuple[tuple[str, str], ...]
    seeds: tuple[tuple[str, int], ...]
    versions: tuple[tuple[str, str], ...]

    def to_metadata(self) -> dict[str, str]:
        """Return one key for each verb and a JSON value, for the metadata table of a GeoPackage."""
        return {f"{_PREFIX}{self.verb}": json.dumps(self.to_json(), ensure_ascii=False)}

    def to_json(self) -> dict[str, Any]:
        """Return the content for the ``provenance`` key of a verb's JSON object."""
        return {
            "command": list(self.command),
            "inputs": [{"path": path, "sha256": sha} for path, sha in self.inputs],
            "options": dict(self.options),
            "seeds": dict(self.seeds),
            "versions": dict(self.versions),
        }


def provenance(
    command: Sequence[str],
    inputs: Iterable[str | Path],
    *,
    verb: str = "",
    options: Mapping[str, object] | None = None,
    seeds: Mapping[str, int] | None = None,
) -> Provenance:
    """Return the provenance of a result: input files are hashed, versions looked up.

    Parameters
    ----------
    command : the words after ``covertool``
    inputs : files, or ``FILE:LAYER``
    verb : the first word of the command when empty
    options, seeds : values by name

    Raises
    ------
    FileError
        When an input cannot be read.
    """
    hashed = tuple((str(spec), sha256(guard.layer_spec(spec)[0])) for spec in inputs)
    return Provenance(
        verb=verb or next(iter(command), "covertool"),
        command=tuple(command),
        inputs=hashed,
        options=tuple((key, str(value)) for key, value in (options or {}).items()),
        seeds=tuple((seeds or {}).items()),
        versions=tuple(versions().items()),
    )


def provenances(
    metadata: Mapping[str, str],
) -> tuple[dict[str, dict[str, Any]], dict[str, str]]:
    """Return what the metadata of a study say of each verb that wrote into it, and the others.

    Both come in the order of their keys; what is said of a verb and cannot be read is one of the
    others.

    >>> provenances({"title": "a town", "provenance extract": '{"seeds": {}}'})
    ({'extract': {'seeds': {}}}, {'title': 'a town'})
    """
    told: dict[str, dict[str, Any]] = {}
    others: dict[str, str] = {}
    for key, text in sorted(metadata.items()):
        content = _json_object(text) if key.startswith(_PREFIX) else None
        if content is None:
            others[key] = text
        else:
            told[key.removeprefix(_PREFIX)] = content
    return told, others


def _json_object(text: str) -> dict[str, Any] | None:
    """Return the object that a text holds, None when it holds none."""
    try:
        content = json.loads(text)
    except ValueError:
        return None
    return content if isinstance(content, dict) else None


def sha256(path: Path) -> str:
    """Return the SHA-256 of a file's bytes in hexadecimal."""
    guard.require_readable(path)
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while chunk := file.read(_CHUNK):
            digest.update(chunk)
    return digest.hexdigest()


def versions() -> dict[str, str]:
    """Return the versions of covertool, GEOS, PROJ and GDAL of each wheel that carries one, SUMO.

    SUMO is there when its package is installed; it is looked up, not imported.
    """
    import pyogrio
    import pyproj
    import rasterio
    import shapely

    found = {
        "covertool": __version__,
        "GEOS": shapely.geos_version_string,
        "GDAL (pyogrio)": ".".join(map(str, pyogrio.__gdal_version__)),
        "GDAL (rasterio)": rasterio.__gdal_version__,
        "PROJ": pyproj.__proj_version__,
    }
    with suppress(PackageNotFoundError):
        found["SUMO"] = version("eclipse-sumo")
    return found

"""All benchmarks in one run: side-by-side ratios, written down with the machine, or guarded.

python -m benchmarks [--quick] [--guard] [ROOM ...]

Without --quick and --guard, results.json and RESULTS.md beside this file are written anew; rooms
that are not named keep their rows. With --guard every ratio is compared with the one kept of the
same kind of run (quick or not): the exit code is 1 when one is worse by more than the tolerance.
Ratios are compared and never times, for two works that take turns on one machine suffer alike from
what else it does.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.metadata
import json
import os
import platform
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.rows import HEADING, line

ROOMS = ("coverage", "with_qgis", "raster", "scale", "positioning", "extraction", "start", "load")
LIBRARIES = (
    "covertool", "numpy", "numba", "scipy", "shapely", "rasterio", "pyogrio", "pyarrow",
    "opencv-python-headless", "filterpy", "pyswarms",
)  # fmt: skip
HERE = Path(__file__).parent
TOLERANCE = 0.5
"""A ratio may lose this share of its kept median; on a busy machine they sway by a third."""


def machine() -> dict[str, Any]:
    """Return what a reader needs to know of the machine: no name of it, and no paths."""
    information = Path("/proc/cpuinfo")
    told = information.read_text().splitlines() if information.exists() else []
    models = [text.partition(":")[2].strip() for text in told if text.startswith("model name")]
    return {
        "processor": models[0] if models else platform.processor() or platform.machine(),
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "libraries": dict(_versions()),
        "load_at_start": round(os.getloadavg()[0], 1) if hasattr(os, "getloadavg") else None,
    }


def _versions() -> Iterator[tuple[str, str]]:
    for name in LIBRARIES:
        try:
            yield name, importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue


def measured(rooms: list[str], quick: bool) -> Iterator[dict[str, Any]]:
    """Yield the rows of each room as they are found, and print them."""
    for room in rooms:
        print(f"\n{room}\n\n{HEADING}", flush=True)
        for row in importlib.import_module(f"benchmarks.{room}").rows(quick):
            found = {"room": room, **row.to_json(quick=quick)}
            print(line(found), flush=True)
            yield found


def markdown(results: dict[str, Any]) -> str:
    """Return the results as a page."""
    of, parts = results["machine"], []
    for room in dict.fromkeys(row["room"] for row in results["rows"]):
        lines = [line(row) for row in results["rows"] if row["room"] == room]
        parts.append("\n".join([f"## {room.replace('_', ' ').capitalize()}", "", HEADING, *lines]))
    versions = ", ".join(f"{name} {version}" for name, version in of["libraries"].items())
    return "\n\n".join([
        "# Benchmarks",
        "Written by `make bench`. A ratio in `x` comes of two works that took turns in one run; "
        "`>=` is peer over covertool, `<=` covertool over peer. Times and rates are of this "
        "machine only.",
        f"{of['processor']}, {of['cores']} cores, {of['system']}, Python {of['python']}; "
        f"{versions}. Load when it began: {of['load_at_start']}.",
        *parts,
    ]) + "\n"  # fmt: skip


def together(path: Path, found: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the rows found, and those kept of rooms that were not measured now, room by room."""
    measured_now = {row["room"] for row in found}
    kept = json.loads(path.read_text(encoding="utf-8"))["rows"] if path.exists() else []
    rows = found + [row for row in kept if row["room"] not in measured_now]
    return sorted(rows, key=lambda row: ROOMS.index(row["room"]))


def worse(kept: list[dict[str, Any]], found: list[dict[str, Any]]) -> list[str]:
    """Return a line for each ratio that is worse than the kept one by more than the tolerance."""
    before = {(row["room"], row["work"], row["beside"]): row for row in kept if row["unit"] == "x"}
    lines = []
    for row in found:
        old = before.get((row["room"], row["work"], row["beside"]))
        if old is None:
            continue
        if row["better"] == "higher":
            left = row["median"] / old["median"]
        else:
            left = old["median"] / row["median"]
        if left < 1 - TOLERANCE:
            lines.append(f"{row['work']} / {row['beside']}: {old['median']:.3g} became "
                         f"{row['median']:.3g}")  # fmt: skip
    return lines


def guard(path: Path, found: list[dict[str, Any]]) -> int:
    """Print what became worse and return the exit code."""
    if not path.exists():
        print(f"{path.name} is not there: make it first", file=sys.stderr)
        return 1
    kept = json.loads(path.read_text(encoding="utf-8"))["rows"]
    fallen = worse(kept, found)
    print("\n".join(fallen) or f"no ratio lost more than {TOLERANCE:.0%}", file=sys.stderr)
    return 1 if fallen else 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("rooms", nargs="*", metavar="ROOM", help=", ".join(ROOMS))
    parser.add_argument("--quick", action="store_true", help="small sizes, under two minutes")
    parser.add_argument("--guard", action="store_true", help="compare, and write nothing")
    parser.add_argument("--keep", action="store_true", help="write a quick run down for --guard")
    options = parser.parse_args()
    unknown = set(options.rooms) - set(ROOMS)
    if unknown:
        parser.error(f"no such room: {', '.join(sorted(unknown))}; choose from {', '.join(ROOMS)}")
    of = machine()
    found = list(measured(options.rooms or list(ROOMS), options.quick))
    path = HERE / ("results_quick.json" if options.quick else "results.json")
    if options.guard:
        return guard(path, found)
    if options.quick and not options.keep:
        return 0
    results = {"schema_version": 1, "machine": of, "rows": together(path, found)}
    path.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    if not options.quick:
        (HERE / "RESULTS.md").write_text(markdown(results), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())

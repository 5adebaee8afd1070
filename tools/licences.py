"""`python -m tools.licences`: covertool's dependencies with their versions and licences."""

from __future__ import annotations

import re
import sys
from importlib.metadata import Distribution, PackageNotFoundError, distribution

_CLASSIFIER = "License :: "
_LONGEST = 60


def needed(root: str, extras: frozenset[str]) -> dict[str, Distribution]:
    """Return the installed distributions that one needs, directly or not, by name."""
    found: dict[str, Distribution] = {}
    waiting = [(root, extras)]
    while waiting:
        name, wanted = waiting.pop()
        try:
            package = distribution(name)
        except PackageNotFoundError:
            continue  # for another platform, or an extra that is not installed
        for line in package.requires or []:
            requirement, _, condition = line.partition(";")
            extra = re.search(r"extra\s*==\s*['\"]([^'\"]+)", condition)
            if extra and extra[1] not in wanted:
                continue
            words = re.match(r"\s*([\w.-]+)\s*(?:\[([^\]]*)\])?", requirement)
            assert words is not None
            key = re.sub(r"[-_.]+", "-", words[1]).lower()
            inner = frozenset(part.strip() for part in (words[2] or "").split(",") if part.strip())
            if key == root:
                waiting.append((root, inner))
            elif key not in found:
                try:
                    found[key] = distribution(key)
                except PackageNotFoundError:
                    continue
                waiting.append((key, inner))
    return found


def licence(package: Distribution) -> str:
    """Return the licence as the package names it, in one line."""
    told = package.metadata
    expression = told.get("License-Expression")
    if expression:
        return str(expression)
    named = [text for text in told.get_all("Classifier") or [] if text.startswith(_CLASSIFIER)]
    if named:
        return ", ".join(text.rpartition(" :: ")[2] for text in named)
    lines = (told.get("License") or "").strip().splitlines()
    return lines[0][:_LONGEST] if lines else "not named"


def main() -> None:
    """Print one Markdown row a dependency."""
    rows = ["| Package | Version | Licence |", "| --- | --- | --- |"]
    for name, package in sorted(needed("covertool", frozenset({"all"})).items()):
        rows.append(f"| {name} | {package.version} | {licence(package)} |")
    sys.stdout.write("\n".join(rows) + "\n")


if __name__ == "__main__":
    main()

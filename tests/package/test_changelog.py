"""Changelog, package and citation tell one version."""

import re
from datetime import date
from pathlib import Path

import covertool

ROOT = Path(__file__).parents[2]
CHANGELOG = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
KINDS = {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}


def releases() -> list[tuple[str, str | None]]:
    found = re.findall(r"^## \[?([^\]\s]+)\]?(?: - (\S+))?$", CHANGELOG, flags=re.MULTILINE)
    return [(name, day or None) for name, day in found]


def test_the_first_heading_is_unreleased_or_the_package_version():
    assert releases()[0][0] in ("Unreleased", covertool.__version__)


def test_releases_fall_in_number_and_have_a_date():
    numbered = [(name, day) for name, day in releases() if name != "Unreleased"]
    numbers = [tuple(map(int, name.split("."))) for name, _ in numbered]
    assert numbers == sorted(numbers, reverse=True)
    assert all(date.fromisoformat(day or "") for _, day in numbered)


def test_changes_are_of_the_kinds_of_keep_a_changelog():
    kinds = set(re.findall(r"^### (.+)$", CHANGELOG, flags=re.MULTILINE))
    assert kinds
    assert kinds <= KINDS


def test_the_citation_names_the_package_version():
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.search(rf"^version: {re.escape(covertool.__version__)}$", citation, re.MULTILINE)

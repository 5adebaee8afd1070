"""What the pages tell a reader to `make` is in the Makefile."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("tests/**/*.md")]
NAMED = sorted(
    {
        target
        for page in PAGES
        if "_build" not in page.parts
        for target in re.findall(r"`make (?:-j2 )?([a-z-]+)", page.read_text(encoding="utf-8"))
    }
)


@pytest.mark.parametrize("target", NAMED)
def test_a_target_named_on_a_page_has_a_rule(target: str) -> None:
    rules = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert re.search(rf"^{target}:", rules, re.MULTILINE)

"""`python -m fuzz TARGET SECONDS`: let atheris look for bytes that break a reader."""

from __future__ import annotations

import logging
import sys
from pathlib import Path

import atheris

FOUND = Path("out/fuzz")


def main(name: str, seconds: str) -> None:
    """Fuzz one target; what breaks it is written below ``out/fuzz``."""
    with atheris.instrument_imports(include=["covertool"]):
        from fuzz.targets import CORPUS, TARGETS
    logging.disable(logging.CRITICAL)
    grown = FOUND / name
    grown.mkdir(parents=True, exist_ok=True)
    options = [
        f"-max_total_time={seconds}", f"-artifact_prefix={grown}-", "-rss_limit_mb=4096",
        "-timeout=30", "-max_len=4096", "-print_final_stats=1", "-verbosity=0",
    ]  # fmt: skip
    atheris.Setup([sys.argv[0], *options, str(grown), str(CORPUS / name)], TARGETS[name])
    atheris.Fuzz()


if __name__ == "__main__":
    main(*sys.argv[1:])

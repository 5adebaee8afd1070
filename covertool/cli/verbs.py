"""All verbs of the command, each in modules of its own that register it."""

from __future__ import annotations

import importlib
from collections.abc import Sequence

from covertool.cli.app import Verbs, app

VERBS = {
    "transit": ("transit",),
    "extract": ("extract",),
    "coverage": ("coverage",),
    "simulate": ("simulate",),
    "reproduce": ("reproduce",),
    "export": ("export",),
    "report": ("report",),
    "convert": ("convert",),
    "sample": ("sample",),
    "run": ("run",),
    "info": ("info",),
    "doctor": ("doctor",),
    "congestion": ("congestion", "congestion_import", "congestion_map"),
    "anchors": ("anchors_parked", "anchors_queue"),
}
"""Each verb's modules, in the order of `covertool --help`, where groups come last."""


def command(words: Sequence[str] = ()) -> Verbs:
    """Return covertool's command with the verb that the first word names, or with all verbs.

    A run needs its own verb; to load the others takes a tenth of a short one.
    """
    first = words[0] if words else ""
    for verb in [first] if first in VERBS else VERBS:
        for module in VERBS[verb]:
            importlib.import_module(f"covertool.cli.{module}")
    return app

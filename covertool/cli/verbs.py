"""All verbs of the command, each in a module of its own that registers it."""

from __future__ import annotations

import importlib

from covertool.cli.app import app as app

VERBS = (
    "extract",
    "transit",
    "coverage",
    "congestion",
    "congestion_import",
    "congestion_map",
    "anchors_parked",
    "anchors_queue",
    "simulate",
    "reproduce",
    "export",
    "report",
    "convert",
    "sample",
    "run",
    "info",
    "doctor",
)
"""Modules of covertool.cli that register a verb, in the order of `covertool --help`."""

for _verb in VERBS:
    importlib.import_module(f"covertool.cli.{_verb}")

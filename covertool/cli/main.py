"""The entry point: loads the verbs and turns faults into three lines and an exit code."""

from __future__ import annotations

import importlib
import os
import sys

import typer

from covertool.cli.app import app
from covertool.errors import CovertoolError

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


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit code.

    0 done; 1 a fault that the user can mend, told in three lines; 2 a usage error; 130 Ctrl-C.
    """
    given = sys.argv[1:] if arguments is None else arguments
    try:
        app(args=given, standalone_mode=True, prog_name="covertool", obj=tuple(given))
    except CovertoolError as error:
        if "--debug" in given:
            raise
        typer.echo(str(error), err=True)
        return 1
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141
    except SystemExit as exit_:
        return exit_.code if isinstance(exit_.code, int) else 1
    return 0

"""What the verbs say: data on stdout, everything else on stderr."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import typer

SCHEMA_VERSION = 1


def print_json(command: str, content: Mapping[str, Any]) -> None:
    """Print one JSON object on stdout, with its schema version and the command first.

    NaN and infinity, which JSON lacks, become null.
    """
    whole = {"schema_version": SCHEMA_VERSION, "command": command, **content}
    typer.echo(json.dumps(_plain(whole), ensure_ascii=False))


def print_table(columns: Iterable[str], rows: Iterable[Iterable[str]], title: str = "") -> None:
    """Print an aligned table on stdout: the first column to the left, the others to the right."""
    table = [list(columns), *[list(row) for row in rows]]
    widths = [max(len(row[i]) for row in table) for i in range(len(table[0]))]
    if title:
        typer.echo(title)
    for row in table:
        cells = [
            row[0].ljust(widths[0]),
            *[c.rjust(w) for c, w in zip(row[1:], widths[1:], strict=True)],
        ]
        typer.echo("  ".join(cells).rstrip())


def say(message: str) -> None:
    """Print a message on stderr, unless the user asked for quiet."""
    import logging

    if logging.getLogger("covertool").isEnabledFor(logging.WARNING):
        typer.echo(message, err=True)


@contextmanager
def progress(label: str, total: int) -> Iterator[Any]:
    """Yield a function that advances a bar on stderr by a number of steps.

    The bar shows only when stderr is a terminal.
    """
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not sys.stderr.isatty()) as bar:
        task = bar.add_task(label, total=total)
        yield lambda steps=1: bar.advance(task, steps)


def _plain(value: Any) -> Any:
    """Return a value as JSON knows it: numpy scalars as numbers, NaN and infinity as None."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, float) and (value != value or value in (float("inf"), float("-inf"))):
        return None
    return value

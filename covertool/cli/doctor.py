"""`covertool doctor`: whether this installation is sound."""

from __future__ import annotations

import dataclasses

import typer

from covertool.cli import options
from covertool.cli.app import app
from covertool.cli.console import print_json

_MARKS = {True: "ok", False: "BROKEN", None: "absent"}


@app.command()
def doctor(as_json: options.Json = False) -> None:
    """Look whether this installation is sound; exit 1 when something is broken.

    \b
    Examples:
      covertool doctor
      covertool doctor --json
    """
    from covertool.doctor import examine

    checks = examine()
    sound = all(check.sound is not False for check in checks)
    if as_json:
        print_json("doctor", {"sound": sound, "checks": [dataclasses.asdict(c) for c in checks]})
    else:
        width = max(len(check.name) for check in checks)
        for check in checks:
            typer.echo(f"{_MARKS[check.sound]:7} {check.name:{width}}  {check.found}")
    if not sound:
        raise typer.Exit(1)

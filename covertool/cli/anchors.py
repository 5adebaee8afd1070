"""`covertool anchors`: the group of verbs that make anchors."""

from __future__ import annotations

import typer

from covertool.cli.app import app

anchors_app = typer.Typer(
    name="anchors",
    help="Make anchors: parked cars, queued cars.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
app.add_typer(anchors_app)

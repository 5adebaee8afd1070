"""The covertool command without its verbs: version, loudness, help."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from covertool import __version__


@dataclass(frozen=True)
class Invocation:
    """The verb that runs, the words that followed ``covertool``, and every option's value."""

    verb: str
    words: tuple[str, ...]
    options: dict[str, Any]


_running: ContextVar[Invocation | None] = ContextVar("invocation", default=None)


def invocation() -> Invocation:
    """Return what runs now; outside of the command line an empty invocation."""
    return _running.get() or Invocation("", (), {})


class _Verb(TyperCommand):
    """A command that says, while it runs, what it was asked."""

    def invoke(self, ctx: Any) -> Any:
        """Run the verb."""
        verb = " ".join(ctx.command_path.split()[1:])
        words = tuple(ctx.find_root().obj or ())
        token = _running.set(Invocation(verb, words, dict(ctx.params)))
        try:
            return super().invoke(ctx)
        finally:
            _running.reset(token)


class Verbs(typer.Typer):
    """A group of verbs."""

    def command(self, name: str | None = None, **settings: Any) -> Callable[[Any], Any]:
        """Register a function as a verb, as typer does."""
        return super().command(name, **{"cls": _Verb, **settings})


app = Verbs(
    name="covertool",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)


class _Line(logging.Formatter):
    """A message as it stands on stderr: a warning says that it is one."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the line."""
        told = super().format(record)
        return f"warning: {told}" if record.levelno == logging.WARNING else told


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"covertool {__version__}")
        raise typer.Exit


@app.callback()
def covertool(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version."),
    ] = False,
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="Only errors on stderr.")] = False,
    verbose: Annotated[bool, typer.Option("-v", "--verbose", help="More on stderr.")] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")] = False,
) -> None:
    """How much of a town's road would parked cars cover, and what would that save in metres?

    \b
    Examples:
      covertool coverage --radius 15
      covertool extract photo.tif --mask roads.tif -o town.gpkg
      covertool coverage town.gpkg --radius 15 --radius 100
    """
    level = logging.ERROR if quiet else logging.INFO if verbose else logging.WARNING
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(_Line())
    logger = logging.getLogger("covertool")
    logger.handlers[:] = [handler]
    logger.propagate = False
    logger.setLevel(level)


# The verbs register themselves on `app`; covertool/cli/verbs.py lists them.

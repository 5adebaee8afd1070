"""The covertool command: collects the verbs and turns faults into three lines."""

from __future__ import annotations

import logging
import os
import sys
from typing import Annotated

import typer

from covertool import __version__
from covertool.errors import CovertoolError

app = typer.Typer(
    name="covertool",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)


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
    handler.setFormatter(logging.Formatter("%(message)s"))
    logger = logging.getLogger("covertool")
    logger.handlers[:] = [handler]
    logger.propagate = False
    logger.setLevel(level)


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit code.

    0 done; 1 a fault that the user can mend, told in three lines; 2 a usage error; 130 Ctrl-C.
    """
    given = sys.argv[1:] if arguments is None else arguments
    try:
        app(args=given, standalone_mode=True)
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


# The verbs register themselves on `app`; the order here is the order of `covertool --help`.

if __name__ == "__main__":
    sys.exit(main())

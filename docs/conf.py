"""How the documentation is built; `make docs` treats warnings as errors."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import covertool

project = "covertool"
author = "The covertool authors"
copyright = "2026, The covertool authors"
version = release = covertool.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
]
myst_enable_extensions = ["dollarmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["_build", "generated/*.txt"]

autodoc_typehints = "none"
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_ivar = True

html_theme = "furo"
html_math_renderer = "mathml"
html_title = f"covertool {version}"
html_static_path: list[str] = []

GENERATED = Path(__file__).parent / "generated"


def commands(group: Any, words: str) -> Iterator[tuple[str, Any]]:
    """Yield each command below a group with its whole name."""
    for name, command in group.commands.items():
        whole = f"{words} {name}"
        if hasattr(command, "commands"):
            yield from commands(command, whole)
        else:
            yield whole, command


def write_command_reference() -> None:
    """Write one page with the help of every command, as the command itself prints it."""
    import typer

    from covertool.cli import verbs

    tree = typer.main.get_command(verbs.command())
    lines = ["# Command line", "", "Each command's own `--help`, as this version prints it.", ""]
    for name, command in commands(tree, "covertool"):
        context = command.make_context(name, [], resilient_parsing=True, max_content_width=96)
        lines += [f"## {name}", "", "```text", command.get_help(context), "```", ""]
    (GENERATED / "cli.md").write_text("\n".join(lines), encoding="utf-8")


def write_columns() -> None:
    """Write the data dictionary: every column that covertool writes, with its unit."""
    from covertool.report.dictionary import COLUMNS, meaning

    lines = ["# Columns", "", "| column | meaning | unit |", "| --- | --- | --- |"]
    for column in COLUMNS:
        words, unit = meaning(column)
        lines.append(f"| `{column}` | {words} | {unit} |")
    (GENERATED / "columns.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


def visit_math(translator: Any, node: Any, display: str) -> None:
    """Write a formula as MathML, which browsers show without a script or a network."""
    from docutils.nodes import SkipNode
    from latex2mathml.converter import convert

    translator.body.append(convert(node.astext(), display=display))
    raise SkipNode


def setup(app: Any) -> None:
    """Write the pages that come from the code before the others are read."""
    app.add_html_math_renderer(
        "mathml",
        (lambda translator, node: visit_math(translator, node, "inline"), None),
        (lambda translator, node: visit_math(translator, node, "block"), None),
    )
    GENERATED.mkdir(exist_ok=True)
    write_command_reference()
    write_columns()

"""The commands that a study's missing parts are made with, as the command line takes them."""

import shlex

import pytest
import typer

from covertool.cli.verbs import command
from covertool.report.parts import LAYER_MENDS, PARTS, typed

MENDS = sorted({*LAYER_MENDS.values(), *(part.mend for part in PARTS.values())})


@pytest.mark.parametrize("mend", MENDS)
def test_a_mend_is_a_command_that_there_is(mend):
    program, *words = shlex.split(typed(mend, "my town.gpkg"))
    assert program == "covertool"
    assert "my town.gpkg" in words
    group = typer.main.get_command(command())
    while hasattr(group, "commands"):
        group = group.commands[words.pop(0)]
    with group.make_context("verb", words) as context:
        assert not context.args

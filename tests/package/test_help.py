"""What a stranger types first: help of every verb, with examples, and shell completion."""

import os
import subprocess
import sys

import pytest
import typer

from covertool.cli.verbs import VERBS, command


def commands(shown, words=("covertool",)):
    yield words, shown
    for name, below in getattr(shown, "commands", {}).items():
        yield from commands(below, (*words, name))


TREE = dict(commands(typer.main.get_command(command())))
NAMES = [" ".join(words) for words in TREE]


@pytest.mark.parametrize("words", TREE, ids=NAMES)
def test_the_help_begins_with_a_sentence_and_examples_of_that_very_verb(words):
    context = TREE[words].make_context(" ".join(words), [], resilient_parsing=True)
    first, examples, *_ = TREE[words].get_help(context).split("\n\n", 1)[1].split("\n\n")
    assert len(first.split()) > 3
    heading, *lines = examples.splitlines()
    assert heading.strip() == "Examples:"
    assert lines
    assert lines[0].strip().startswith(" ".join(words))


@pytest.mark.parametrize("words", TREE, ids=NAMES)
def test_every_option_says_what_it_does(words):
    silent = [p.name for p in TREE[words].params if not getattr(p, "help", None)]
    assert not silent


@pytest.mark.parametrize("words", TREE, ids=NAMES)
def test_the_examples_use_only_options_that_there_are(words):
    for line in (TREE[words].help or "").splitlines():
        if not line.strip().startswith("covertool "):
            continue
        called = line.split("#")[0].split("|")[0].split()
        deepest = max(
            (known for known in TREE if list(known) == called[: len(known)]), key=len, default=None
        )
        assert deepest is not None, line
        known = {
            name for param in TREE[deepest].params for name in [*param.opts, *param.secondary_opts]
        }
        flags = {word.split("=")[0] for word in called if word.startswith("-") and len(word) > 1}
        assert flags <= known | {"--help", "-h"}, line


def test_every_verb_module_registers_a_verb():
    modules = sum(len(modules) for modules in VERBS.values())
    assert modules <= sum(not hasattr(below, "commands") for below in TREE.values())


def test_the_help_tells_the_verbs_in_their_order():
    done = subprocess.run(
        [sys.executable, "-m", "covertool", "--help"], capture_output=True, text=True, check=True
    )
    told = done.stdout.split("Commands:\n")[1].splitlines()
    assert [line.split()[0] for line in told] == list(VERBS)


@pytest.mark.parametrize("verb", VERBS)
def test_a_verb_alone_is_as_it_is_among_the_others(verb):
    script = f"""
import typer
from covertool.cli.verbs import command
shown = typer.main.get_command(command([{verb!r}, "--help"])).commands[{verb!r}]
print(shown.get_help(shown.make_context("covertool {verb}", [], resilient_parsing=True)))
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.stderr == ""
    among = TREE[("covertool", verb)]
    context = among.make_context(f"covertool {verb}", [], resilient_parsing=True)
    assert done.stdout == among.get_help(context) + "\n"


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_of_each_shell_is_shown(shell):
    # Typer otherwise asks which shell started it, and not every run of the tests has one above it.
    named = {"_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"}
    done = subprocess.run(
        [sys.executable, "-m", "covertool", "--show-completion", shell],
        env=os.environ | named,
        capture_output=True,
        text=True,
        check=True,
    )
    assert "_COVERTOOL_COMPLETE" in done.stdout


def test_a_group_completes_its_verbs():
    asked = {
        "_COVERTOOL_COMPLETE": "complete_bash",
        "COMP_WORDS": "covertool congestion s",
        "COMP_CWORD": "2",
    }
    code = "from covertool.cli.main import main; main([])"
    done = subprocess.run(
        [sys.executable, "-c", code], env=os.environ | asked, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.stdout.split() == ["sensitivity"]

"""`covertool run`: the whole flow from one plan."""

from __future__ import annotations

import contextlib
import dataclasses
import logging
import shlex
import sys
from collections.abc import Sequence
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from covertool.cli import options
from covertool.cli.app import app
from covertool.cli.console import print_json, say

if TYPE_CHECKING:
    from covertool.plan import Plan, Runner, Stage, Verb

PlanFile = Annotated[
    Path | None,
    typer.Argument(metavar="PLAN.toml", help="The plan; paths in it are relative to it."),
]
Example = Annotated[bool, typer.Option("--example", help="Print the sample study's plan.")]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Show what would run, and run nothing.")]


@app.command("run")
def run(
    plan: PlanFile = None,
    example: Example = False,
    dry_run: DryRun = False,
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
) -> None:
    """Run the whole flow from one plan; what did not change since the last run is not done again.

    \b
    Examples:
      covertool run --example > plan.toml
      covertool run plan.toml --dry-run
      covertool run plan.toml

    \b
    A table of the plan is a verb ([coverage], [anchors.parked], ...), a key is one of its options
    without the dashes (mean-of becomes mean_of). Stages write into the study that [study] names,
    unless they name an output of their own. STUDY.gpkg.plan.json remembers what was done.
    """
    if example:
        from covertool.plan import example as example_plan

        typer.echo(example_plan(), nl=False)
        return
    if plan is None:
        raise typer.BadParameter("name a plan, or use --example", param_hint="PLAN.toml")
    code = carry_out(read(plan), dry_run=dry_run, overwrite=overwrite, as_json=as_json)
    if code != 0:
        raise typer.Exit(code)


def read(plan: Path) -> Plan:
    """Return a plan, whose keys are the options that the verbs declare."""
    from covertool.gis.sample import SAMPLE_STUDY, sample_folder
    from covertool.plan import read_plan

    return read_plan(plan, verbs(), sample_folder() / SAMPLE_STUDY)


def carry_out(plan: Plan, *, dry_run: bool, overwrite: bool, as_json: bool) -> int:
    """Run a plan, say what happens, and return the exit code of the stage that ended it."""
    from covertool.plan import run_plan

    def announce(stage: Stage, command: tuple[str, ...], fresh: bool) -> None:
        state = "fresh" if fresh else "would run" if dry_run else "running"
        say(f"[{stage.name}] {state}: {_shown(command)}")

    verbs_print = contextlib.redirect_stdout(sys.stderr) if as_json else contextlib.nullcontext()
    with verbs_print:
        outcomes = run_plan(
            plan, _runner(plan), dry=dry_run, overwrite=overwrite, on_stage=announce
        )
    if as_json:
        stages = [
            {
                "stage": outcome.stage.name,
                "command": list(outcome.command),
                "state": "fresh" if outcome.fresh else "would run" if dry_run else "ran",
                "exit_code": outcome.exit_code,
            }
            for outcome in outcomes
        ]
        seconds = {outcome.stage.name: outcome.seconds for outcome in outcomes}
        print_json("run", {"study": plan.study, "stages": stages, "seconds": seconds})
    return outcomes[-1].exit_code


def study_of_the_sample_plan() -> Path:
    """Return the study that the sample plan makes, kept in the user's cache between runs.

    Only what changed since the last time is done again; an upgrade begins a new folder.
    """
    from platformdirs import user_cache_path

    from covertool import __version__
    from covertool.plan import example

    folder = user_cache_path("covertool") / f"sample-{__version__}"
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "plan.toml"
    path.write_text(example(), encoding="utf-8")
    whole = read(path)
    plan = dataclasses.replace(whole, stages=tuple(s for s in whole.stages if s.writes_study))
    say(f"no study was named: running the synthetic sample plan in {folder}")
    with contextlib.redirect_stdout(sys.stderr):
        code = carry_out(plan, dry_run=False, overwrite=True, as_json=False)
    if code != 0:
        raise typer.Exit(code)
    return folder / plan.study


def verbs() -> dict[str, Verb]:
    """Return what each verb takes, as the command line declares it."""
    from covertool.cli.verbs import command
    from covertool.plan import Parameter, Verb

    def parameters(declared: Any) -> list[Parameter]:
        if declared.param_type_name == "argument":
            return [Parameter(declared.name, "")]
        repeats, is_switch = declared.multiple, declared.is_flag
        return [
            Parameter(flag[2:].replace("-", "_"), flag, repeats=repeats, is_switch=is_switch)
            for flag in declared.opts
            if flag.startswith("--")
        ]

    def walk(group: Any, prefix: str) -> dict[str, Verb]:
        found = {}
        for name, below in group.commands.items():
            if hasattr(below, "commands"):
                found.update(walk(below, f"{prefix}{name} "))
            else:
                taken = chain.from_iterable(map(parameters, below.params))
                found[prefix + name] = Verb(prefix + name, tuple(taken))
        return found

    return walk(typer.main.get_command(command()), "")


def _runner(plan: Plan) -> Runner:
    """Return what runs a command line of covertool in the plan's folder, as loud as this run."""
    from covertool.cli.main import main

    level = logging.getLogger("covertool").level
    loudness = ["-q"] if level > logging.WARNING else ["-v"] if level < logging.WARNING else []

    def run_command(arguments: Sequence[str]) -> int:
        with contextlib.chdir(plan.folder):
            return main([*loudness, *arguments])

    return run_command


def _shown(command: tuple[str, ...]) -> str:
    """Return a command as it is typed."""
    return shlex.join(command if command[0] == "cp" else ("covertool", *command))

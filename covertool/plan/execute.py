"""Running a plan: a stage whose inputs and options did not change is not done again."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

from covertool import __version__
from covertool.errors import FileError
from covertool.gis import guard
from covertool.gis.provenance import sha256
from covertool.plan.stages import START, Plan, Stage

_STATE_VERSION = 1

Runner = Callable[[Sequence[str]], int]
"""Runs covertool with some arguments, in the plan's folder, and returns its exit code."""


@dataclass(frozen=True)
class Outcome:
    """What became of a stage.

    Attributes
    ----------
    stage, command : what it is, and how it is run
    fresh : whether it need not run again
    seconds : how long it took
    exit_code : 0 also for a stage that did not run
    """

    stage: Stage
    command: tuple[str, ...]
    fresh: bool
    seconds: float
    exit_code: int


def run_plan(
    plan: Plan,
    runner: Runner,
    *,
    dry: bool = False,
    overwrite: bool = False,
    on_stage: Callable[[Stage, tuple[str, ...], bool], object] | None = None,
) -> list[Outcome]:
    """Run the stages of a plan that are not fresh, and return what became of each.

    A stage is fresh when its command, the content of its input files, the stages that it needs, its
    output and the study are as they were when it last ran. What is known of that lies beside the
    study, in ``STUDY.plan.json``. A stage that fails ends the run; what was done before it stays
    done.

    Parameters
    ----------
    plan : Plan
    runner : runs a command of covertool in the plan's folder
    dry : run and write nothing
    overwrite : replace files that the plan did not make
    on_stage : called before each stage with the stage, its command, and whether it is fresh

    Raises
    ------
    FileError
        When a file is in the way that the plan did not make, and ``overwrite`` is False.
    """
    memory = _Memory.of(plan)
    outcomes: list[Outcome] = []
    ran: set[str] = set()
    for stage in plan.stages:
        command = _command(plan, stage)
        fresh = not (ran & set(stage.needs)) and memory.is_fresh(stage)
        if not (fresh or overwrite or memory.is_own(stage)):
            _require_free(plan, stage)
        if on_stage is not None:
            on_stage(stage, command, fresh)
        if not fresh:
            ran.add(stage.name)
        started = perf_counter()
        code = 0 if fresh or dry else _carry_out(plan, stage, command, runner, memory)
        outcomes.append(Outcome(stage, command, fresh, perf_counter() - started, code))
        if code != 0:
            break
    return outcomes


def _carry_out(
    plan: Plan, stage: Stage, command: tuple[str, ...], runner: Runner, memory: _Memory
) -> int:
    """Run a stage, remember it when it did well, and return its exit code."""
    memory.begin(stage)
    code = _run(plan, stage, command, runner)
    if code == 0:
        memory.remember(stage)
    return code


def _command(plan: Plan, stage: Stage) -> tuple[str, ...]:
    """Return the whole command: the stage's arguments and where it writes."""
    if stage.verb == START:
        return ("cp", stage.arguments[0], plan.study)
    if stage.output is not None:
        return (*stage.arguments, "-o", stage.output, "--overwrite")
    if stage == _maker(plan):
        return (*stage.arguments, "-o", plan.study, "--overwrite")
    return (*stage.arguments, "--into", plan.study)


def _run(plan: Plan, stage: Stage, command: tuple[str, ...], runner: Runner) -> int:
    """Run a verb, or copy the study from which the plan starts."""
    if stage.verb != START:
        return runner(command)
    source, target = plan.folder / stage.arguments[0], plan.folder / plan.study
    guard.require_readable(source)
    guard.require_parent(target)
    with guard.replacing(target) as temporary:
        shutil.copyfile(source, temporary)
    return 0


def _require_free(plan: Plan, stage: Stage) -> None:
    """Refuse to write a whole file over one that is there."""
    path = plan.folder / stage.target(plan.study)
    if path.exists() and (not stage.writes_study or stage == _maker(plan)):
        raise FileError(
            "the file is there, and is not as this plan left it",
            str(path),
            "move it away, or add --overwrite",
        )


def _maker(plan: Plan) -> Stage | None:
    """Return the stage that makes the study anew."""
    return next((stage for stage in plan.stages if stage.writes_study), None)


class _Memory:
    """What is known of the last run: the fingerprint of each stage and the hash of each output."""

    def __init__(self, plan: Plan, path: Path, content: dict[str, Any]) -> None:
        self._plan, self._path = plan, path
        self._outputs: dict[str, str] = content.get("outputs", {})
        self._stages: dict[str, str] = content.get("stages", {})
        self._begun: str | None = content.get("begun")
        self._prints: dict[str, str] = {}
        self._study_unchanged = self._is_unchanged(plan.study)

    @classmethod
    def of(cls, plan: Plan) -> _Memory:
        """Return what lies beside the study; nothing when there is none or it cannot be read."""
        path = plan.folder / f"{plan.study}.plan.json"
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
            known = content.get("version") == _STATE_VERSION
        except (OSError, ValueError, AttributeError):
            known = False
        return cls(plan, path, content if known else {})

    def is_fresh(self, stage: Stage) -> bool:
        """Whether a stage need not run again."""
        same = self._stages.get(stage.name) == self._fingerprint(stage)
        if stage.output is None:
            return same and self._study_unchanged
        return same and self._is_unchanged(stage.output)

    def is_own(self, stage: Stage) -> bool:
        """Whether the file that a stage writes is this plan's own work, finished or broken off."""
        target = stage.target(self._plan.study)
        return target == self._begun or self._is_unchanged(target)

    def begin(self, stage: Stage) -> None:
        """Note that a stage begins: what it leaves when it is broken off is the plan's own."""
        self._begun = stage.target(self._plan.study)
        self._write()

    def remember(self, stage: Stage) -> None:
        """Note, on disk at once, that a stage has run."""
        target = stage.target(self._plan.study)
        self._outputs[target] = sha256(self._plan.folder / target)
        self._stages[stage.name] = self._fingerprint(stage)
        self._begun = None
        self._write()

    def _write(self) -> None:
        content = {
            "version": _STATE_VERSION,
            "begun": self._begun,
            "outputs": self._outputs,
            "stages": self._stages,
        }
        with guard.replacing(self._path) as temporary:
            temporary.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")

    def _is_unchanged(self, target: str) -> bool:
        path = self._plan.folder / target
        return target in self._outputs and path.is_file() and sha256(path) == self._outputs[target]

    def _fingerprint(self, stage: Stage) -> str:
        """Return a hash of all that decides a stage's result."""
        inputs = [self._content(word) for word in stage.arguments]
        needs = [self._prints[name] for name in stage.needs]
        whole = json.dumps([__version__, stage.arguments, stage.output, inputs, needs])
        self._prints[stage.name] = hashlib.sha256(whole.encode()).hexdigest()
        return self._prints[stage.name]

    def _content(self, word: str) -> str | None:
        """Return the hash of the file that a word names, as ``FILE`` or ``FILE:LAYER``.

        Not that of the study: which stages changed what a stage reads there is known better.
        """
        for name in (word, word.rpartition(":")[0]):
            path = self._plan.folder / name
            if name and name != self._plan.study and path.is_file():
                return sha256(path)
        return None

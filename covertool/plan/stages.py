"""What a plan is made of: verbs, what they take, and stages in their order."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

ORDER = (
    "extract",
    "transit",
    "anchors parked",
    "congestion import",
    "congestion table",
    "congestion map",
    "anchors queue",
    "coverage",
    "simulate",
    "export",
    "report",
)
"""The verbs of a plan, in the order in which they run."""

START = "start"
"""The stage that copies the study from which a plan starts."""


@dataclass(frozen=True)
class Parameter:
    """An option or argument of a verb.

    Attributes
    ----------
    key : its key in a plan
    flag : on the command line; empty for an argument
    repeats : whether a plan may give a list of values
    is_switch : whether it is true or false
    """

    key: str
    flag: str
    repeats: bool = False
    is_switch: bool = False


@dataclass(frozen=True)
class Verb:
    """What a verb takes, as the command line declares it."""

    name: str
    parameters: tuple[Parameter, ...]

    def takes(self, key: str) -> bool:
        """Return True when the verb has a parameter of that key."""
        return any(parameter.key == key for parameter in self.parameters)


@dataclass(frozen=True)
class Stage:
    """One run of a verb.

    Attributes
    ----------
    name : unique in the plan
    verb : one of ``ORDER``, or ``START``
    arguments : of the verb, without those that say which file is written
    output : the file of its own that it writes; None when it writes into the study
    needs : names of the stages whose results it reads
    """

    name: str
    verb: str
    arguments: tuple[str, ...]
    output: str | None
    needs: tuple[str, ...]

    @property
    def writes_study(self) -> bool:
        """Whether the stage writes layers into the study."""
        return self.output is None

    def target(self, study: str) -> str:
        """Return the file that the stage writes."""
        return study if self.output is None else self.output


@dataclass(frozen=True)
class Plan:
    """The study that a plan makes and the stages that make it; paths are relative to ``folder``."""

    folder: Path
    study: str
    stages: tuple[Stage, ...]

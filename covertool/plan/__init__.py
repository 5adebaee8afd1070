"""The whole flow from one file: which verbs run, in what order, and which need not run again."""

from covertool.plan.execute import Outcome, Runner, run_plan
from covertool.plan.reading import example, read_plan
from covertool.plan.stages import Parameter, Plan, Stage, Verb

__all__ = [
    "Outcome",
    "Parameter",
    "Plan",
    "Runner",
    "Stage",
    "Verb",
    "example",
    "read_plan",
    "run_plan",
]

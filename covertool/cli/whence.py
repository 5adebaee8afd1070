"""Where a verb's result comes from: the command as given, its inputs, every option's value."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from covertool.cli.app import invocation

if TYPE_CHECKING:
    from covertool.gis.provenance import Provenance

_OUTPUTS = (
    "output", "into", "overwrite", "as_json", "preview", "plot", "plot_density", "heat",
    "result_table", "traces", "trace_runs", "additional", "fcd_out", "edge_data",
)  # fmt: skip
_MEANS = ("workers", "scheduler", "resume", "timeout")
_NO_PART = frozenset((*_OUTPUTS, *_MEANS))
"""Options that say where a result goes or who computes it, and have no part in what it is."""

_USER_INFO = re.compile(r"(?<=://)[^/@\s]+@")
_SECRET = re.compile(r"((?:token|key|password|passwd|secret|signature)=)[^&\s]+", re.IGNORECASE)


def whence(files: Iterable[str | Path]) -> Provenance:
    """Return the provenance of what the running verb makes from some files.

    The command is the one given to :func:`covertool.cli.main.main`; options that shape the result
    are told with their values, defaults too; options named after a seed are the seeds.
    """
    from covertool.gis.provenance import provenance

    running = invocation()
    told = {
        name: value
        for name, value in sorted(running.options.items())
        if name not in _NO_PART and not _is_left_out(value)
    }
    seeds = {name: value for name, value in told.items() if name.endswith("seed")}
    return provenance(
        without_secrets(running.words),
        files,
        verb=running.verb,
        options={name: _text(value) for name, value in told.items() if name not in seeds},
        seeds=seeds,
    )


def _is_left_out(value: Any) -> bool:
    """Return whether an option was neither given nor has a default."""
    return value is None or value is False or value in ((), [])


def without_secrets(words: Sequence[str]) -> list[str]:
    """Return words with the user names, passwords and tokens in them put out of sight.

    >>> without_secrets(["--scheduler", "tcp://me:word@cluster:8786", "token=abc"])
    ['--scheduler', 'tcp://***@cluster:8786', 'token=***']
    """
    return [_SECRET.sub(r"\1***", _USER_INFO.sub("***@", word)) for word in words]


def _text(value: Any) -> str:
    values = value if isinstance(value, list | tuple) else [value]
    return ", ".join(without_secrets([str(one) for one in values]))

"""Where a verb writes its layers: a file of its own, a study that takes them in, or neither."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typer

from covertool.cli.console import say

Layers = Mapping[str, Any]
"""Data frames, with geometry or without, by the name of their layer."""


@dataclass(frozen=True)
class Target:
    """What ``-o``, ``--into`` and ``--overwrite`` name."""

    output: Path | None
    into: Path | None
    overwrite: bool

    def require(self, *others: object) -> None:
        """Refuse a run that would write nothing and, by ``others``, say nothing either."""
        if self.output is None and self.into is None and not any(others):
            raise typer.BadParameter("name a file to write", param_hint="-o / --into")

    def require_free(self, inputs: Iterable[Path] = ()) -> None:
        """Refuse a file that cannot be written before hours of work rather than after."""
        from covertool.gis.formats import VECTOR_OUTPUTS
        from covertool.gis.guard import output_file

        if self.output is not None:
            output_file(self.output, VECTOR_OUTPUTS, overwrite=self.overwrite, inputs=inputs)

    def write(
        self,
        layers: Layers,
        metadata: Mapping[str, str],
        *,
        inputs: Iterable[Path] = (),
        in_study: Callable[[Path], Layers] | None = None,
    ) -> None:
        """Write layers with what is to be said of them, and say so on stderr.

        Parameters
        ----------
        layers : what a file of its own holds, and a study takes in
        metadata : keys and values that go with them
        inputs : files that the output must not be one of
        in_study : returns what a study takes in instead, where that depends on what it holds
        """
        from covertool.gis.write import write_layers

        if self.output is not None:
            write_layers(
                self.output, layers, overwrite=self.overwrite, metadata=metadata, inputs=inputs
            )
            say(f"wrote {', '.join(layers)} to {self.output}")
        if self.into is not None:
            taken = layers if in_study is None else in_study(self.into)
            write_layers(self.into, taken, into=True, metadata=metadata, inputs=inputs)
            say(f"wrote {', '.join(taken)} into {self.into}")

"""Which anchors and which transit area a verb is about: a study, files, or the sample study."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from covertool.cli.console import say

if TYPE_CHECKING:
    from covertool.model import Anchors, TransitArea


@dataclass(frozen=True)
class Inputs:
    """The layers that a verb reads, as ``FILE[:LAYER]``."""

    anchors: tuple[str, ...]
    transit: str

    def files(self) -> list[Path]:
        """Return the files behind the layers, each once."""
        from covertool.gis.guard import layer_spec

        return list(dict.fromkeys(layer_spec(spec)[0] for spec in (*self.anchors, self.transit)))


def choose_inputs(study: Path | None, anchors: Sequence[str] | None, transit: str | None) -> Inputs:
    """Return what to read: a study's layers, overridden by named files, or the sample study.

    Raises
    ------
    typer.BadParameter
        When only one of anchors and transit is named and there is no study.
    """
    if study is None and bool(anchors) != bool(transit):
        missing = "--transit" if anchors else "--anchors"
        raise typer.BadParameter(f"add {missing} FILE[:LAYER], or name a study", param_hint=missing)
    if study is None and not anchors:
        from covertool.gis.sample import SAMPLE_STUDY, sample_folder

        study = sample_folder() / SAMPLE_STUDY
        say(f"no study was named: using the synthetic sample study {study}")
    return Inputs(tuple(anchors or [f"{study}:anchors"]), transit or f"{study}:transit")


def read_inputs(
    inputs: Inputs, crs: str | None, dst_crs: str | None
) -> tuple[Anchors, TransitArea]:
    """Return the anchors and the transit area in one working CRS."""
    from covertool.gis.read import read_anchors, read_transit, warn_when_apart
    from covertool.model import Anchors

    transit = read_transit(inputs.transit, crs=crs, dst_crs=dst_crs)
    parts = [read_anchors(spec, crs=crs, dst_crs=transit.crs) for spec in inputs.anchors]
    anchors = Anchors.concatenate(parts)
    warn_when_apart(anchors, transit, inputs.transit)
    return anchors, transit

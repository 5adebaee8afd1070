"""`covertool anchors`: the group of verbs that make anchors."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from covertool.cli.app import Verbs, app

if TYPE_CHECKING:
    from geopandas import GeoDataFrame

    from covertool.cli.target import Target
    from covertool.gis.provenance import Provenance

anchors_app = Verbs(
    name="anchors",
    help="""Make anchors: parked cars, queued cars.

    \b
    Examples:
      covertool anchors parked --osm town.osm.pbf --into town.gpkg
      covertool anchors queue --coverage 15
    """,
    no_args_is_help=True,
    rich_markup_mode=None,
)
app.add_typer(anchors_app)


def write_anchors(
    target: Target,
    frame: GeoDataFrame,
    origin: str,
    made_from: Provenance,
    *,
    inputs: Iterable[Path] = (),
) -> None:
    """Write synthetic anchors of one origin; a study keeps its anchors of other origins."""
    from covertool.gis.merge import anchors_beside_others

    new = frame.assign(synthetic=True)
    target.write(
        {"anchors": new},
        made_from.to_metadata(),
        inputs=inputs,
        in_study=lambda study: {"anchors": anchors_beside_others(new, study, origin)},
    )

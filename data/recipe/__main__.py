"""`python -m data.recipe`: make every file of the sample study anew."""

from __future__ import annotations

from pathlib import Path

from covertool.gis.sample import SAMPLE_TRACE
from covertool.gis.write import write_layers
from data.recipe import layers
from data.recipe.observations import observe
from data.recipe.orthophoto import write_orthophoto
from data.recipe.parameters import TOWN, Calibrated
from data.recipe.readme import write_readme
from data.recipe.town import lay_out, park
from data.recipe.trace import write_trace

FOLDER = Path(__file__).parents[1]


def main() -> None:
    """Write the study, its orthophoto, mask, trace and observations, and the README's tables."""
    calibrated = Calibrated()
    fabric = lay_out(calibrated)
    cars = park(fabric, calibrated)
    transit, segments = layers.transit_area(fabric), layers.segments(fabric)
    write_layers(
        FOLDER / "sample.gpkg",
        {
            "vehicles": layers.vehicles(cars).to_frame(),
            "anchors": layers.anchors(cars).to_frame(),
            "transit": transit.to_frame(),
            "segments": segments,
            "streets": layers.streets(fabric),
            "buildings": layers.buildings(fabric),
        },
        overwrite=True,
        metadata={
            "title": TOWN,
            "synthetic": "yes: no real place, made by data/recipe",
            "licence": "MIT",
            "data_date": "none: drawn, not surveyed",
        },
    )
    write_trace(FOLDER / SAMPLE_TRACE, layers.streets(fabric))
    observe(segments).to_csv(FOLDER / "observations.csv", index=False, lineterminator="\n")
    write_orthophoto(FOLDER, fabric, layers.vehicles(cars))
    write_readme(FOLDER, transit, layers.anchors(cars))


if __name__ == "__main__":
    main()

"""Large buildings on reserved land: campus blocks, sheds, shops, a school."""

from __future__ import annotations

import numpy as np
import shapely

from data.recipe.curves import rectangle
from data.recipe.parameters import stream
from data.recipe.plots import Building

_SIZES_M: dict[str, tuple[tuple[float, float], tuple[float, float], float, int]] = {
    "south campus": ((28, 60), (14, 24), 14.0, 16),
    "north campus": ((26, 55), (14, 22), 12.0, 14),
    "retail park": ((40, 80), (28, 45), 8.0, 5),
    "business park": ((40, 75), (25, 45), 10.0, 12),
    "industrial estate": ((35, 70), (22, 40), 9.0, 14),
    "school ground": ((35, 60), (14, 22), 7.0, 3),
}


def large_buildings(land: dict[str, shapely.Polygon], taken: shapely.Geometry) -> list[Building]:
    """Return large buildings strewn over the reserved land, clear of all that is taken."""
    rng = stream("large buildings")
    found: list[Building] = []
    for name, (lengths, widths, height_m, wanted) in _SIZES_M.items():
        ground = land[name].buffer(-6.0).difference(taken.buffer(6.0))
        shapely.prepare(ground)
        x0, y0, x1, y1 = ground.bounds
        angle = rng.uniform(0, np.pi / 2)
        placed: list[shapely.Polygon] = []
        for _ in range(400):
            turn = angle + rng.normal(0, 0.05)
            along = np.array([np.cos(turn), np.sin(turn)])
            centre = np.array([rng.uniform(x0, x1), rng.uniform(y0, y1)])
            block = shapely.Polygon(
                rectangle(centre, along, rng.uniform(*lengths), rng.uniform(*widths))
            )
            clear = all(block.distance(other) > 12.0 for other in placed)
            if clear and ground.contains(block):
                placed.append(block)
            if len(placed) == wanted:
                break
        found += [Building(block, name, height_m * rng.uniform(0.8, 1.2)) for block in placed]
    return found

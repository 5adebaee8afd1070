"""A transit area in pieces, as tiles read it: put together again, wherever it was cut."""

from pathlib import Path

import geopandas as gpd
import pytest
import shapely

from covertool.gis.sources import ParquetTransit, open_transit, write_transit
from covertool.model import TransitArea

X, Y = 695_000.0, 737_000.0


def moved(corners: list[tuple[float, float]]) -> shapely.Polygon:
    return shapely.Polygon([(X + x, Y + y) for x, y in corners])


def test_pieces_with_a_vertex_on_one_side_of_their_common_edge_are_one_area(
    tmp_path: Path,
) -> None:
    pieces = [
        moved([(0, 0), (1, 0), (1, 1), (0, 1)]),
        moved([(1, 0), (2, 0), (2, 1), (1, 1), (1, 0.5)]),
    ]
    path = tmp_path / "roads.parquet"
    gpd.GeoDataFrame({"piece": [0, 1]}, geometry=pieces, crs=2157).to_parquet(
        path, write_covering_bbox=True, schema_version="1.1.0"
    )
    source = open_transit(str(path), None, None)
    assert isinstance(source, ParquetTransit)
    whole = source.read().polygons
    assert len(whole.geoms) == 1
    assert whole.area == pytest.approx(2.0)


def test_an_area_cut_in_pieces_is_the_same_area_again(tmp_path: Path) -> None:
    ring = shapely.Point(X, Y).buffer(300, quad_segs=2000)
    ring = ring.difference(shapely.Point(X, Y).buffer(290, quad_segs=2000))
    transit = TransitArea(shapely.MultiPolygon([ring]), crs=gpd.GeoSeries(crs=2157).crs)
    write_transit(tmp_path / "roads.parquet", transit)
    source = open_transit(str(tmp_path / "roads.parquet"), None, None)
    again = source.read().polygons
    assert again.symmetric_difference(transit.polygons).area < 1e-6
    quarter = source.read((X, Y, X + 300, Y + 300))
    assert quarter.area_m2 == pytest.approx(transit.area_m2 / 4, rel=1e-9)

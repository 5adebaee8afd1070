"""Each format opened by Debian's own GDAL, another build and version than the one that wrote it."""

import json
import re
import shutil
import subprocess
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely

from covertool.gis.level_raster import write_level_raster
from covertool.gis.write import write_layers

ROAD = shapely.Polygon(
    [(695000, 737000), (695100, 737000), (695100, 737100), (695000, 737100)],
    [[(695040, 737040), (695040, 737060), (695060, 737060), (695060, 737040)]],
)
AREA_M2 = 100.0**2 - 20.0**2


def road() -> gpd.GeoDataFrame:
    columns = {"name": ["Sráid Mhór"], "level": [1], "radius_m": [15.0], "device_class": ["A"]}
    return gpd.GeoDataFrame(columns, geometry=[ROAD], crs=2157)


def told_by(program: str, *arguments: object) -> str:
    if shutil.which(program) is None:
        pytest.skip(f"{program} is not installed (Debian: apt-get install gdal-bin)")
    done = subprocess.run(
        [program, *map(str, arguments)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "partially supported" not in done.stderr
    return done.stdout


@pytest.mark.parametrize("suffix", ["gpkg", "geojson", "fgb", "kml", "shp"])
def test_ogrinfo_reads_the_layer_its_text_and_its_place(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"t.{suffix}"
    write_layers(path, {"coverage_level_1": road()}, metadata={"title": "Ó Riain's town"})
    layers = ["coverage_level_1"] if suffix == "gpkg" else []
    text = told_by("ogrinfo", "-al", path, *layers)
    assert "Feature Count: 1" in text
    assert "Sráid Mhór" in text
    assert "POLYGON" in text
    extent = re.search(r"Extent: \((\S+), (\S+)\) - \((\S+), (\S+)\)", text)
    assert extent is not None
    x0, y0, x1, y1 = map(float, extent.groups())
    if suffix in ("geojson", "kml"):
        assert -6.6 < x0 < x1 < -6.5
        assert 53.3 < y0 < y1 < 53.5
    else:
        assert (x0, y0, x1, y1) == (695000, 737000, 695100, 737100)
        assert 'ID["EPSG",2157]' in text


def test_zipped_shapefiles_hold_every_layer_under_its_short_name(tmp_path: Path) -> None:
    path = tmp_path / "town.shp.zip"
    layers = {"coverage_level_1": road(), "coverage_level_3": road(), "transit": road()}
    write_layers(path, layers, metadata={"title": "town"})
    text = told_by("ogrinfo", path)
    assert all(f": {name} (Polygon)" in text for name in ("cov_l1", "cov_l3", "transit"))
    text = told_by("ogrinfo", "-al", path, "cov_l3")
    assert "dev_class (String) = A" in text
    assert "Sráid Mhór" in text
    again = tmp_path / "again.shp.zip"
    write_layers(again, layers, metadata={"title": "town"})
    assert path.read_bytes() == again.read_bytes()


def test_a_table_is_read_as_one_and_the_metadata_beside_it(tmp_path: Path) -> None:
    path = tmp_path / "t.gpkg"
    summary = pd.DataFrame({"radius_m": [15.0], "fraction": [0.4522]})
    write_layers(path, {"transit": road(), "coverage_summary": summary}, metadata={"title": "é"})
    text = told_by("ogrinfo", "-al", path, "coverage_summary")
    assert "Geometry: None" in text
    assert "fraction (Real) = 0.4522" in text
    assert "value (String) = é" in told_by("ogrinfo", "-al", path, "metadata")


def test_gdalinfo_reads_the_level_raster_with_colours_and_overviews(tmp_path: Path) -> None:
    path = tmp_path / "levels.tif"
    levels = np.tile(np.arange(4, dtype=np.uint8), (1200, 300))
    levels[:, :10] = 255
    from pyproj import CRS

    write_level_raster(
        path, [(0, 0, levels)], (1200, 1200), (0.5, 0, 695000, 0, -0.5, 737600), CRS(2157)
    )
    told = json.loads(told_by("gdalinfo", "-json", "-stats", path))
    band = told["bands"][0]
    assert told["size"] == [1200, 1200]
    assert told["geoTransform"] == [695000, 0.5, 0, 737600, 0, -0.5]
    assert told["metadata"]["IMAGE_STRUCTURE"]["LAYOUT"] == "COG"
    assert (band["type"], band["noDataValue"], band["colorInterpretation"]) == (
        "Byte",
        255,
        "Palette",
    )
    assert band["overviews"]
    assert (band["minimum"], band["maximum"]) == (0, 3)


def test_a_workbook_is_read_by_gdal_too(tmp_path: Path) -> None:
    from covertool.gis.spreadsheet import write_workbook
    from covertool.model.sheets import Heading, Sheet

    path = tmp_path / "t.xlsx"
    headings = (Heading("place", "place"), Heading("area_m2", "area (m2)", 0))
    write_workbook(path, [Sheet("summary", "s", headings, (("=A1", 12.25), ("Straße", 3.0)))])
    text = told_by("ogrinfo", "-al", path, "summary")
    assert "Feature Count: 2" in text
    assert "= =A1" in text
    assert "12.25" in text

"""Level maps as Cloud Optimized GeoTIFFs in the paper's colours."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import numpy.typing as npt
import rasterio
import rasterio.shutil
from pyproj import CRS
from rasterio.transform import Affine
from rasterio.windows import Window

from covertool.errors import FileError
from covertool.gis import guard
from covertool.gis.formats import RASTER_FORMATS
from covertool.gis.styles import LEVEL_COLOURS, TRANSIT_COLOUR, rgb

NODATA = 255
_TILE = 512

Block = tuple[int, int, npt.NDArray[np.uint8]]


def write_level_raster(
    path: str | Path,
    blocks: Iterable[Block],
    shape: tuple[int, int],
    transform: tuple[float, float, float, float, float, float],
    crs: CRS,
    *,
    overwrite: bool = False,
) -> None:
    """Write a raster of Levels 0-3 as a tiled COG with colour table, overviews and statistics.

    Parameters
    ----------
    path : str or Path
        A ``.tif`` file.
    blocks : iterable of (row, column, (h, w) uint8 array)
        Pieces of the map with their upper left pixel; 255 is outside the transit area. What no
        block covers is 255. Only one block is held in memory at a time.
    shape : (int, int)
        Rows and columns.
    transform : 6 floats
        Affine transform (a, b, c, d, e, f): x = a col + b row + c, y = d col + e row + f.
    crs : CRS
        CRS of the transform.
    overwrite : bool
        Replace an existing file.

    Raises
    ------
    FileError
        When the path may not be written, or the file did not arrive whole.
    """
    checked, _ = guard.output_file(path, RASTER_FORMATS[:1], overwrite=overwrite)
    with guard.replacing(checked) as temporary:
        tiled = temporary.with_name(f"{temporary.stem}.tiled.tif")
        _write_tiled(tiled, blocks, shape, transform, crs)
        rasterio.shutil.copy(
            tiled,
            temporary,
            driver="COG",
            COMPRESS="DEFLATE",
            BLOCKSIZE=str(_TILE),
            OVERVIEW_RESAMPLING="MODE",
            STATISTICS="YES",
            BIGTIFF="IF_SAFER",
        )
        _check(temporary, checked, shape)


def _write_tiled(
    path: Path,
    blocks: Iterable[Block],
    shape: tuple[int, int],
    transform: tuple[float, float, float, float, float, float],
    crs: CRS,
) -> None:
    """Write the blocks as a plain tiled GeoTIFF, from which the COG is made."""
    with rasterio.open(
        path,
        "w",
        driver="GTiff",
        height=shape[0],
        width=shape[1],
        count=1,
        dtype="uint8",
        nodata=NODATA,
        crs=rasterio.crs.CRS.from_wkt(crs.to_wkt()),
        transform=Affine(*transform),
        tiled=True,
        blockxsize=_TILE,
        blockysize=_TILE,
        compress="deflate",
        bigtiff="if_safer",
    ) as dataset:
        dataset.write_colormap(1, _colours())
        for row, column, block in blocks:
            height, width = block.shape
            dataset.write(block, 1, window=Window(column, row, width, height))


def _colours() -> dict[int, tuple[int, int, int, int]]:
    named = {0: TRANSIT_COLOUR, **LEVEL_COLOURS}
    table = {level: (*rgb(colour), 255) for level, colour in named.items()}
    return {**table, NODATA: (0, 0, 0, 0)}


def _check(temporary: Path, path: Path, shape: tuple[int, int]) -> None:
    with rasterio.open(temporary, driver="GTiff") as dataset:
        if dataset.shape != shape:
            raise FileError("the raster did not arrive whole", str(path), "check free space")

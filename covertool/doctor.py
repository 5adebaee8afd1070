"""Whether this installation is sound: engines that agree, data that is there, SUMO that starts."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from covertool.errors import CovertoolError
from covertool.gis.provenance import versions

_PLACE = (-6.2603, 53.3498)  # O'Connell Street, Dublin
_CLASHING = ("PROJ_DATA", "PROJ_LIB", "GDAL_DATA")


@dataclass(frozen=True)
class Check:
    """One thing that was looked at: whether it is sound, and what was found.

    ``sound`` is None where a part is optional and absent.
    """

    name: str
    sound: bool | None
    found: str


def examine() -> list[Check]:
    """Return every check of this installation; none of them raises."""
    checks = (
        ("versions", _versions),
        ("PROJ", _projections_agree),
        ("environment", _environment),
        ("GDAL", _drivers),
        ("sample study", _sample),
        ("detector", _detector),
        ("compiled kernels", _kernel_cache),
        ("SUMO", _sumo),
        ("dask", _dask),
    )
    return [_examined(name, look) for name, look in checks]


def _examined(name: str, look: Callable[[], tuple[bool | None, str]]) -> Check:
    try:
        return Check(name, *look())
    except CovertoolError as error:
        return Check(name, False, f"{error.what} ({error.where}): {error.mend}")
    except Exception as error:  # a broken library may raise anything; that it does is the finding
        return Check(name, False, f"{type(error).__name__}: {error}")


def _versions() -> tuple[bool, str]:
    named = ", ".join(f"{name} {version}" for name, version in versions().items())
    return True, f"Python {sys.version.split()[0]}, {named}"


def _projections_agree() -> tuple[bool, str]:
    """Transform one place by the PROJ of pyproj and by that of rasterio, each with its database."""
    import pyproj
    from rasterio.warp import transform as warp

    to_irish = pyproj.Transformer.from_crs(4326, 2157, always_xy=True)
    one = to_irish.transform(*_PLACE)
    x, y = warp("EPSG:4326", "EPSG:2157", [_PLACE[0]], [_PLACE[1]])
    apart_m = float(np.hypot(one[0] - x[0], one[1] - y[0]))
    sound = apart_m < 1e-3
    said = "agree" if sound else "DISAGREE"
    return sound, f"pyproj and rasterio {said}: {apart_m:.1e} m apart at one place"


def _environment() -> tuple[bool, str]:
    """Look for variables that point every library at one PROJ or GDAL database."""
    set_here = [name for name in _CLASHING if os.environ.get(name)]
    if not set_here:
        return True, "no variable points PROJ or GDAL at another database"
    told = ", ".join(f"{name}={os.environ[name]}" for name in set_here)
    return True, f"{told}; unset it if PROJ above disagrees or fails"


def _drivers() -> tuple[bool, str]:
    import pyogrio
    import rasterio.drivers

    needed = {"GPKG", "GeoJSON", "FlatGeobuf", "ESRI Shapefile", "OSM"}
    missing = sorted(needed - set(pyogrio.list_drivers()))
    if missing:
        return False, f"pyogrio lacks the drivers {', '.join(missing)}"
    rasters = len(rasterio.drivers.raster_driver_extensions())
    return True, f"{len(needed)} vector drivers, {rasters} raster extensions"


def _sample() -> tuple[bool, str]:
    from covertool.gis.sample import SAMPLE_STUDY, sample_folder
    from covertool.gis.study import layer_names

    path = sample_folder() / SAMPLE_STUDY
    return True, f"{path}: layers {', '.join(layer_names(path))}"


def _detector() -> tuple[bool, str]:
    from covertool.extract.detectors import default_detector

    detector = default_detector()
    meadow = np.full((128, 128, 3), 90, dtype=np.uint8)
    seen = detector.detect(meadow, np.ones(meadow.shape[:2], dtype=bool))
    name, cars = type(detector).__name__, len(seen)
    return cars == 0, f"{name} at {detector.gsd_m:g} m sees {cars} cars in a grey square"


def _kernel_cache() -> tuple[bool, str]:
    """Look where numba keeps compiled kernels: without a writable place each start compiles."""
    import covertool

    folder = Path(os.environ.get("NUMBA_CACHE_DIR") or Path(covertool.__file__).parent)
    kept = sum(1 for _ in folder.rglob("*.nbi"))
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError:
        return False, f"{folder} is not writable: set NUMBA_CACHE_DIR to a folder of your own"
    return True, f"{kept} kept in {folder}"


def _sumo() -> tuple[bool | None, str]:
    from covertool.errors import MissingExtraError
    from covertool.traffic.sumo import find_sumo

    try:
        sumo = find_sumo()
    except MissingExtraError as error:
        return None, f"not installed: {error.mend}"
    return True, f"{sumo.version} in {sumo.home}"


def _dask() -> tuple[bool | None, str]:
    from importlib.util import find_spec

    if find_spec("distributed") is None:
        return None, "not installed: pip install 'covertool[scale]'"
    from importlib.metadata import version

    return True, version("dask")

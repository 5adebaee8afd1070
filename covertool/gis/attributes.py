"""The columns of anchors and vehicles: found by name, checked, filled where nothing is known."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from covertool.dsrc import DEVICE_CLASSES
from covertool.errors import ColumnError
from covertool.gis import tables
from covertool.gis.repair import Repairs
from covertool.model import ORIGINS, Floats, Objects

if TYPE_CHECKING:
    import geopandas as gpd
    import pandas as pd


def column(frame: gpd.GeoDataFrame, name: str) -> str | None:
    """Return the column of a name in any case, or None.

    Raises
    ------
    ColumnError
        When two columns differ only in case.
    """
    found = [str(known) for known in frame.columns if str(known).lower() == name]
    if len(found) > 1:
        raise ColumnError(f"columns {' and '.join(found)} differ only in case", name, "rename one")
    return found[0] if found else None


def ids(frame: gpd.GeoDataFrame, repairs: Repairs) -> Objects:
    """Return ids as text; numbered from 1 where missing, renumbered where not unique."""
    name = column(frame, "id")
    if name is None:
        return np.array([str(i + 1) for i in range(len(frame))], dtype=object)
    given = _as_text(frame[name])
    missing = given.isna().to_numpy(dtype=bool)
    bad = given.duplicated().to_numpy(dtype=bool) | missing
    texts: Objects = given.to_numpy(dtype=object, na_value="")
    repairs.note("repeated or missing ids numbered anew", int(bad.sum()))
    taken = set(texts[~bad])
    fresh = (str(n) for n in range(1, 2 * len(texts) + 1) if str(n) not in taken)
    texts[bad] = [next(fresh) for _ in range(int(bad.sum()))]
    return texts


def _as_text(column: pd.Series) -> pd.Series:
    whole = column.dtype.kind == "f" and bool((column.dropna() % 1 == 0).all())
    return (column.astype("Int64") if whole else column).astype("string")


def floats(frame: gpd.GeoDataFrame, name: str, where: str) -> Floats:
    """Return a column as floats, NaN where it is missing or empty.

    Raises
    ------
    ColumnError
        When a cell holds text that is not a number.
    """
    found = column(frame, name)
    if found is None:
        return np.full(len(frame), np.nan)
    values = tables.numbers(frame[found]).to_numpy(dtype=float)
    text = np.isnan(values) & ~frame[found].isna().to_numpy(dtype=bool)
    if text.any():
        worst = frame[found].to_numpy()[text][0]
        raise ColumnError(f"{name} holds {worst!r}, which is not a number", where, "correct it")
    return values


def radii(frame: gpd.GeoDataFrame, where: str) -> Floats:
    """Return ``radius_m``: above zero, or NaN where an anchor names none."""
    values = floats(frame, "radius_m", where)
    _require(values, (values > 0) & np.isfinite(values), "radius_m", "above zero", where)
    return values


def sigmas(frame: gpd.GeoDataFrame, where: str) -> Floats:
    """Return ``sigma_m``: zero or more, or NaN where it is not known."""
    values = floats(frame, "sigma_m", where)
    _require(values, (values >= 0) & np.isfinite(values), "sigma_m", "zero or more", where)
    return values


def _require(values: Floats, good: np.ndarray, name: str, range_: str, where: str) -> None:
    bad = ~good & ~np.isnan(values)
    if bad.any():
        raise ColumnError(
            f"{name} must be {range_}; {int(bad.sum())} are not, such as {values[bad][0]:g}",
            where,
            "correct it, or leave the cell empty where it is not known",
        )


def choices(
    frame: gpd.GeoDataFrame, name: str, known: tuple[str, ...], default: str | None, where: str
) -> Objects:
    """Return a column of named choices, in any case, with a default where the cell is empty.

    Raises
    ------
    ColumnError
        When a cell holds none of the choices.
    """
    found = column(frame, name)
    values = np.full(len(frame), default, dtype=object)
    if found is None:
        return values
    given = frame[found].astype("string").str.strip()
    there = given.fillna("").ne("").to_numpy(dtype=bool)
    lookup = {choice.lower(): choice for choice in known}
    chosen = given[there].str.lower().map(lookup)
    if chosen.isna().any():
        worst = given[there][chosen.isna()].iloc[0]
        raise ColumnError(f"{name} holds {worst!r}", where, f"use one of: {', '.join(known)}")
    values[there] = chosen.to_numpy(dtype=object)
    return values


def device_classes(frame: gpd.GeoDataFrame, where: str) -> Objects:
    """Return ``device_class``: A, B, C, D, or None."""
    return choices(frame, "device_class", tuple(DEVICE_CLASSES), None, where)


def origins(frame: gpd.GeoDataFrame, where: str) -> Objects:
    """Return ``origin``: parked, queue or rsu; parked where none is given."""
    return choices(frame, "origin", ORIGINS, "parked", where)


def texts(frame: gpd.GeoDataFrame, name: str) -> Objects:
    """Return a column of text with None where there is nothing."""
    found = column(frame, name)
    values = np.full(len(frame), None, dtype=object)
    if found is not None:
        there = frame[found].notna().to_numpy(dtype=bool)
        values[there] = frame[found][there].astype(str).to_numpy(dtype=object)
    return values


def flags(frame: gpd.GeoDataFrame, name: str) -> Objects:
    """Return a column of True, False and None."""
    found = column(frame, name)
    values = np.full(len(frame), None, dtype=object)
    if found is not None:
        there = frame[found].notna().to_numpy(dtype=bool)
        values[there] = [bool(value) for value in frame[found][there]]
    return values

"""The columns of anchors and vehicles: found by name, checked, filled where nothing is known."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from covertool.dsrc import DEVICE_CLASSES
from covertool.errors import ColumnError
from covertool.gis.features import Column, present
from covertool.gis.repair import Repairs
from covertool.gis.tables import number
from covertool.model import ORIGINS, Floats, Objects


@dataclass(frozen=True)
class Table:
    """Columns of one length by name, and the file and layer that they come from."""

    columns: Mapping[str, Column]
    size: int
    where: str

    def column(self, name: str) -> Column | None:
        """Return the column of a name in any case, or None.

        Raises
        ------
        ColumnError
            When two columns differ only in case.
        """
        found = [known for known in self.columns if known.lower() == name]
        if len(found) > 1:
            raise ColumnError(
                f"columns {' and '.join(found)} differ only in case", name, "rename one"
            )
        return self.columns[found[0]] if found else None


def ids(table: Table, repairs: Repairs) -> Objects:
    """Return ids as text; numbered from 1 where missing, renumbered where not unique."""
    given = table.column("id")
    if given is None:
        return np.array([str(i + 1) for i in range(table.size)], dtype=object)
    there = present(given)
    texts = np.full(table.size, "", dtype=object)
    texts[there] = _as_text(given[there])
    places: dict[str, int] = {}
    for place, text in enumerate(texts):
        places.setdefault(text, place)
    bad = np.ones(table.size, dtype=bool)
    bad[list(places.values())] = False
    bad |= ~there
    repairs.note("repeated or missing ids numbered anew", int(bad.sum()))
    taken = set(texts[~bad])
    fresh = (str(n) for n in range(1, 2 * len(texts) + 1) if str(n) not in taken)
    texts[bad] = [next(fresh) for _ in range(int(bad.sum()))]
    return texts


def _as_text(values: Column) -> list[str]:
    whole = values.dtype.kind == "f" and bool((values % 1 == 0).all())
    return [str(int(value)) if whole else str(value) for value in values.tolist()]


def floats(table: Table, name: str) -> Floats:
    """Return a column as floats, NaN where it is missing or empty.

    Raises
    ------
    ColumnError
        When a cell holds text that is not a number.
    """
    found = table.column(name)
    if found is None:
        return np.full(table.size, np.nan)
    if found.dtype.kind in "fiub":
        return found.astype(float)
    there = present(found)
    values = np.full(table.size, np.nan)
    values[there] = [number(value) for value in found[there]]
    text = np.isnan(values) & there
    if text.any():
        worst = found[text][0]
        raise ColumnError(
            f"{name} holds {worst!r}, which is not a number", table.where, "correct it"
        )
    return values


def radii(table: Table) -> Floats:
    """Return ``radius_m``: above zero, or NaN where an anchor names none."""
    values = floats(table, "radius_m")
    _require(values, (values > 0) & np.isfinite(values), "radius_m", "above zero", table.where)
    return values


def sigmas(table: Table) -> Floats:
    """Return ``sigma_m``: zero or more, or NaN where it is not known."""
    values = floats(table, "sigma_m")
    _require(values, (values >= 0) & np.isfinite(values), "sigma_m", "zero or more", table.where)
    return values


def _require(
    values: Floats, good: npt.NDArray[np.bool_], name: str, range_: str, where: str
) -> None:
    bad = ~good & ~np.isnan(values)
    if bad.any():
        raise ColumnError(
            f"{name} must be {range_}; {int(bad.sum())} are not, such as {values[bad][0]:g}",
            where,
            "correct it, or leave the cell empty where it is not known",
        )


def choices(table: Table, name: str, known: tuple[str, ...], default: str | None) -> Objects:
    """Return a column of named choices, in any case, with a default where the cell is empty.

    Raises
    ------
    ColumnError
        When a cell holds none of the choices.
    """
    found = table.column(name)
    values = np.full(table.size, default, dtype=object)
    if found is None:
        return values
    lookup: dict[str, Any] = {choice.lower(): choice for choice in known} | {"": default}
    texts = [str(value).strip() for value in found[present(found)]]
    wrong = next((text for text in texts if text.lower() not in lookup), None)
    if wrong is not None:
        raise ColumnError(f"{name} holds {wrong!r}", table.where, f"use one of: {', '.join(known)}")
    values[present(found)] = [lookup[text.lower()] for text in texts]
    return values


def device_classes(table: Table) -> Objects:
    """Return ``device_class``: A, B, C, D, or None."""
    return choices(table, "device_class", tuple(DEVICE_CLASSES), None)


def origins(table: Table) -> Objects:
    """Return ``origin``: parked, queue or rsu; parked where none is given."""
    return choices(table, "origin", ORIGINS, "parked")


def texts(table: Table, name: str) -> Objects:
    """Return a column of text with None where there is nothing."""
    return _each(table, name, str)


def flags(table: Table, name: str) -> Objects:
    """Return a column of True, False and None."""
    return _each(table, name, bool)


def _each(table: Table, name: str, kind: Callable[[Any], object]) -> Objects:
    """Return a column whose cells are of a kind, None where there is nothing."""
    found = table.column(name)
    values = np.full(table.size, None, dtype=object)
    if found is not None:
        values[present(found)] = [kind(value) for value in found[present(found)]]
    return values

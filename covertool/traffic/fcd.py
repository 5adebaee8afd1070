"""Rows of SUMO's floating car data, from CSV, XML or Parquet."""

from __future__ import annotations

import re
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np
import numpy.typing as npt

from covertool.errors import ColumnError, FileError
from covertool.gis.formats import Format, by_suffix, suffixes
from covertool.gis.streams import open_stream
from covertool.model import Floats, Objects
from covertool.model.tables import Table
from covertool.traffic.xml import elements

if TYPE_CHECKING:
    import pandas as pd

FCD_FORMATS = (
    Format("CSV", "CSV", (".csv", ".csv.gz")),
    Format("XML", "XML", (".xml", ".xml.gz")),
    Format("Parquet", "Parquet", (".parquet",)),
)
_COLUMNS = ("time", "id", "x", "y", "angle", "speed")
_CLOCK = re.compile(r"^-?(?:(\d+):)?(\d+):(\d+):(\d+(?:\.\d+)?)$")


@dataclass(frozen=True)
class FcdRows(Table):
    """Floating car data as SUMO writes it, one row a car and step.

    Attributes
    ----------
    time_s, vehicle : when and who
    x, y : front bumper in coordinates of the net
    angle : heading in degrees, clockwise from the north of the net
    speed : metres per second
    lane, kind : ids of the lane and of the vehicle's type; empty where the file names none
    """

    time_s: Floats
    vehicle: Objects
    x: Floats
    y: Floats
    angle: Floats
    speed: Floats
    lane: Objects
    kind: Objects


def read_rows(path: str | Path) -> FcdRows:
    """Return the rows of cars in a file with SUMO's floating car data.

    Raises
    ------
    FileError
        When the file is absent, of an unknown extension, or cut off.
    ColumnError
        When a column is missing or holds what is no number.
    """
    known = by_suffix(Path(path), FCD_FORMATS)
    if known is None:
        raise FileError(
            "the extension names no format of a trace",
            str(path),
            f"use a file with one of: {suffixes(FCD_FORMATS)}",
        )
    with open_stream(path) as stream:
        read = {"CSV": _from_csv, "XML": _from_xml, "Parquet": _from_parquet}[known.name]
        return _rows(read(stream, str(path)), str(path))


def _from_csv(stream: BinaryIO, where: str) -> pd.DataFrame:
    import pandas as pd

    try:
        head = stream.readline().decode("utf-8-sig").strip()
        mark = max(";,\t", key=head.count)
        names = [name.strip().strip('"') for name in head.split(mark)]
        kinds: dict[str, str] = {name: "str" for name in names if not _is_number(name)}
        return pd.read_csv(stream, sep=mark, names=names, dtype=kinds, header=None, engine="c")
    except (UnicodeDecodeError, pd.errors.ParserError, ValueError, EOFError, zlib.error) as fault:
        raise _damaged("CSV", fault, where) from None


def _from_parquet(stream: BinaryIO, where: str) -> pd.DataFrame:
    import pyarrow
    import pyarrow.parquet

    try:
        found: pd.DataFrame = pyarrow.parquet.read_table(stream).to_pandas()
        return found
    except (pyarrow.ArrowException, OSError) as fault:
        raise _damaged("Parquet", fault, where) from None


def _from_xml(stream: BinaryIO, where: str) -> pd.DataFrame:
    import pandas as pd

    names = (*_COLUMNS[1:], "lane", "type")
    found: list[tuple[str | None, ...]] = []
    for car in elements(stream, {"vehicle"}, where):
        step = car.getparent()
        time = step.get("time") if step is not None else None
        found.append((time, *(car.get(name) for name in names)))
    frame = pd.DataFrame(found, columns=["time", *names])
    return frame.dropna(axis="columns", how="all") if len(frame) else frame


def _rows(frame: pd.DataFrame, where: str) -> FcdRows:
    """Return the rows of cars with a position, by SUMO's names with or without their element."""
    frame = frame.rename(columns={name: _plain(str(name)) for name in frame.columns})
    twice = frame.columns[frame.columns.duplicated()]
    if twice.size:
        raise ColumnError(f"the column {twice[0]} stands twice", where, "leave one of them out")
    missing = [name for name in _COLUMNS if name not in frame.columns]
    if missing:
        raise ColumnError(
            f"the trace has no column {', '.join(missing)}",
            f"{where}: {', '.join(map(str, frame.columns))}",
            "record with --fcd-output.attributes x,y,angle,speed,lane",
        )
    frame = frame[_is_car(frame)]
    return FcdRows(
        time_s=_seconds(frame["time"].to_numpy(dtype=object), where),
        vehicle=np.array([str(name) for name in frame["id"]], dtype=object),
        x=_numbers(frame, "x", where),
        y=_numbers(frame, "y", where),
        angle=_numbers(frame, "angle", where),
        speed=_numbers(frame, "speed", where),
        lane=_texts(frame, "lane"),
        kind=_texts(frame, "type"),
    )


def _texts(frame: pd.DataFrame, name: str) -> Objects:
    values = frame[name].to_numpy(dtype=object) if name in frame else np.full(len(frame), "")
    return values.astype(object)


def _plain(name: str) -> str:
    """Return SUMO's attribute without its element: ``vehicle_x`` is ``x``; a person's stay."""
    for element in ("timestep_", "vehicle_"):
        name = name.removeprefix(element)
    return name


def _is_number(name: str) -> bool:
    return _plain(name) in ("x", "y", "angle", "speed")


def _is_car(frame: pd.DataFrame) -> npt.NDArray[np.bool_]:
    """Return which rows are cars with a place; SUMO gives persons no lane."""
    good = frame["id"].notna() & (frame["id"].astype(str) != "") & frame["x"].notna()
    if "lane" in frame:
        good &= frame["lane"].notna() & (frame["lane"].astype(str) != "")
    return good.to_numpy(dtype=bool)


def _numbers(frame: pd.DataFrame, name: str, where: str) -> Floats:
    try:
        values = frame[name].to_numpy(dtype=float)
    except (ValueError, TypeError):
        values = np.array([np.nan])
    if not np.isfinite(values).all():
        raise ColumnError(
            f"the column {name} holds what is no number", where, "record it again with SUMO"
        )
    return values


def _seconds(values: Objects, where: str) -> Floats:
    """Return times in seconds, also those that SUMO wrote as [days:]hours:minutes:seconds."""
    try:
        if any(isinstance(value, str) and ":" in value for value in values[:1]):
            return np.array([clock_s(str(value)) for value in values])
        times: Floats = values.astype(float)
        if not np.isfinite(times).all():
            raise ValueError("inf")
        return times
    except (ValueError, TypeError):
        raise ColumnError(
            "the column time holds what is no time", where, "record it again with SUMO"
        ) from None


def clock_s(text: str) -> float:
    """Return the seconds of a time that SUMO wrote as [days:]hours:minutes:seconds.

    >>> clock_s("1:00:01:30")
    86490.0
    """
    found = _CLOCK.match(text)
    if found is None:
        raise ValueError(text)
    days, hours, minutes, seconds = (float(part or 0) for part in found.groups())
    return ((days * 24 + hours) * 60 + minutes) * 60 + seconds


def _damaged(kind: str, fault: BaseException, where: str) -> FileError:
    told = str(fault).strip().splitlines()
    return FileError(
        f"the {kind} is damaged or cut off: {told[0] if told else type(fault).__name__}",
        where,
        "record it again, or copy it again",
    )

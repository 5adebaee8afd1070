"""Observation tables in Parquet and CSV: written batch by batch, put in place whole."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from covertool.errors import FileError
from covertool.gis import guard
from covertool.gis.formats import CSV, GEOPARQUET
from covertool.model import Observations

if TYPE_CHECKING:
    import pandas as pd

FORMATS = (GEOPARQUET, CSV)


def write_observations(
    path: str | Path, batches: Iterable[Observations], *, overwrite: bool = False
) -> int:
    """Write observations to a Parquet or CSV file and return how many; all of them or none.

    Raises
    ------
    FileError
        When the path cannot be written, or the written file does not hold every row.
    """
    target, known = guard.output_file(path, FORMATS, overwrite=overwrite)
    with guard.replacing(target) as temporary:
        write, count = (
            (_write_csv, _count_csv) if known is CSV else (_write_parquet, _count_parquet)
        )
        rows = write(temporary, (batch.to_frame() for batch in batches))
        if count(temporary) != rows:
            raise FileError("rows were lost in writing", str(target), "check the disk's free space")
    return rows


def _write_parquet(path: Path, frames: Iterator[pd.DataFrame]) -> int:
    import pyarrow as pa
    import pyarrow.parquet as pq

    moment, number = pa.timestamp("us", tz="UTC"), pa.float64()
    schema = pa.schema(
        [
            ("segment_id", pa.string()),
            ("time", moment),
            ("until", moment),
            ("status", pa.string()),
            ("relative_speed", number),
            ("speed_mps", number),
            ("queue_m", number),
            ("line", pa.binary()),
        ]
    )
    rows = 0
    with pq.ParquetWriter(path, schema) as writer:
        for frame in frames:
            writer.write_table(pa.Table.from_pandas(frame, schema=schema, preserve_index=False))
            rows += len(frame)
    return rows


def _write_csv(path: Path, frames: Iterator[pd.DataFrame]) -> int:
    rows = 0
    with path.open("w", encoding="utf-8", newline="") as file:
        for place, frame in enumerate(frames):
            # Lines do not fit a text table; the segment's id is what a CSV joins by.
            text = frame.drop(columns="line")
            for name in ("time", "until"):
                text[name] = text[name].map(_iso, na_action="ignore")
            text.to_csv(file, index=False, header=place == 0, lineterminator="\n")
            rows += len(frame)
        if rows == 0:
            file.write("segment_id,time,until,status,relative_speed,speed_mps,queue_m\n")
    return rows


def _iso(moment: Any) -> str:
    return str(moment.isoformat())


def _count_parquet(path: Path) -> int:
    import pyarrow.parquet as pq

    return int(pq.read_metadata(path).num_rows)


def _count_csv(path: Path) -> int:
    import csv

    with path.open(encoding="utf-8", newline="") as file:
        return sum(1 for _ in csv.reader(file)) - 1

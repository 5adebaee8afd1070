"""Tables of many rows as CSV or Parquet, written part by part, put in place whole."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from covertool.errors import FileError
from covertool.gis import guard
from covertool.gis.formats import Format

if TYPE_CHECKING:
    import pandas as pd

RECORD_FORMATS = (Format("CSV", "", (".csv",)), Format("Parquet", "", (".parquet",)))


def write_records(
    path: str | Path, frames: Iterable[pd.DataFrame], *, overwrite: bool = False
) -> int:
    """Write tables of the same columns below one another, and return the number of rows.

    Raises
    ------
    FileError
        When the path cannot be written, or the written file does not hold every row.
    """
    target, known = guard.output_file(path, RECORD_FORMATS, overwrite=overwrite)
    write = _write_csv if known.name == "CSV" else _write_parquet
    with guard.replacing(target) as temporary:
        rows = write(temporary, frames)
        if _count(temporary, known) != rows:
            raise FileError("rows were lost in writing", str(target), "check the disk's free space")
    return rows


def _write_csv(path: Path, frames: Iterable[pd.DataFrame]) -> int:
    rows = 0
    with path.open("w", encoding="utf-8", newline="") as file:
        for frame in frames:
            frame.to_csv(file, index=False, header=rows == 0, lineterminator="\n")
            rows += len(frame)
    return rows


def _write_parquet(path: Path, frames: Iterable[pd.DataFrame]) -> int:
    import pyarrow as pa
    import pyarrow.parquet as pq

    rows = 0
    writer: pq.ParquetWriter | None = None
    try:
        for frame in frames:
            schema = None if writer is None else writer.schema
            table = pa.Table.from_pandas(frame, schema=schema, preserve_index=False)
            writer = writer or pq.ParquetWriter(path, table.schema, compression="zstd")
            writer.write_table(table)
            rows += len(frame)
    finally:
        if writer is not None:
            writer.close()
    return rows


def _count(path: Path, known: Format) -> int:
    if known.name == "CSV":
        with path.open("rb") as file:
            return sum(1 for _ in file) - 1
    import pyarrow.parquet as pq

    return int(pq.ParquetFile(path).metadata.num_rows)

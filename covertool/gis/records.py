"""Tables of many rows as CSV or Parquet, written part by part, put in place whole."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from covertool.errors import FileError
from covertool.gis import guard
from covertool.gis.formats import Format, by_suffix

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

CSV_RECORDS = Format("CSV", "", (".csv",))
RECORD_FORMATS = (CSV_RECORDS, Format("Parquet", "", (".parquet",)))


def is_csv(path: str | Path) -> bool:
    """Return True for a path whose extension is that of CSV.

    >>> is_csv("observations.csv"), is_csv("observations.parquet")
    (True, False)
    """
    return by_suffix(Path(path), RECORD_FORMATS) is CSV_RECORDS


def write_records(
    path: str | Path,
    frames: Iterable[pd.DataFrame],
    *,
    schema: pa.Schema | None = None,
    overwrite: bool = False,
) -> int:
    """Write tables of the same columns below one another, and return the number of rows.

    Parameters
    ----------
    path : str or Path
        A .csv or .parquet file.
    frames : iterable of DataFrame
        One is held at a time.
    schema : pyarrow schema, optional
        Names and types of the columns; those of the first frame when None.
    overwrite : bool
        Replace an existing file.

    Raises
    ------
    FileError
        When the path cannot be written, or the written file does not hold every row.
    """
    target, known = guard.output_file(path, RECORD_FORMATS, overwrite=overwrite)
    write, count = (
        (_write_csv, _count_csv) if known is CSV_RECORDS else (_write_parquet, _count_parquet)
    )
    with guard.replacing(target) as temporary:
        rows = write(temporary, frames, schema)
        if count(temporary) != rows:
            raise FileError("rows were lost in writing", str(target), "check the disk's free space")
    return rows


def _write_csv(path: Path, frames: Iterable[pd.DataFrame], schema: pa.Schema | None) -> int:
    rows = 0
    with path.open("w", encoding="utf-8", newline="") as file:
        if schema is not None:
            file.write(",".join(schema.names) + "\n")
        for frame in frames:
            head = schema is None and rows == 0
            frame.to_csv(file, index=False, header=head, lineterminator="\n")
            rows += len(frame)
    return rows


def _write_parquet(path: Path, frames: Iterable[pd.DataFrame], schema: pa.Schema | None) -> int:
    """Write tables as Parquet and return the number of rows."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    rows = 0
    with ExitStack() as opened:
        writer: pq.ParquetWriter | None = None

        def writer_of(known: pa.Schema) -> pq.ParquetWriter:
            return opened.enter_context(pq.ParquetWriter(path, known, compression="zstd"))

        if schema is not None:
            writer = writer_of(schema)
        for frame in frames:
            types = None if writer is None else writer.schema
            table = pa.Table.from_pandas(frame, schema=types, preserve_index=False)
            writer = writer or writer_of(table.schema)
            writer.write_table(table)
            rows += len(frame)
    return rows


def _count_csv(path: Path) -> int:
    with path.open(encoding="utf-8", newline="") as file:
        return sum(1 for _ in csv.reader(file)) - 1


def _count_parquet(path: Path) -> int:
    import pyarrow.parquet as pq

    return int(pq.read_metadata(path).num_rows)

"""Observations in a Parquet table; the columns are those of ``feeds.columns``."""

from __future__ import annotations

from collections.abc import Iterator
from typing import BinaryIO

from covertool.congestion.feeds.columns import observations_of
from covertool.congestion.feeds.protocol import FeedOptions
from covertool.errors import FileError
from covertool.model import Observations

_ROWS = 200_000


def read(stream: BinaryIO, options: FeedOptions) -> Iterator[Observations]:
    """Yield the rows of a Parquet table in batches."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        for batch in pq.ParquetFile(stream).iter_batches(batch_size=_ROWS):
            yield observations_of(batch.to_pandas(), options)
    except (pa.ArrowException, OSError) as fault:
        raise FileError(
            f"the Parquet table cannot be read: {fault}", options.where, "write it again"
        ) from None

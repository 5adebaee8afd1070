"""Observations in a CSV table; the columns are those of ``feeds.columns``."""

from __future__ import annotations

from collections.abc import Iterator
from typing import BinaryIO

from covertool.congestion.feeds.columns import observations_of
from covertool.congestion.feeds.protocol import FeedOptions, keep_or_raise
from covertool.errors import FileError, TruncatedError
from covertool.model import Observations

_ROWS = 200_000


def read(stream: BinaryIO, options: FeedOptions) -> Iterator[Observations]:
    """Yield the rows of a CSV table (comma, UTF-8) in batches.

    Examples
    --------
    >>> import io
    >>> text = b"segment_id,time,status\\na,2014-06-16T12:00Z,slow\\n"
    >>> [batch.status.tolist() for batch in read(io.BytesIO(text), FeedOptions())]
    [['slow']]
    """
    import pandas as pd

    rows = 0
    try:
        with pd.read_csv(
            stream,
            dtype=str,
            chunksize=_ROWS,
            keep_default_na=False,
            na_values=["", "NA", "null"],
            skipinitialspace=True,
            encoding="utf-8-sig",
        ) as chunks:
            for chunk in chunks:
                yield observations_of(chunk.reset_index(drop=True), options)
                rows += len(chunk)
    except EOFError:
        cut = TruncatedError("the compressed table ends early", options.where, "fetch it again")
        keep_or_raise(cut, rows, options)
    except (pd.errors.ParserError, pd.errors.EmptyDataError, UnicodeDecodeError) as fault:
        raise FileError(
            f"the table cannot be read: {fault}", options.where, "write it as CSV in UTF-8"
        ) from None

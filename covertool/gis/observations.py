"""Observation tables in Parquet and CSV."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from covertool.gis.records import is_csv, write_records
from covertool.model import Observations

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa


def write_observations(
    path: str | Path, batches: Iterable[Observations], *, overwrite: bool = False
) -> int:
    """Write observations to a Parquet or CSV file and return how many; all of them or none.

    Raises
    ------
    FileError
        When the path cannot be written, or the written file does not hold every row.
    """
    frames = (batch.to_frame() for batch in batches)
    schema = _schema()
    if is_csv(path):
        # Lines do not fit a text table; the segment's id is what a CSV joins by.
        schema = schema.remove(schema.get_field_index("line"))
        frames = (_as_text(frame.drop(columns="line")) for frame in frames)
    return write_records(path, frames, schema=schema, overwrite=overwrite)


def _schema() -> pa.Schema:
    """Return the columns of an observation table."""
    import pyarrow as pa

    moment, number = pa.timestamp("us", tz="UTC"), pa.float64()
    return pa.schema(
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


def _as_text(frame: pd.DataFrame) -> pd.DataFrame:
    """Return a table with its moments in ISO 8601."""
    moments = {name: frame[name].map(_iso, na_action="ignore") for name in ("time", "until")}
    return frame.assign(**moments)


def _iso(moment: Any) -> str:
    return str(moment.isoformat())

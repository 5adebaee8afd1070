"""Reading an invented feed from bytes."""

from __future__ import annotations

import io

from covertool.congestion.feeds.protocol import FeedOptions, feed
from covertool.model import Observations


def read(name: str, text: bytes | str, **options: object) -> Observations:
    """Return the observations of a feed given as text."""
    raw = text.encode() if isinstance(text, str) else text
    parts = feed(name).read(io.BytesIO(raw), FeedOptions(**options))
    return Observations.concatenate(list(parts))


def statuses(observations: Observations) -> dict[str, str]:
    """Return the status by segment."""
    return dict(zip(observations.segment_id, observations.status, strict=True))

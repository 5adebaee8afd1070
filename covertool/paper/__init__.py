"""The paper's tables as data, and our figures beside them."""

from covertool.paper.congestion import TABLE_1_CELLS, TABLE_1_MEANS, table_1
from covertool.paper.tables import (
    BATTERY,
    TABLE_2,
    TABLE_4_PERCENT,
    TABLE_5,
    TABLE_6,
    TABLE_7,
    TABLE_8,
    BatteryClaim,
    PaperDensity,
    PaperErrors,
)

__all__ = [
    "BATTERY",
    "TABLE_1_CELLS",
    "TABLE_1_MEANS",
    "TABLE_2",
    "TABLE_4_PERCENT",
    "TABLE_5",
    "TABLE_6",
    "TABLE_7",
    "TABLE_8",
    "BatteryClaim",
    "PaperDensity",
    "PaperErrors",
    "table_1",
]

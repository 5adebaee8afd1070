"""Decimal rounding as people do it: a half goes up."""

from __future__ import annotations

from decimal import ROUND_HALF_UP, Decimal


def half_up(value: float | Decimal, digits: int = 2) -> str:
    """Return a number rounded half up in decimal, as text.

    The ninth decimal is taken as exact, so that a mean of decimal figures that binary floats
    hold a hair below the half still goes up.

    Examples
    --------
    >>> half_up((9.72 + 16.33) / 2), half_up(2.675), f"{2.675:.2f}"
    ('13.03', '2.68', '2.67')
    """
    exact = value if isinstance(value, Decimal) else Decimal(f"{value:.9f}")
    return str(exact.quantize(Decimal(1).scaleb(-digits), rounding=ROUND_HALF_UP))

"""Public holidays, which are no ordinary weekdays."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import date

from covertool.errors import MissingExtraError, OptionError


def public_holidays(country: str, years: Iterable[int]) -> frozenset[date]:
    """Return the public holidays of a country (ISO 3166 code, or ``CODE-SUBDIVISION``).

    Raises
    ------
    OptionError
        When the country is not known.
    MissingExtraError
        When the package ``holidays`` is not installed.

    Examples
    --------
    >>> date(2014, 6, 2) in public_holidays("IE", [2014])
    True
    """
    try:
        import holidays
    except ImportError:
        raise MissingExtraError(
            "public holidays need the package holidays", "--holidays", "pip install holidays"
        ) from None
    code, _, subdivision = country.upper().partition("-")
    try:
        calendar = holidays.country_holidays(code, subdiv=subdivision or None, years=list(years))
    except NotImplementedError:
        raise OptionError(
            f"the holidays of {country!r} are not known", "--holidays", "use a code such as IE"
        ) from None
    return frozenset(calendar)

"""XML feeds: their records one by one, and what stands in them."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import BinaryIO

from covertool import xmlstream
from covertool.congestion.feeds.protocol import FeedOptions
from covertool.xmlstream import Element, XmlSource, local_name

__all__ = ["Element", "elements", "find", "local_name", "number", "text"]


def elements(
    stream: BinaryIO, names: Collection[str], options: FeedOptions
) -> Iterator[tuple[str, Element]]:
    """Yield (local name, element) for each record, see :func:`covertool.xmlstream.elements`."""
    limits = options.limits
    mend = "fetch the feed from its source again"
    source = XmlSource(options.where, mend, limits.depth, limits.elements)
    return xmlstream.elements(stream, names, source)


def find(element: Element, *path: str) -> Element | None:
    """Return the first descendant along local names, each at any depth below the one before.

    Examples
    --------
    >>> from lxml import etree
    >>> find(etree.fromstring("<a><b><c>1</c></b></a>"), "c").text
    '1'
    """
    for name in path:
        element = next(element.iterdescendants(f"{{*}}{name}"), None)
        if element is None:
            return None
    return element


def text(element: Element, *path: str) -> str | None:
    """Return the stripped text of the first descendant along local names, or None."""
    found = find(element, *path)
    return found.text.strip() if found is not None and found.text else None


def number(element: Element, *path: str) -> float:
    """Return a descendant's text as a float; NaN when there is none."""
    try:
        return float(text(element, *path) or "nan")
    except ValueError:
        return float("nan")

"""XML feeds, streamed: record by record in bounded memory, with every hostile trick refused."""

from __future__ import annotations

import zlib
from collections.abc import Collection, Iterator
from typing import Any, BinaryIO

from lxml import etree

from covertool.congestion.feeds.protocol import FeedOptions, TruncatedError
from covertool.errors import FileError

Element = Any
"""An lxml element; lxml ships no types."""


def elements(
    stream: BinaryIO, names: Collection[str], options: FeedOptions
) -> Iterator[tuple[str, Element]]:
    """Yield (local name, element) for each outermost element of the given names as it ends.

    An element is emptied after it was yielded, and so is all that lies between them, so memory
    holds one record at a time; attributes of the ancestors stay readable.

    Raises
    ------
    FileError
        For a DOCTYPE, for nesting deeper or a record larger than the limits, and for what is not
        XML. Entities are never expanded and no network is touched.
    TruncatedError
        When the XML ends early.
    """
    depth = size = 0
    record: Element = None
    source = _Source(stream)
    try:
        for event, element in _parser(source):
            if event == "start":
                depth += 1
                if depth == 1:
                    _refuse_doctype(element, options)
                if record is None and local_name(element) in names:
                    record, size = element, 0
                size += 1
                _refuse_excess(depth, 0 if record is None else size, options)
                continue
            depth -= 1
            if element is record:
                yield local_name(element), element
                record = None
            if record is None:
                _forget(element)
    except (EOFError, zlib.error) as fault:
        raise TruncatedError(
            f"the compressed feed ends early: {fault}", options.where, "fetch it again"
        ) from None
    except etree.XMLSyntaxError as fault:
        raise _told(fault, source.ended, options) from None


class _Source:
    """A stream that knows when it has been read to its end."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream, self.ended = stream, False

    def read(self, size: int = -1) -> bytes:
        chunk = self._stream.read(size)
        self.ended = not chunk
        return chunk


def _parser(source: _Source) -> Iterator[tuple[str, Element]]:
    parser: Iterator[tuple[str, Element]] = etree.iterparse(
        source,
        events=("start", "end"),
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        dtd_validation=False,
        attribute_defaults=False,
        huge_tree=False,
        remove_comments=True,
        remove_pis=True,
    )
    return parser


def _refuse_excess(depth: int, size: int, options: FeedOptions) -> None:
    limits = options.limits
    if depth > limits.depth or size > limits.elements:
        raise FileError(
            f"the XML is nested deeper than {limits.depth} levels"
            if depth > limits.depth
            else f"one record has more than {limits.elements} elements",
            options.where,
            "this is not a traffic feed; check the file",
        )


def _refuse_doctype(root: Element, options: FeedOptions) -> None:
    if root.getroottree().docinfo.internalDTD is not None:
        raise FileError(
            "the XML declares a DOCTYPE, which may hold entity bombs",
            options.where,
            "fetch the feed from its source again; traffic feeds have no DOCTYPE",
        )


def _forget(element: Element) -> None:
    element.clear(keep_tail=False)
    while element.getprevious() is not None:
        del element.getparent()[0]


def _told(fault: etree.XMLSyntaxError, ended: bool, options: FeedOptions) -> FileError:
    # The parser waits for more wherever more could mend it, so a fault at the end is a cut.
    if ended:
        return TruncatedError(f"the XML ends early: {fault}", options.where, "fetch it again")
    return FileError(f"the XML is damaged: {fault}", options.where, "fetch the feed again")


def local_name(element: Element) -> str:
    """Return an element's name without its namespace."""
    return str(element.tag).rpartition("}")[2]


def find(element: Element, *path: str) -> Element | None:
    """Return the first descendant along local names, each at any depth below the one before.

    Examples
    --------
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

"""XML, streamed: record by record in bounded memory, with every hostile trick refused."""

from __future__ import annotations

import zlib
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Any, BinaryIO

from lxml import etree

from covertool.errors import FileError, TruncatedError

Element = Any
"""An lxml element; lxml ships no types."""


@dataclass(frozen=True)
class XmlSource:
    """What a stream of XML is, and how much of it may be held at once.

    Attributes
    ----------
    where, mend : lines of the errors: which file it is, and how to get a sound one
    most_depth : greatest depth of nesting
    most_elements : greatest number of elements inside one record
    """

    where: str
    mend: str
    most_depth: int = 200
    most_elements: int = 200_000


def elements(
    stream: BinaryIO, names: Collection[str], source: XmlSource
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
    watched = _Watched(stream)
    try:
        for event, element in _parser(watched):
            if event == "start":
                depth += 1
                if depth == 1:
                    _refuse_doctype(element, source)
                if record is None and local_name(element) in names:
                    record, size = element, 0
                size += 1
                _refuse_excess(depth, 0 if record is None else size, source)
                continue
            depth -= 1
            if element is record:
                yield local_name(element), element
                record = None
            if record is None:
                _forget(element)
    except (EOFError, zlib.error) as fault:
        told = f"the compressed XML ends early: {fault}"
        raise TruncatedError(told, source.where, source.mend) from None
    except etree.XMLSyntaxError as fault:
        raise _told(fault, watched.ended, source) from None


class _Watched:
    """A stream that knows when it has been read to its end."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream, self.ended = stream, False

    def read(self, size: int = -1) -> bytes:
        chunk = self._stream.read(size)
        self.ended = not chunk
        return chunk


def _parser(stream: _Watched) -> Iterator[tuple[str, Element]]:
    """Return lxml's events, with nothing fetched, expanded or kept that need not be."""
    parser: Iterator[tuple[str, Element]] = etree.iterparse(
        stream,
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


def _refuse_excess(depth: int, size: int, source: XmlSource) -> None:
    if depth > source.most_depth:
        what = f"the XML is nested deeper than {source.most_depth} levels"
    elif size > source.most_elements:
        what = f"one record of the XML has more than {source.most_elements:,} elements"
    else:
        return
    raise FileError(what, source.where, source.mend)


def _refuse_doctype(root: Element, source: XmlSource) -> None:
    if root.getroottree().docinfo.internalDTD is not None:
        raise FileError(
            "the XML declares a DOCTYPE, which may hold entity bombs", source.where, source.mend
        )


def _forget(element: Element) -> None:
    element.clear(keep_tail=False)
    while element.getprevious() is not None:
        del element.getparent()[0]


def _told(fault: etree.XMLSyntaxError, ended: bool, source: XmlSource) -> FileError:
    # The parser waits for more wherever more could mend it, so a fault at the end is a cut.
    if ended:
        return TruncatedError(f"the XML ends early: {fault.msg}", source.where, source.mend)
    return FileError(f"the XML is damaged: {fault.msg}", source.where, source.mend)


def local_name(element: Element) -> str:
    """Return an element's name without its namespace."""
    return str(element.tag).rpartition("}")[2]

"""SUMO's XML files, streamed with every hostile trick refused."""

from __future__ import annotations

import zlib
from collections.abc import Collection, Iterator
from typing import Any, BinaryIO

from lxml import etree

from covertool.errors import FileError

Element = Any
"""An lxml element; lxml ships no types."""
LARGEST_RECORD = 200_000
"""Greatest number of elements inside one that is kept; SUMO's own hold hundreds."""


def elements(stream: BinaryIO, names: Collection[str], where: str) -> Iterator[Element]:
    """Yield each element of the given names as it ends; then it is emptied.

    Memory holds one element at a time; attributes of the ancestors stay readable.

    Raises
    ------
    FileError
        For a DOCTYPE (entities are never expanded, no network is touched), for one element that
        never ends, and for what is no XML or ends early.
    """
    inside = held = 0
    try:
        for event, element in _parser(stream):
            if event == "start":
                if element.getparent() is None:
                    _refuse_doctype(element, where)
                inside += element.tag in names
                held = held + 1 if inside else 0
                if held > LARGEST_RECORD:
                    raise _endless(where)
                continue
            if element.tag in names:
                inside -= 1
                if not inside:
                    yield element
            if not inside:
                _forget(element)
    except (EOFError, zlib.error) as fault:
        raise _cut(str(fault), where) from None
    except etree.XMLSyntaxError as fault:
        raise _cut(str(fault.msg), where) from None


def _parser(stream: BinaryIO) -> Iterator[tuple[str, Element]]:
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


def _refuse_doctype(root: Element, where: str) -> None:
    if root.getroottree().docinfo.internalDTD is not None:
        raise FileError(
            "the XML declares a DOCTYPE, which may hold entity bombs",
            where,
            "write the file again with SUMO; its files have no DOCTYPE",
        )


def _endless(where: str) -> FileError:
    return FileError(
        f"one record of the XML holds more than {LARGEST_RECORD:,} elements",
        where,
        "this is no file that SUMO writes; write it again",
    )


def _forget(element: Element) -> None:
    element.clear(keep_tail=False)
    while element.getprevious() is not None:
        del element.getparent()[0]


def _cut(told: str, where: str) -> FileError:
    return FileError(
        f"the XML is damaged or cut off: {told}", where, "write it again, or copy it again"
    )

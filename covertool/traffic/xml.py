"""SUMO's XML files, streamed with every hostile trick refused."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import BinaryIO

from covertool import xmlstream
from covertool.xmlstream import Element, XmlSource

__all__ = ["Element", "elements"]


def elements(stream: BinaryIO, names: Collection[str], where: str) -> Iterator[Element]:
    """Yield each outermost element of the given names, see :func:`covertool.xmlstream.elements`."""
    source = XmlSource(where, "write the file again with SUMO")
    return (element for _, element in xmlstream.elements(stream, names, source))

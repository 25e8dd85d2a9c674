"""XML that comes from anyone: walked element by element, or refused.

Document types are refused, for they are where entities are defined: those that grow beyond any
memory, and those that stand for other files.  Nothing is opened but what is given.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from typing import IO, Any
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from simplifier.errors import UnreadableMeshError
from simplifier.geometry.mesh import FloatArray, IndexArray

Attributes = Mapping[str, str]
Begin = Callable[[str, Attributes], object]
End = Callable[[str], object]

_DEEPEST = 200  # elements within elements; those of real files are within twenty
_PIECE = 1 << 22  # bytes
_LONGEST_ADDRESS = 1000  # of a namespace: the parser puts it before every name
_ENCODINGS = ("utf-8", "utf-16", "us-ascii", "ascii", "iso-8859-1")
_EXPORT = "copy or export it again"


def walk_xml(
    source: bytes | IO[bytes],
    where: str,
    begin: Begin,
    end: End,
    text: Callable[[str], object] | None = None,
    namespace: Callable[[str | None, str | None], object] | None = None,
) -> None:
    """Call ``begin`` with the name and attributes of every element, ``end`` with its name.

    ``text``       called with the characters between tags, in pieces.
    ``namespace``  called with a prefix and its address, before the element that declares it.

    Names are without their namespace.  Raises :class:`UnreadableMeshError` with the line for a text
    that is not well-formed, has a document type, nests too deep or is in a rare encoding.
    """
    parser = expat.ParserCreate(namespace_separator="}")
    parser.buffer_text = True
    depth = 0

    def start(name: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > _DEEPEST:
            raise UnreadableMeshError(
                f"line {parser.CurrentLineNumber}: elements nest deeper than {_DEEPEST}",
                where=where,
                remedy=_EXPORT,
            )
        begin(_local(name), attributes)

    def stop(name: str) -> None:
        nonlocal depth
        depth -= 1
        end(_local(name))

    def declare(_version: str, encoding: str | None, _alone: int) -> None:
        if encoding is not None and encoding.lower() not in _ENCODINGS:
            raise UnreadableMeshError(
                f"its encoding is '{encoding[:40]}'", where=where, remedy="save it as UTF-8"
            )

    def refuse_doctype(*_: object) -> None:
        raise UnreadableMeshError(
            f"line {parser.CurrentLineNumber}: a document type (DOCTYPE), which could define"
            " entities, is not read",
            where=where,
            remedy="take it out, or export the file again",
        )

    def declare_namespace(prefix: str | None, address: str | None) -> None:
        if len(address or "") > _LONGEST_ADDRESS:
            raise UnreadableMeshError(
                f"line {parser.CurrentLineNumber}: the address of a namespace is longer than"
                f" {_LONGEST_ADDRESS} characters",
                where=where,
                remedy=_EXPORT,
            )
        if namespace is not None:
            namespace(prefix, address)

    parser.StartElementHandler = start
    parser.EndElementHandler = stop
    parser.XmlDeclHandler = declare
    parser.StartDoctypeDeclHandler = refuse_doctype
    parser.CharacterDataHandler = text
    parser.StartNamespaceDeclHandler = declare_namespace
    try:
        if isinstance(source, bytes):
            parser.Parse(source, True)
        else:
            # Not ParseFile, whose small pieces make a long tag be looked at anew for each of them.
            while piece := source.read(_PIECE):
                parser.Parse(piece, False)
            parser.Parse(b"", True)
    except expat.ExpatError as error:
        raise UnreadableMeshError(
            f"the XML is damaged or cut off in line {error.lineno}, column {error.offset + 1}"
            f" ({expat.ErrorString(error.code)})",
            where=where,
            remedy=_EXPORT,
        ) from None


def parse_xml(data: bytes, where: str) -> Element:
    """The root of a text as a tree; names as in :func:`walk_xml`, and errors."""
    builder = TreeBuilder()
    walk_xml(
        data, where, lambda name, own: builder.start(name, dict(own)), builder.end, builder.data
    )
    return builder.close()


def read_floats(element: Element, where: str) -> FloatArray:
    """The numbers between the tags; :class:`UnreadableMeshError` for a word that is none."""
    return np.asarray(_read_numbers(element, np.float64, where))


def read_integers(element: Element, where: str) -> IndexArray:
    """The whole numbers between the tags, as :func:`read_floats`."""
    return np.asarray(_read_numbers(element, np.int64, where))


def _read_numbers(element: Element, dtype: type, where: str) -> NDArray[Any]:
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)  # what NumPy says before 2.3
        try:
            return np.fromstring(element.text or "", dtype=dtype, sep=" ")
        except (ValueError, DeprecationWarning):
            raise UnreadableMeshError(
                f"<{element.tag}> holds something else than numbers", where=where, remedy=_EXPORT
            ) from None


def _local(name: str) -> str:
    return name[name.rfind("}") + 1 :]

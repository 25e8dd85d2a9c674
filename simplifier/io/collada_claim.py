"""What a COLLADA file says that it holds, counted in its text without building the tree of it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from simplifier.io.claim import Claim, Peek
from simplifier.io.placing import MOST_TRIANGLES, Size, sum_sizes

_TAG = re.compile(
    rb"<(/?)(?:[\w.-]+:)?(geometry|node|library_nodes|float_array|triangles|polylist|polygons|"
    rb"tristrips|trifans|instance_geometry|instance_controller|instance_node|controller|skin|morph)"
    rb"\b([^<>]*)>"
)
_ID = re.compile(rb"\bid\s*=\s*[\"']([^\"']*)")
_URL = re.compile(rb"\burl\s*=\s*[\"']#([^\"']*)")
_SOURCE = re.compile(rb"\bsource\s*=\s*[\"']#([^\"']*)")
_COUNT = re.compile(rb"\bcount\s*=\s*[\"']\s*(\d{1,18})")
_PIECE = 1 << 20  # bytes
_LONGEST_TAG = 1 << 24
_DEEPEST = 100  # nodes within nodes
_FLAT = {b"triangles": 1, b"polylist": 2, b"polygons": 2}
"""Triangles of one face, quadrilaterals where it can have any number of corners."""


def claim(peek: Peek) -> Claim:
    """A mesh counts each time that a node places it; polygons count as quadrilaterals."""
    outline = _Outline()
    for tag in _tags(peek):
        outline.add(*tag)
    vertices, triangles = outline.total()
    if max(vertices, triangles) > MOST_TRIANGLES:  # reading refuses it before all are in one
        vertices = triangles = 0
    # The file, its tree and the numbers in it; then the meshes, their places, and all in one.
    own = sum(sum_sizes(outline.meshes.values()))
    return Claim(vertices, triangles, 4 * peek.size + 24 * own + 48 * (vertices + triangles))


@dataclass
class _Node:
    meshes: list[bytes] = field(default_factory=list)
    nodes: list[_Node | bytes] = field(default_factory=list)
    total: Size | None = None


class _Outline:
    """Sizes of the meshes, and which nodes place them."""

    def __init__(self) -> None:
        self.meshes: dict[bytes, Size] = {}
        self._named: dict[bytes, _Node] = {}
        self._roots: list[_Node] = []
        self._open: list[_Node] = []
        self._in_library = False
        self._mesh = self._controller = b""
        self._shapes: dict[bytes, bytes] = {}  # of controllers, by their ids

    def add(self, closing: bool, kind: bytes, attributes: bytes) -> None:
        """The next tag of the text."""
        url = _URL.search(attributes)
        if kind == b"library_nodes":
            self._in_library = not closing
        elif kind == b"node":
            self._turn(closing, attributes)
        elif kind in (b"instance_geometry", b"instance_controller"):
            if url and self._open and not closing:
                self._open[-1].meshes.append(url[1])
        elif kind == b"instance_node":
            if url and self._open and not closing:
                self._open[-1].nodes.append(url[1])
        elif kind == b"geometry":
            self._mesh = _first(_ID, attributes)
        elif kind == b"controller":
            self._controller = _first(_ID, attributes)
        elif kind in (b"skin", b"morph"):
            self._shapes.setdefault(self._controller, _first(_SOURCE, attributes))
        elif not closing:
            self._measure(kind, attributes)

    def _turn(self, closing: bool, attributes: bytes) -> None:
        if closing:
            del self._open[-1:]
            return
        node = _Node()
        self._named.setdefault(_first(_ID, attributes), node)
        if self._open:
            self._open[-1].nodes.append(node)
        elif not self._in_library:
            self._roots.append(node)
        if not attributes.endswith(b"/"):
            self._open.append(node)

    def _measure(self, kind: bytes, attributes: bytes) -> None:
        count = int(_first(_COUNT, attributes) or 0)
        vertices, triangles = self.meshes.get(self._mesh, (0, 0))
        if kind == b"float_array":
            vertices = max(vertices, count // 3)
        else:
            triangles += count * _FLAT.get(kind, 100)  # a strip is as long as one likes
        self.meshes[self._mesh] = sum_sizes([(vertices, triangles)])

    def total(self) -> Size:
        """Of all that the scenes place; of all meshes where there is no scene."""
        if not self._roots:
            return sum_sizes(self.meshes.values())
        return sum_sizes(self._total(root, 0) for root in self._roots)

    def _total(self, node: _Node, depth: int) -> Size:
        if depth > _DEEPEST:  # which reading refuses
            return 0, 0
        if node.total is None:
            inner = [
                self._named.get(one, _Node()) if isinstance(one, bytes) else one
                for one in node.nodes
            ]
            shapes = [self._shapes.get(one, one) for one in node.meshes]
            shapes = [self._shapes.get(one, one) for one in shapes]  # a skin around a morph
            own = [self.meshes.get(one, (0, 0)) for one in shapes]
            node.total = sum_sizes([*own, *(self._total(one, depth + 1) for one in inner)])
        return node.total


def _tags(peek: Peek) -> Iterator[tuple[bool, bytes, bytes]]:
    """Of each tag that matters whether it closes, its name and its attributes."""
    rest = b""
    for begin in range(0, peek.size, _PIECE):
        text = rest + peek.read(begin, _PIECE)
        end = max(text.rfind(b"<"), 0) if begin + _PIECE < peek.size else len(text)
        text, rest = text[:end], text[end:] if len(text) - end < _LONGEST_TAG else b""
        for tag in _TAG.finditer(text):
            yield tag[1] == b"/", tag[2], tag[3]


def _first(pattern: re.Pattern[bytes], attributes: bytes) -> bytes:
    found = pattern.search(attributes)
    return found[1] if found else b""

"""What a 3MF file says that it holds, counted in the text of its models."""

from __future__ import annotations

import re
from collections.abc import Iterator

from simplifier.io.claim import Claim, Peek
from simplifier.io.placing import MOST_TRIANGLES, Size, sum_sizes
from simplifier.io.threemf_archive import Archive
from simplifier.io.threemf_model import DEEPEST, Place

_STRUCTURE = re.compile(rb"<(?:[\w.-]+:)?(object|component|item)\s([^>]*)>")
_NUMBER = re.compile(rb"\b(?:object)?id\s*=\s*[\"']([^\"']*)")
_PATH = re.compile(rb"\bpath\s*=\s*[\"']/?([^\"']*)")
_PIECE = 1 << 20  # bytes
_LONGEST_TAG = 1 << 24


def claim(peek: Peek) -> Claim:
    """Elements are counted in the text of the models, each time that the build places them."""
    archive = Archive(peek.path, str(peek.path))
    outline = _Outline(archive)
    main = archive.main_model()
    vertices, triangles = sum_sizes(outline.total(place) for place in outline.items.get(main, []))
    if max(vertices, triangles) > MOST_TRIANGLES:  # reading refuses it before all are in one
        vertices = triangles = 0
    # The file; all numbers, as they are read and as an array, which take no more than the text does
    # where that is written so that nothing is counted; and the places, each and all in one.
    own = max(48 * sum(sum_sizes(outline.sizes.values())), archive.unpacked)
    return Claim(vertices, triangles, peek.size + own + 48 * (vertices + triangles))


class _Outline:
    """How much each object of an archive holds, and what it is made of."""

    def __init__(self, archive: Archive) -> None:
        self.sizes: dict[Place, Size] = {}
        self.items: dict[str, list[Place]] = {}
        self._parts: dict[Place, list[Place]] = {}
        self._totals: dict[Place, Size] = {}
        for model in archive.models():
            current = model, ""
            for kind, place, size in _structure(archive, model):
                self.sizes[current] = sum_sizes([self.sizes.get(current, (0, 0)), size])
                if kind == b"object":
                    current = place
                elif kind == b"component":
                    self._parts.setdefault(current, []).append(place)
                elif kind == b"item":
                    self.items.setdefault(model, []).append(place)

    def total(self, place: Place, depth: int = 0) -> Size:
        """Of an object with all that it places; those too deep count not, for reading refuses
        them."""
        if depth > DEEPEST:
            return 0, 0
        if place not in self._totals:
            parts = [self.total(part, depth + 1) for part in self._parts.get(place, [])]
            self._totals[place] = sum_sizes([self.sizes.get(place, (0, 0)), *parts])
        return self._totals[place]


def _structure(archive: Archive, model: str) -> Iterator[tuple[bytes, Place, Size]]:
    """Of each tag that matters its kind, its object, and the elements that stand before it."""
    with archive.open(model) as part:
        rest = b""
        while piece := archive.read(part, _PIECE):
            text = rest + piece
            end = max(text.rfind(b"<"), 0)
            text, rest = text[:end], text[end:] if len(text) - end < _LONGEST_TAG else b""
            begin = 0
            for tag in _STRUCTURE.finditer(text):
                yield tag[1], _place(tag[2], model), _elements(text, begin, tag.start())
                begin = tag.end()
            yield b"", (model, ""), _elements(text, begin, len(text))


def _place(attributes: bytes, model: str) -> Place:
    number, path = _NUMBER.search(attributes), _PATH.search(attributes)
    return (
        path[1].decode("utf-8", "replace").lower() if path else model,
        number[1].decode("utf-8", "replace") if number else "",
    )


def _elements(text: bytes, begin: int, end: int) -> Size:
    return text.count(b"<vertex ", begin, end), text.count(b"<triangle ", begin, end)

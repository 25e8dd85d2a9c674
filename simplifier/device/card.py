"""The memory of a graphics card, as the compute programs of one OpenGL context use it.

A buffer that the processor maps is moved to its memory by drivers, where what a card writes takes
twenty times as long.  So nothing is mapped before it is read, words are filled by a program, and
what was read is not used again.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

GROUP = 64
"""Invocations of a work group, along x."""

MOST_GROUPS = 65_535
"""Work groups along an axis, which every OpenGL can; invocations then take several items."""

_KEPT = 2  # meshes that stay: the one that is measured, and its occluder

_SPARE = 1 << 28  # bytes of buffers that wait to be filled again: new memory is slow at first

_FILL = """#version 430
layout(local_size_x = 64) in;
layout(std430, binding = 7) writeonly buffer Words { uint words[]; };
uniform int count;
uniform uint word;
void main() {
    int step = int(gl_NumWorkGroups.x * gl_WorkGroupSize.x);
    for (int at = int(gl_GlobalInvocationID.x); at < count; at += step) words[at] = word;
}
"""


class LostError(Exception):
    """OpenGL reports an error: what it drew cannot be relied on."""


@dataclass(frozen=True)
class Filled:
    """What a buffer of ``size`` bytes begins with: ``word`` (32 bits), over and over."""

    size: int
    word: int = 0


Shape = tuple[NDArray[np.float64], NDArray[np.int32]]
"""Points (3, n) and faces (m, 3), as :func:`~simplifier.kernels.coverage.drawable` gives them."""


@dataclass(frozen=True, eq=False)
class Geometry:
    """A shape on the card that has faces."""

    points: NDArray[np.float64]
    faces: NDArray[np.int32]
    buffers: tuple[Any, Any]

    def bind(self) -> None:
        """To bindings 0 and 1."""
        for place, buffer in enumerate(self.buffers):
            buffer.bind_to_storage_buffer(place)

    def is_of(self, points: NDArray[np.float64], faces: NDArray[np.int32]) -> bool:
        return np.array_equal(self.faces, faces) and np.array_equal(self.points, points)


class Card:
    """Buffers and programs of the OpenGL ``context``, which has to be current at each call.

    ``largest``  bytes of a buffer.
    """

    def __init__(self, context: Any) -> None:
        self.context = context
        self.largest = int(context.info["GL_MAX_SHADER_STORAGE_BLOCK_SIZE"])
        self._fill = self.program(_FILL)
        self._kept: list[Geometry] = []
        self._spare: list[Any] = []  # the last that was used comes last
        self._mapped: set[int] = set()  # by number

    def program(self, source: str) -> Any:
        return self.context.compute_shader(source)

    def run(
        self, program: Any, groups: tuple[int, ...], **uniforms: float | tuple[int, int]
    ) -> None:
        """Run it over so many work groups.  What it takes from others it then sees, and others from
        it.  ``uniforms`` that it does not use are left out."""
        for name, value in uniforms.items():
            if name in program:
                program[name] = value
        program.run(*groups)
        self.context.memory_barrier()

    @contextmanager
    def buffers(self, *contents: NDArray[Any] | Filled, first: int = 0) -> Iterator[list[Any]]:
        """OpenGL buffers of arrays, or filled; freed afterwards.

        They are bound in this order, from binding ``first`` on.
        """
        held: list[Any] = []
        try:
            for content in contents:
                if isinstance(content, Filled):
                    held.append(self._filled(content))
                else:
                    held.append(self.context.buffer(content))
            for place, one in enumerate(held):
                one.bind_to_storage_buffer(first + place)
            yield held
        finally:
            for content, one in zip(contents, held, strict=False):
                self._set_free(one, again=isinstance(content, Filled))

    def geometries(self, shapes: Sequence[Shape]) -> list[Geometry]:
        """Shapes with faces on the card, which keeps the last: a report draws them three times."""
        found = []
        for points, faces in shapes:
            known = next((one for one in self._kept if one.is_of(points, faces)), None)
            if known is None:
                buffers = (self.context.buffer(points), self.context.buffer(faces))
                known = Geometry(points, faces, buffers)
            found.append(known)
        others = [one for one in self._kept if one not in found]
        room = max(_KEPT - len(found), 0)
        for old in others[room:]:
            for buffer in old.buffers:
                buffer.release()
        self._kept = [*found, *others[:room]]
        return found

    def read(self, buffer: Any, kind: Any, shape: tuple[int, ...]) -> NDArray[Any]:
        """The content of a buffer.  Raises :class:`LostError` if anything went wrong before."""
        content = np.empty(shape, kind)
        buffer.read_into(content, size=content.nbytes)
        self._mapped.add(buffer.glo)
        if (error := self.context.error) != "GL_NO_ERROR":
            raise LostError(error)
        return content

    def _filled(self, content: Filled) -> Any:
        buffer = next((one for one in self._spare if one.size == content.size), None)
        if buffer is None:
            buffer = self.context.buffer(reserve=content.size)
        else:
            self._spare.remove(buffer)
        buffer.bind_to_storage_buffer(7)  # of no other program
        count = content.size // 4
        groups = min(-(-count // GROUP), MOST_GROUPS)
        self.run(self._fill, (groups,), count=count, word=content.word)
        return buffer

    def _set_free(self, buffer: Any, *, again: bool) -> None:
        """Release it, or keep it for what is filled next."""
        if not again or buffer.glo in self._mapped or buffer.size > _SPARE:
            self._mapped.discard(buffer.glo)
            buffer.release()
            return
        self._spare.append(buffer)
        while sum(one.size for one in self._spare) > _SPARE:
            self._spare.pop(0).release()

"""What the compute programs share: their triangles, their buffers, and how much is drawn at once.

The programs do in GLSL what :mod:`simplifier.kernels.coverage` does, in double precision and in the
same order of operations, so that they find the same pixels to the last one.  ``precise`` keeps the
compiler from fusing or reordering them.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

GROUP = 64
"""Invocations of a work group, along x."""

_MOST_GROUPS = 65_535  # along x, which every OpenGL can; invocations then take several triangles
_MOST_DRAWN = (
    1 << 26
)  # triangles times views of a dispatch: short of what a driver takes for a hang
_MOST_BYTES = 1 << 26  # of pictures at once
_ENOUGH = 1 << 16  # invocations that keep a card busy; with fewer triangles, rows are shared out
_STRIP = 32  # rows

TRIANGLES = """#version 430
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Vertices { double vertices[]; };
layout(std430, binding = 1) readonly buffer Faces { int faces[]; };
layout(std430, binding = 2) readonly buffer Projections { double projections[]; };
uniform int vertex_count, face_count, rows, columns, strip, axes;

// Where a vertex is in the picture, with pixel centres at the integers, and its cell: the first
// column and row from there on.
struct Corner { dvec2 place; ivec2 cell; int vertex; };

Corner corner(int vertex, int view) {
    double x = vertices[vertex];
    double y = vertices[vertex + vertex_count];
    double z = vertices[vertex + 2 * vertex_count];
    int at = 4 * axes * view;
    precise double right = projections[at + 3] - 0.5LF;
    precise double up = projections[at + 7] - 0.5LF;
    right = projections[at] * x + projections[at + 1] * y + projections[at + 2] * z + right;
    up = projections[at + 4] * x + projections[at + 5] * y + projections[at + 6] * z + up;
    dvec2 place = dvec2(right, up);
    dvec2 size = dvec2(double(columns), double(rows));
    return Corner(place, ivec2(ceil(clamp(place, dvec2(0.0LF), size))), vertex);
}

void order(inout Corner low, inout Corner high) {
    if (high.cell.y < low.cell.y) { Corner kept = low; low = high; high = kept; }
}

// Whether a face may hold pixel centres; its corners then come from the lowest to the highest.
bool read_face(int face, int view, out Corner low, out Corner middle, out Corner high) {
    low = corner(faces[3 * face], view);
    middle = corner(faces[3 * face + 1], view);
    high = corner(faces[3 * face + 2], view);
    if (low.cell.x == middle.cell.x && low.cell.x == high.cell.x) return false;
    if (low.cell.y == middle.cell.y && low.cell.y == high.cell.y) return false;
    order(low, middle);
    order(middle, high);
    order(low, middle);
    return true;
}

double share_of(Corner low, Corner high, int row) {
    precise double share = (double(row) - low.place.y) / (high.place.y - low.place.y);
    return share;
}

double between(double low, double high, double share) {
    precise double found = low + share * (high - low);
    return found;
}

// The first column with its centre from there on.
int column_from(double x) { return int(ceil(clamp(x, 0.0LF, double(columns)))); }

// The bits of a word that columns from first to last have in it.
uint span_of(int word, int first, int last) {
    int begin = max(first - 32 * word, 0), end = min(last - 32 * word, 31);
    return (0xFFFFFFFFu >> uint(31 - (end - begin))) << uint(begin);
}
"""

LOOP = """
void main() {
    int view = int(gl_WorkGroupID.y);
    int from = int(gl_WorkGroupID.z) * strip;
    int step = int(gl_NumWorkGroups.x * gl_WorkGroupSize.x);
    Corner low, middle, high;
    for (int face = int(gl_GlobalInvocationID.x); face < face_count; face += step) {
        if (!read_face(face, view, low, middle, high)) continue;
        int end = min(high.cell.y, from + strip);
        for (int row = max(low.cell.y, from); row < end; ++row)
            draw_row(view, row, low, middle, high);
    }
}
"""
"""Calls ``draw_row`` for every row of every face in every view."""


class LostError(Exception):
    """OpenGL reports an error: what it drew cannot be relied on."""


@contextmanager
def buffers(context: Any, *contents: NDArray[Any] | int, first: int = 0) -> Iterator[list[Any]]:
    """OpenGL buffers of arrays, or of so many bytes that are 0; freed afterwards.

    They are bound in this order, from binding ``first`` on.
    """
    held: list[Any] = []
    try:
        for place, content in enumerate(contents):
            if isinstance(content, int):
                held.append(context.buffer(reserve=content, dynamic=True))
                held[-1].clear()
            else:
                held.append(context.buffer(content))
            held[-1].bind_to_storage_buffer(first + place)
        yield held
    finally:
        for one in held:
            one.release()


def dispatch(
    context: Any,
    program: Any,
    points: NDArray[np.float64],
    faces: NDArray[np.int32],
    views: NDArray[np.float64],
    image: tuple[int, int],
) -> None:
    """Run a program of :data:`TRIANGLES` and :data:`LOOP` over faces and views, which are bound.

    ``points`` (3, n), ``faces`` (m, 3), ``views`` (V, axes, 4); ``image`` rows and columns.
    """
    rows, columns = image
    strip = rows if len(faces) * len(views) >= _ENOUGH else min(rows, _STRIP)
    values = (points.shape[1], len(faces), rows, columns, strip, views.shape[1])
    names = ("vertex_count", "face_count", "rows", "columns", "strip", "axes")
    for name, value in zip(names, values, strict=True):
        if name in program:
            program[name] = value
    groups = min(-(-len(faces) // GROUP), _MOST_GROUPS)
    program.run(groups, len(views), -(-rows // strip))
    context.memory_barrier()


def view_blocks(views: int, faces: int, bytes_a_view: int) -> Iterator[tuple[int, int]]:
    """First and last (exclusive) of the views that are drawn at once."""
    at_once = max(1, min(_MOST_DRAWN // max(faces, 1), _MOST_BYTES // bytes_a_view, _MOST_GROUPS))
    for first in range(0, views, at_once):
        yield first, min(first + at_once, views)


def read(context: Any, buffer: Any, kind: Any, shape: tuple[int, ...]) -> NDArray[Any]:
    """The content of a buffer.  Raises :class:`LostError` if anything went wrong before."""
    content = buffer.read()
    if context.error != "GL_NO_ERROR":
        raise LostError
    return np.frombuffer(content, kind).reshape(shape)

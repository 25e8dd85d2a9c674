"""What the programs that draw share: their triangles, and how much is drawn at once.

The programs do in GLSL what :mod:`simplifier.kernels.coverage` does, in double precision and in the
same order of operations, so that they find the same pixels to the last one.  ``precise`` keeps the
compiler from fusing or reordering them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.device.card import GROUP, MOST_GROUPS, Card, Geometry

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


def draw(
    card: Card,
    program: Any,
    shape: Geometry,
    views: NDArray[np.float64],
    image: tuple[int, int],
    **uniforms: float,
) -> None:
    """Run a program of :data:`TRIANGLES` and :data:`LOOP` over all faces of a shape in all views.

    ``views`` (V, axes, 4), which are bound; ``image`` rows and columns.
    """
    rows, columns = image
    faces = len(shape.faces)
    strip = rows if faces * len(views) >= _ENOUGH else min(rows, _STRIP)
    shape.bind()
    card.run(
        program, (min(-(-faces // GROUP), MOST_GROUPS), len(views), -(-rows // strip)),
        vertex_count=shape.points.shape[1], face_count=faces, rows=rows, columns=columns,
        strip=strip, axes=views.shape[1], **uniforms,
    )  # fmt: skip


def view_blocks(views: int, faces: int, bytes_a_view: int) -> Iterator[tuple[int, int]]:
    """First and last (exclusive) of the views that are drawn at once."""
    at_once = max(1, min(_MOST_DRAWN // max(faces, 1), _MOST_BYTES // bytes_a_view, MOST_GROUPS))
    for first in range(0, views, at_once):
        yield first, min(first + at_once, views)

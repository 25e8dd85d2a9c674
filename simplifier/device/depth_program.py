"""Nearest depths, and what stands before a mesh: :mod:`simplifier.kernels.front` in programs.

OpenGL has no minimum of 64-bit numbers that many invocations may take at once.  So a depth becomes
two words that are ordered as it is, and is drawn twice: the first time for the least upper word of
each pixel, the second for the least lower word among those that have it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.device.card import GROUP, Card, Filled, Geometry, Shape
from simplifier.device.programs import LOOP, TRIANGLES, draw, view_blocks

_NARROWEST = "1e-9LF"  # pixels, as of the kernels

_ENDS = """
layout(std430, binding = 3) buffer Nearest { uint nearest[]; };

double depth_of(int vertex, int view) {
    int at = 12 * view + 8;
    precise double depth = projections[at] * vertices[vertex]
        + projections[at + 1] * vertices[vertex + vertex_count]
        + projections[at + 2] * vertices[vertex + 2 * vertex_count] + projections[at + 3];
    return depth;
}

// Columns that a row of a triangle covers, and the depth at x0 with its slope by column.
struct Span { int first; int last; double x0; double depth; double slope; };

Span span(int view, int row, Corner low, Corner middle, Corner high) {
    double z_low = depth_of(low.vertex, view);
    double z_middle = depth_of(middle.vertex, view);
    double z_high = depth_of(high.vertex, view);
    double share = share_of(low, high, row);
    double x0 = between(low.place.x, high.place.x, share), z0 = between(z_low, z_high, share);
    double x1, z1;
    if (row < middle.cell.y) {
        share = share_of(low, middle, row);
        x1 = between(low.place.x, middle.place.x, share);
        z1 = between(z_low, z_middle, share);
    } else {
        share = share_of(middle, high, row);
        x1 = between(middle.place.x, high.place.x, share);
        z1 = between(z_middle, z_high, share);
    }
    if (x1 < x0) {
        double kept = x0; x0 = x1; x1 = kept;
        kept = z0; z0 = z1; z1 = kept;
    }
    precise double slope = 0.0LF;
    if (x1 - x0 > NARROWEST) slope = (z1 - z0) / (x1 - x0);
    return Span(column_from(x0), column_from(x1) - 1, x0, z0, slope);
}

double depth_at(Span found, int column, double more) {
    precise double start = found.depth + more;
    precise double depth = start + (double(column) - found.x0) * found.slope;
    return depth;
}

// Lower and upper word, ordered as the depths are.
uvec2 words_of(double depth) {
    uvec2 bits = unpackDouble2x32(depth);
    return (bits.y >> 31) != 0u ? ~bits : uvec2(bits.x, bits.y ^ 0x80000000u);
}

double depth_from(uvec2 words) {
    bool negative = (words.y >> 31) == 0u;
    return packDouble2x32(negative ? ~words : uvec2(words.x, words.y ^ 0x80000000u));
}
""".replace("NARROWEST", _NARROWEST)

_NEAREST_ROW = """
uniform double threshold;
uniform bool upper;

void draw_row(int view, int row, Corner low, Corner middle, Corner high) {
    Span found = span(view, row, low, middle, high);
    for (int column = found.first; column <= found.last; ++column) {
        uvec2 words = words_of(depth_at(found, column, threshold));
        int pixel = 2 * ((view * rows + row) * columns + column);
        if (upper) atomicMin(nearest[pixel + 1], words.y);
        else if (words.y == nearest[pixel + 1]) atomicMin(nearest[pixel], words.x);
    }
}
"""

_COLUMNS = 4  # of an invocation, for few faces
_FEW = 4096  # faces

_NEAREST_OF_ROW = """
uniform double threshold;

struct Held { double x0; double depth; double slope; int first; int last; };
shared Held held[64];
shared int count;

// A work group is a row of a view: of 64 faces at a time it holds those that the row passes.
void main() {
    int view = int(gl_WorkGroupID.y), row = int(gl_WorkGroupID.x);
    int own = int(gl_LocalInvocationIndex), begin = int(gl_WorkGroupID.z) * 64 * COLUMNS + own;
    uvec2 least[COLUMNS];
    for (int at = 0; at < COLUMNS; ++at) least[at] = uvec2(0xFFFFFFFFu);
    for (int from = 0; from < face_count; from += 64) {
        if (own == 0) count = 0;
        barrier();
        Corner low, middle, high;
        if (from + own < face_count && read_face(from + own, view, low, middle, high)
                && low.cell.y <= row && row < high.cell.y) {
            Span found = span(view, row, low, middle, high);
            if (found.first <= found.last) {
                int place = atomicAdd(count, 1);
                held[place] =
                    Held(found.x0, found.depth, found.slope, found.first, found.last);
            }
        }
        barrier();
        for (int index = 0; index < count; ++index) {
            Held one = held[index];
            Span found = Span(one.first, one.last, one.x0, one.depth, one.slope);
            for (int at = 0; at < COLUMNS; ++at) {
                int column = begin + 64 * at;
                if (column < found.first || column > found.last) continue;
                uvec2 words = words_of(depth_at(found, column, threshold));
                bool nearer = words.y < least[at].y
                    || (words.y == least[at].y && words.x < least[at].x);
                if (nearer) least[at] = words;
            }
        }
        barrier();
    }
    for (int at = 0; at < COLUMNS; ++at) {
        int column = begin + 64 * at;
        if (column >= columns) break;
        int pixel = 2 * ((view * rows + row) * columns + column);
        nearest[pixel] = least[at].x;
        nearest[pixel + 1] = least[at].y;
    }
}
""".replace("COLUMNS", str(_COLUMNS))
"""The same for few faces, which are large: not a pixel is written twice."""

_FAR = 0xFFFFFFFF  # both words of a pixel where nothing is

_SETTLE_ROW = """
layout(std430, binding = 4) buffer Pictures { uint pictures[]; };  // of all views: seen, settled
uniform int words, settled;

void draw_row(int view, int row, Corner low, Corner middle, Corner high) {
    Span found = span(view, row, low, middle, high);
    if (found.first > found.last) return;
    int line = (view * rows + row) * words, start = (view * rows + row) * columns;
    for (int word = found.first >> 5; word <= found.last >> 5; ++word) {
        uint covered = span_of(word, found.first, found.last);
        uint open = covered & ~pictures[settled + line + word];
        if (open == 0u) continue;
        atomicOr(pictures[line + word], covered);
        uint done = 0u;
        while (open != 0u) {
            int bit = findLSB(open);
            open &= open - 1u;
            int column = 32 * word + bit, pixel = 2 * (start + column);
            uvec2 limit = uvec2(nearest[pixel], nearest[pixel + 1]);
            if (limit == uvec2(0xFFFFFFFFu) || depth_at(found, column, 0.0LF) <= depth_from(limit))
                done |= 1u << uint(bit);
        }
        if (done != 0u) atomicOr(pictures[settled + line + word], done);
    }
}
"""


_COUNT = """#version 430
layout(local_size_x = 64) in;
layout(std430, binding = 4) readonly buffer Pictures { uint pictures[]; };
layout(std430, binding = 5) buffer Counted { uvec2 counted[]; };
uniform int words, settled;  // of a view; of all views, behind which the settled pixels lie

shared uint seen, front;

void main() {
    if (gl_LocalInvocationIndex == 0u) { seen = 0u; front = 0u; }
    barrier();
    uint own_seen = 0u, own_front = 0u;
    int begin = int(gl_WorkGroupID.x) * words;
    for (int at = begin + int(gl_LocalInvocationIndex); at < begin + words; at += 64) {
        own_seen += uint(bitCount(pictures[at]));
        own_front += uint(bitCount(pictures[at] & ~pictures[settled + at]));
    }
    atomicAdd(seen, own_seen);
    atomicAdd(front, own_front);
    barrier();
    if (gl_LocalInvocationIndex == 0u) counted[gl_WorkGroupID.x] = uvec2(seen, front);
}
"""


class DepthProgram:
    """Draws depths; of the context that is current, as all its calls have to be.

    Shapes have faces; ``views`` (V, 3, 4) as :func:`~simplifier.kernels.coverage.drawable` gives
    them, ``image`` pixels a side.
    """

    def __init__(self, card: Card) -> None:
        self._card = card
        self._nearest = card.program(TRIANGLES + _ENDS + _NEAREST_ROW + LOOP)
        self._nearest_of_row = card.program(TRIANGLES + _ENDS + _NEAREST_OF_ROW)
        self._settle = card.program(TRIANGLES + _ENDS + _SETTLE_ROW + LOOP)
        self._count = card.program(_COUNT)

    def nearest(
        self, shape: Shape, views: NDArray[np.float64], image: int, threshold: float
    ) -> NDArray[np.float64]:
        """(V, image, image) the least depths plus the threshold, infinite where nothing is."""
        found = np.empty((len(views), image, image))
        (on_card,) = self._card.geometries([shape])
        for first, last in view_blocks(len(views), len(shape[1]), 8 * image * image):
            some = views[first:last]
            far = Filled(8 * len(some) * image * image, _FAR)
            with self._card.buffers(some, far, first=2) as (_, depths):
                self._draw_nearest(on_card, some, image, threshold)
                drawn = self._card.read(depths, "<u8", (len(some), image, image))
            upper = drawn >> np.uint64(63) != 0
            bits = np.where(upper, drawn ^ np.uint64(1 << 63), ~drawn)
            found[first:last] = np.where(drawn == np.uint64(2**64 - 1), np.inf, bits.view("<f8"))
        return found

    def front_pixels(
        self,
        mesh: Shape,
        occluder: Shape,
        views: NDArray[np.float64],
        image: int,
        threshold: float,
    ) -> NDArray[np.int64]:
        """(V, 2) as :func:`~simplifier.kernels.front.front_pixels`; the occluder may be empty."""
        card, pixels = self._card, np.empty((len(views), 2), dtype=np.int64)
        words, hides = 2 * -(-image // 64), len(occluder[1]) > 0
        on_card, *before = card.geometries([mesh, occluder] if hides else [mesh])
        most_faces = max(len(mesh[1]), len(occluder[1]))
        for first, last in view_blocks(len(views), most_faces, 8 * image * image):
            some = views[first:last]
            far = Filled(8 * len(some) * image * image, _FAR)
            settled = len(some) * image * words
            pictures, counted = Filled(8 * settled), Filled(8 * len(some))
            with card.buffers(some, far, pictures, counted, first=2) as (*_, counts):
                for shape in before:
                    self._draw_nearest(shape, some, image, threshold)
                draw(
                    card, self._settle, on_card, some, (image, image),
                    words=words, settled=settled,
                )  # fmt: skip
                card.run(self._count, (len(some),), words=image * words, settled=settled)
                pixels[first:last] = card.read(counts, np.uint32, (len(some), 2))
        return pixels

    def _draw_nearest(
        self, shape: Geometry, views: NDArray[np.float64], image: int, threshold: float
    ) -> None:
        """Into the buffer at binding 3, which holds what is far in both words of each pixel."""
        if len(shape.faces) <= _FEW:
            shape.bind()
            self._card.run(
                self._nearest_of_row, (image, len(views), -(-image // (GROUP * _COLUMNS))),
                vertex_count=shape.points.shape[1], face_count=len(shape.faces),
                rows=image, columns=image, axes=3, threshold=threshold,
            )  # fmt: skip
            return
        for upper in (True, False):
            draw(
                self._card, self._nearest, shape, views, (image, image),
                threshold=threshold, upper=upper,
            )  # fmt: skip

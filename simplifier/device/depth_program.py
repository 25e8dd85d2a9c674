"""Nearest depths, and what stands before a mesh: :mod:`simplifier.kernels.front` in programs.

OpenGL has no minimum of 64-bit numbers that many invocations may take at once.  So a depth becomes
two words that are ordered as it is, and is drawn twice: the first time for the least upper word of
each pixel, the second for the least lower word among those that have it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.device.programs import LOOP, TRIANGLES, buffers, dispatch, read, view_blocks

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


class DepthProgram:
    """Draws depths; of the context that is current, as all its calls have to be.

    ``points`` (3, n), ``faces`` (m, 3) and ``views`` (V, 3, 4) as
    :func:`~simplifier.kernels.coverage.drawable` gives them, ``image`` pixels a side.
    """

    def __init__(self, context: Any) -> None:
        self._context = context
        self._nearest = context.compute_shader(TRIANGLES + _ENDS + _NEAREST_ROW + LOOP)
        self._settle = context.compute_shader(TRIANGLES + _ENDS + _SETTLE_ROW + LOOP)

    def nearest(
        self,
        points: NDArray[np.float64],
        faces: NDArray[np.int32],
        views: NDArray[np.float64],
        image: int,
        threshold: float,
    ) -> NDArray[np.float64]:
        """(V, image, image) the least depths plus the threshold, infinite where nothing is."""
        found = np.empty((len(views), image, image))
        for first, last in view_blocks(len(views), len(faces), 8 * image * image):
            far = np.full((last - first, image, image, 2), _FAR, np.uint32)
            with buffers(self._context, points, faces, views[first:last], far) as held:
                self._draw_nearest(points, faces, views[first:last], image, threshold)
                drawn = read(self._context, held[3], "<u8", far.shape[:3])
            upper = drawn >> np.uint64(63) != 0
            bits = np.where(upper, drawn ^ np.uint64(1 << 63), ~drawn)
            found[first:last] = np.where(drawn == np.uint64(2**64 - 1), np.inf, bits.view("<f8"))
        return found

    def front_pixels(
        self,
        mesh: tuple[NDArray[np.float64], NDArray[np.int32]],
        occluder: tuple[NDArray[np.float64], NDArray[np.int32]],
        views: NDArray[np.float64],
        image: int,
        threshold: float,
    ) -> NDArray[np.int64]:
        """(V, 2) as :func:`~simplifier.kernels.front.front_pixels`."""
        pixels = np.empty((len(views), 2), dtype=np.int64)
        words = 2 * -(-image // 64)
        most_faces = max(len(mesh[1]), len(occluder[1]))
        for first, last in view_blocks(len(views), most_faces, 8 * image * image):
            some = views[first:last]
            shape = (2, last - first, image, words)
            far = np.full((last - first, image, image, 2), _FAR, np.uint32)
            with buffers(self._context, some, far, 4 * int(np.prod(shape)), first=2) as held:
                if len(occluder[1]) > 0:
                    with buffers(self._context, *occluder):
                        self._draw_nearest(*occluder, some, image, threshold)
                with buffers(self._context, *mesh):
                    self._settle["words"] = words
                    self._settle["settled"] = int(np.prod(shape[1:]))
                    dispatch(self._context, self._settle, *mesh, some, (image, image))
                seen, settled = read(self._context, held[2], np.uint32, shape)
            for place, bits in enumerate((seen, seen & ~settled)):
                counted = np.bitwise_count(bits).sum(axis=(1, 2), dtype=np.int64)
                pixels[first:last, place] = counted
        return pixels

    def _draw_nearest(
        self,
        points: NDArray[np.float64],
        faces: NDArray[np.int32],
        views: NDArray[np.float64],
        image: int,
        threshold: float,
    ) -> None:
        self._nearest["threshold"] = threshold
        for upper in (True, False):
            self._nearest["upper"] = upper
            dispatch(self._context, self._nearest, points, faces, views, (image, image))

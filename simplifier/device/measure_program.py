"""The occlusion measure of many candidates by a compute program: :mod:`simplifier.kernels.measure`.

A work group is a candidate in a view, an invocation one of its 64 rows.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.device.card import Card, Filled
from simplifier.device.device import PolygonArrays
from simplifier.progress import TellShare

_AT_ONCE = 4096  # candidates of a dispatch

_SOURCE = """#version 430
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Points { double points[]; };
layout(std430, binding = 1) readonly buffer Lowest { int lowest[]; };
layout(std430, binding = 2) readonly buffer Offsets { int offsets[]; };
layout(std430, binding = 3) readonly buffer Maps { double maps[]; };
layout(std430, binding = 4) readonly buffer Tried { ivec2 tried[]; };  // polygon, level
layout(std430, binding = 5) readonly buffer Base { uvec2 base[]; };
layout(std430, binding = 6) buffer Scores { uint scores[]; };

shared uvec2 image[66];  // row r at place r + 1, background above and below
shared uint area;

dvec2 projected(int vertex, int map) {
    double a = points[2 * vertex], b = points[2 * vertex + 1];
    precise double x = maps[map] * a + maps[map + 1] * b + maps[map + 2];
    precise double y = maps[map + 3] * a + maps[map + 4] * b + maps[map + 5];
    return dvec2(x, y);
}

// The pixels of a row with their centre right of an edge; none where it does not pass.
uvec2 edge_bits(dvec2 low, dvec2 high, int row) {
    if (low.y > high.y) { dvec2 kept = low; low = high; high = kept; }
    if (row < int(ceil(clamp(low.y, 0.0LF, 65.0LF) - 0.5LF))) return uvec2(0u);
    if (row >= int(ceil(clamp(high.y, 0.0LF, 64.0LF) - 0.5LF))) return uvec2(0u);
    precise double start = low.x - 0.5LF;
    precise double slope = (high.x - low.x) / (high.y - low.y);
    precise double place = start + (double(row) + 0.5LF - low.y) * slope;
    double column = ceil(place);
    if (!(column < 64.0LF)) return uvec2(0u);
    int shift = int(max(column, 0.0LF));
    return shift < 32 ? uvec2(0xFFFFFFFFu << uint(shift), 0xFFFFFFFFu)
                      : uvec2(0u, 0xFFFFFFFFu << uint(shift - 32));
}

uvec2 to_the_right(uvec2 word) { return uvec2(word.x << 1, (word.y << 1) | (word.x >> 31)); }

uvec2 to_the_left(uvec2 word) { return uvec2((word.x >> 1) | (word.y << 31), word.y >> 1); }

void main() {
    int candidate = int(gl_WorkGroupID.x), view = int(gl_WorkGroupID.y);
    int row = int(gl_LocalInvocationID.x), place = row + 1;
    int polygon = tried[candidate].x, level = tried[candidate].y;
    int map = 6 * (polygon * int(gl_NumWorkGroups.y) + view);
    int begin = offsets[polygon], end = offsets[polygon + 1], last = end - 1;
    while (lowest[last] > level) --last;
    uvec2 word = uvec2(0u);
    dvec2 from = projected(last, map);
    for (int vertex = begin; vertex < end; ++vertex) {
        if (lowest[vertex] > level) continue;
        dvec2 to = projected(vertex, map);
        word ^= edge_bits(from, to, row);
        from = to;
    }
    word |= base[64 * view + row];
    image[place] = word;
    if (row == 0) { image[0] = uvec2(0u); image[65] = uvec2(0u); area = 0u; }
    barrier();
    atomicAdd(area, uint(bitCount(word.x) + bitCount(word.y)));
    barrier();
    uint left = area, total = left;
    for (int step = 0; left != 0u; step = step == 4 ? 0 : step + 1) {
        uvec2 above = image[place - 1], below = image[place + 1];
        uvec2 around = (step & 1) == 0 ? word : word & above & below;
        uvec2 kept = around & to_the_right(around) & to_the_left(around) & above & below;
        barrier();
        word = kept;
        image[place] = word;
        if (row == 0) area = 0u;
        barrier();
        atomicAdd(area, uint(bitCount(word.x) + bitCount(word.y)));
        barrier();
        left = area;
        total += 2u * left;
    }
    if (row == 0) atomicAdd(scores[candidate], total);
}
"""


class MeasureProgram:
    """Scores candidates; of the context that is current, as all its calls have to be."""

    def __init__(self, card: Card) -> None:
        self._card = card
        self._program = card.program(_SOURCE)

    def scores(
        self,
        shapes: PolygonArrays,
        polygons: NDArray[np.int32],
        levels: NDArray[np.int32],
        base: NDArray[np.uint64],
        tell: TellShare,
    ) -> NDArray[np.int64]:
        """(k,) as :meth:`~simplifier.device.device.Device.polygon_scores`; k is 1 or more."""
        points, lowest, offsets, maps = shapes
        scores = np.empty(len(polygons), dtype=np.int64)
        tried = np.stack([polygons, levels], axis=1).astype(np.int32)
        with self._card.buffers(points, lowest, offsets.astype(np.int32), maps):
            for first in range(0, len(tried), _AT_ONCE):
                some = tried[first : first + _AT_ONCE]
                with self._card.buffers(some, base, Filled(4 * len(some)), first=4) as held:
                    self._card.run(self._program, (len(some), len(base)))
                    found = self._card.read(held[2], np.uint32, (len(some),))
                scores[first : first + _AT_ONCE] = found
                tell((first + len(some)) / len(tried))
        return scores

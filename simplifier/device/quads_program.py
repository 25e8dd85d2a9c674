"""Random quads of silhouettes that lie on the card: :mod:`simplifier.kernels.random_quads`.

Per view the box of the original, then a summed-area table of both silhouettes, in which four places
tell the pixels of a quad, then the quads.  A quad is drawn of the same random numbers as there, so
that the sums are the same whole numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.device.card import GROUP, MOST_GROUPS, Card, Filled
from simplifier.device.device import QuadSample
from simplifier.kernels.random_quads import mean_areas

_MOST_BYTES = 1 << 27  # of tables at once

_QUADS = 128  # of a work group: their pixels, 2^24 each at most, are added up in 32 bits

_BOXES = """#version 430
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Originals { uint originals[]; };
layout(std430, binding = 1) writeonly buffer Boxes { ivec4 boxes[]; };
uniform int rows, words;

shared int first_row, row_end;
shared uint united[2048];

// First row, row end, first column and column end of a view's pixels; all 0 where there are none.
void main() {
    int own = int(gl_LocalInvocationIndex), view = int(gl_WorkGroupID.x);
    if (own == 0) { first_row = rows; row_end = 0; }
    for (int word = own; word < words; word += 64) united[word] = 0u;
    barrier();
    for (int row = own; row < rows; row += 64) {
        bool covered = false;
        for (int word = 0; word < words; ++word) {
            uint bits = originals[(view * rows + row) * words + word];
            if (bits == 0u) continue;
            covered = true;
            atomicOr(united[word], bits);
        }
        if (covered) { atomicMin(first_row, row); atomicMax(row_end, row + 1); }
    }
    barrier();
    if (own == 0) {
        ivec4 box = ivec4(0);
        if (row_end > 0) {
            int first = 0, last = words - 1;
            while (united[first] == 0u) ++first;
            while (united[last] == 0u) --last;
            box = ivec4(first_row, row_end, 32 * first + findLSB(united[first]),
                        32 * last + findMSB(united[last]) + 1);
        }
        boxes[view] = box;
    }
}
"""

_BEFORE = """#version 430
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Originals { uint originals[]; };
layout(std430, binding = 1) readonly buffer Occluders { uint occluders[]; };
layout(std430, binding = 2) writeonly buffer Before { uvec2 before[]; };
uniform int lines, words, first_line;

// Of each word of a row, the pixels of both silhouettes in the words before it.
void main() {
    int step = int(gl_NumWorkGroups.x * gl_WorkGroupSize.x);
    for (int line = int(gl_GlobalInvocationID.x); line < lines; line += step) {
        uvec2 count = uvec2(0u);
        for (int word = 0; word < words; ++word) {
            int at = (first_line + line) * words + word;
            before[line * words + word] = count;
            count += uvec2(bitCount(uvec2(originals[at], occluders[at])));
        }
    }
}
"""

_TABLE = """#version 430
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Originals { uint originals[]; };
layout(std430, binding = 1) readonly buffer Occluders { uint occluders[]; };
layout(std430, binding = 2) readonly buffer Before { uvec2 before[]; };
layout(std430, binding = 3) writeonly buffer Table { uvec2 table[]; };
uniform int rows, columns, words, first_view;

// Place (row, column) holds the pixels of both silhouettes below that row and left of that column.
void main() {
    int column = int(gl_GlobalInvocationID.x), view = int(gl_WorkGroupID.y);
    if (column > columns) return;
    int word = min(column >> 5, words - 1);
    uint left = column - 32 * word < 32 ? (1u << uint(column - 32 * word)) - 1u : 0xFFFFFFFFu;
    int place = view * (rows + 1) * (columns + 1) + column;
    uvec2 count = uvec2(0u);
    table[place] = count;
    for (int row = 0; row < rows; ++row) {
        int at = ((first_view + view) * rows + row) * words + word;
        uvec2 bits = uvec2(originals[at], occluders[at]) & left;
        count += before[(view * rows + row) * words + word] + uvec2(bitCount(bits));
        place += columns + 1;
        table[place] = count;
    }
}
"""

_SAMPLE = """#version 430
layout(local_size_x = QUADS) in;
layout(std430, binding = 3) readonly buffer Table { uvec2 table[]; };
layout(std430, binding = 4) readonly buffer Boxes { ivec4 boxes[]; };
layout(std430, binding = 5) buffer Pixels { uint pixels[]; };  // 64 bits each, the lower half first
uniform int rows, columns, quads, first_view;
uniform uint first_number;  // of the view whose box is the first
uniform uvec2 seed;

shared uint sums[3];  // hidden rightly, missed, hidden wrongly

// 64 bits in two words, the lower first.
uvec2 plus(uvec2 a, uvec2 b) {
    uint carry;
    uint low = uaddCarry(a.x, b.x, carry);
    return uvec2(low, a.y + b.y + carry);
}

uvec2 times(uvec2 a, uvec2 b) {
    uint high, low;
    umulExtended(a.x, b.x, high, low);
    return uvec2(low, high + a.x * b.y + a.y * b.x);
}

uvec2 mixed_right(uvec2 a, int shift) {  // by 1 to 31 bits
    return a ^ uvec2((a.x >> shift) | (a.y << (32 - shift)), a.y >> shift);
}

uvec2 mixed(uvec2 state) {
    state = times(mixed_right(state, 30), uvec2(0x1CE4E5B9u, 0xBF58476Du));
    state = times(mixed_right(state, 27), uvec2(0x133111EBu, 0x94D049BBu));
    return mixed_right(state, 31);
}

int scaled(uint bits, int limit) {
    uint high, low;
    umulExtended(bits, uint(limit), high, low);
    return int(high);
}

// The place in the table of a row and column of a view.
int place_of(int view, int row, int column) {
    return (view * (rows + 1) + row) * (columns + 1) + column;
}

void main() {
    int view = int(gl_WorkGroupID.y), own = int(gl_LocalInvocationIndex);
    int quad = int(gl_WorkGroupID.z * gl_NumWorkGroups.x + gl_WorkGroupID.x) * QUADS + own;
    ivec4 box = boxes[first_view + view];
    if (own < 3) sums[own] = 0u;
    barrier();
    if (box.y > 0 && quad < quads) {
        const uvec2 golden = uvec2(0x7F4A7C15u, 0x9E3779B9u);
        uvec2 number = uvec2(first_number + uint(first_view + view), 0u);
        uvec2 state = mixed(plus(mixed(plus(seed, golden)), times(golden, number)));
        state = plus(state, times(golden, uvec2(uint(2 * quad + 1), 0u)));
        uvec2 across = mixed(state), along = mixed(plus(state, golden));
        int x0 = scaled(across.x, box.w - box.z), x1 = scaled(across.y, box.w - box.z);
        int y0 = scaled(along.x, box.y - box.x), y1 = scaled(along.y, box.y - box.x);
        int left = box.z + min(x0, x1), right = box.z + max(x0, x1) + 1;
        int bottom = box.x + min(y0, y1), top = box.x + max(y0, y1) + 1;
        uvec2 count = table[place_of(view, top, right)] - table[place_of(view, bottom, right)]
            - table[place_of(view, top, left)] + table[place_of(view, bottom, left)];
        uint area = uint((right - left) * (top - bottom));
        bool seen = count.x == area, hidden = count.y == area;
        if (seen && hidden) atomicAdd(sums[0], area);
        if (seen && !hidden) atomicAdd(sums[1], area);
        if (!seen && hidden) atomicAdd(sums[2], area - count.x);
    }
    barrier();
    if (own < 3) {
        uint sum = sums[own];
        int at = 6 * (first_view + view) + 2 * own;
        if (sum != 0u) {
            uint old = atomicAdd(pixels[at], sum);
            if (old + sum < old) atomicAdd(pixels[at + 1], 1u);
        }
    }
}
""".replace("QUADS", str(_QUADS))


def bytes_of_table(image: int) -> int:
    """Of a view ``image`` pixels a side, all in one buffer."""
    return 8 * (image + 1) ** 2


class QuadsProgram:
    """Counts random quads; of the context that is current, as all its calls have to be."""

    def __init__(self, card: Card) -> None:
        self._card = card
        self._boxes, self._before = card.program(_BOXES), card.program(_BEFORE)
        self._table, self._sample = card.program(_TABLE), card.program(_SAMPLE)

    def pixels(
        self, original: Any, occluders: Sequence[Any], views: int, image: int, sample: QuadSample
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """As :meth:`~simplifier.device.device.Device.quad_pixels`, of buffers of bit rows."""
        card, words = self._card, 2 * -(-image // 64)
        sums = np.empty((len(occluders), views, 3), np.uint64)
        with card.buffers(Filled(16 * views)) as (boxes,):
            original.bind_to_storage_buffer(0)
            boxes.bind_to_storage_buffer(1)
            card.run(self._boxes, (views,), rows=image, words=words)
            found = card.read(boxes, np.int32, (views, 4))
            for index, occluder in enumerate(occluders):
                with card.buffers(Filled(24 * views), first=5) as (pixels,):
                    for place, one in ((0, original), (1, occluder), (4, boxes)):
                        one.bind_to_storage_buffer(place)
                    self._add_up(views, image, words, sample)
                    sums[index] = card.read(pixels, "<u8", (views, 3))
        areas = mean_areas(found[:, 1] - found[:, 0], found[:, 3] - found[:, 2])
        return areas, sums.astype(np.int64) / sample.quads

    def _add_up(self, views: int, image: int, words: int, sample: QuadSample) -> None:
        card = self._card
        table_size = bytes_of_table(image)
        at_once = min(max(min(_MOST_BYTES, card.largest) // table_size, 1), views)
        quad_groups = -(-sample.quads // _QUADS)
        row_of_groups = min(quad_groups, MOST_GROUPS)
        before, table = Filled(8 * at_once * image * words), Filled(at_once * table_size)
        with card.buffers(before, table, first=2):
            for first in range(0, views, at_once):
                some = min(at_once, views - first)
                lines = some * image
                groups = min(-(-lines // GROUP), MOST_GROUPS)
                card.run(
                    self._before, (groups,), lines=lines, words=words, first_line=first * image
                )
                shape = {"rows": image, "columns": image, "first_view": first}
                card.run(self._table, (image // GROUP + 1, some), words=words, **shape)
                card.run(
                    self._sample, (row_of_groups, some, -(-quad_groups // row_of_groups)),
                    quads=sample.quads, first_number=sample.first_view,
                    seed=(sample.seed & 0xFFFFFFFF, sample.seed >> 32), **shape,
                )  # fmt: skip

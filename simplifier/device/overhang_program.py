"""What an occluder covers beside its original: :mod:`simplifier.kernels.overhang` in programs.

Nearly all that lies beside is near the original, and rows next to a pixel tell how near.  A view in
which a pixel is further out is left to the processor, which has a faster way for many of those.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.device.card import GROUP, MOST_GROUPS, Card, Filled
from simplifier.kernels.overhang import overhang_pixels

_ROWS_AWAY = 64  # that a pixel looks at in each direction

_WORDS = """#version 430
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Originals { uint originals[]; };
layout(std430, binding = 1) readonly buffer Occluders { uint occluders[]; };
layout(std430, binding = 3) buffer Counted { int counted[]; };  // four of each view: pixels of the
// original, pixels beside it, the largest squared distance, and whether that is not found here
uniform int rows, words;
"""

_BESIDE = (
    _WORDS
    + """
layout(std430, binding = 2) writeonly buffer Beside { uint beside[]; };

shared int there, aside;

uint around(int row, int word, int view) {
    if (word < 0 || word >= words) return 0u;
    int at = (view * rows + row) * words + word;
    uint united = originals[at];
    if (row > 0) united |= originals[at - words];
    if (row + 1 < rows) united |= originals[at + words];
    return united;
}

void main() {
    int view = int(gl_WorkGroupID.y);
    if (gl_LocalInvocationIndex == 0u) { there = 0; aside = 0; }
    barrier();
    int step = int(gl_NumWorkGroups.x * gl_WorkGroupSize.x);
    for (int place = int(gl_GlobalInvocationID.x); place < rows * words; place += step) {
        int at = view * rows * words + place;
        uint original = originals[at], over = occluders[at] & ~original;
        if (over != 0u) {
            int row = place / words, word = place % words;
            uint here = around(row, word, view);
            uint near = here | (here << 1) | (here >> 1);
            near |= (around(row, word - 1, view) >> 31) | (around(row, word + 1, view) << 31);
            over &= ~near;
        }
        beside[at] = over;
        if (original != 0u) atomicAdd(there, bitCount(original));
        if (over != 0u) atomicAdd(aside, bitCount(over));
    }
    barrier();
    if (gl_LocalInvocationIndex == 0u) {
        if (there != 0) atomicAdd(counted[4 * view], there);
        if (aside != 0) atomicAdd(counted[4 * view + 1], aside);
    }
}
"""
)

_FARTHEST = (
    _WORDS
    + """
layout(std430, binding = 2) readonly buffer Beside { uint beside[]; };

const int MANY = 1 << 15;  // columns: more than there are

// Columns from one to the nearest pixel of the line whose first word that is.
int columns_aside(int first, int column) {
    int nearest = MANY;
    uint ahead = 0xFFFFFFFFu << uint(column & 31), behind = 0xFFFFFFFFu >> uint(31 - (column & 31));
    for (int word = column >> 5; word < words; ++word, ahead = 0xFFFFFFFFu) {
        uint bits = originals[first + word] & ahead;
        if (bits != 0u) { nearest = 32 * word + findLSB(bits) - column; break; }
    }
    for (int word = column >> 5; word >= 0; --word, behind = 0xFFFFFFFFu) {
        uint bits = originals[first + word] & behind;
        if (bits != 0u) return min(nearest, column - 32 * word - findMSB(bits));
    }
    return nearest;
}

void main() {
    int view = int(gl_WorkGroupID.y);
    if (counted[4 * view] == 0 || counted[4 * view + 1] == 0) return;
    int step = int(gl_NumWorkGroups.x * gl_WorkGroupSize.x);
    for (int place = int(gl_GlobalInvocationID.x); place < rows * words; place += step) {
        uint over = beside[view * rows * words + place];
        int row = place / words;
        while (over != 0u) {
            int column = 32 * (place % words) + findLSB(over), nearest = MANY * MANY;
            over &= over - 1u;
            // Distances only grow, so what is seen of the largest here is no more than it is.
            int most = counted[4 * view + 2];
            for (int away = 0; nearest > most && away * away < nearest && away < rows; ++away) {
                if (away > ROWS_AWAY) { counted[4 * view + 3] = 1; nearest = 0; break; }
                for (int other = row - away; other <= row + away; other += max(2 * away, 1)) {
                    if (other < 0 || other >= rows) continue;
                    int aside = columns_aside((view * rows + other) * words, column);
                    nearest = min(nearest, away * away + aside * aside);
                }
            }
            if (nearest > most) atomicMax(counted[4 * view + 2], nearest);
        }
    }
}
"""
).replace("ROWS_AWAY", str(_ROWS_AWAY))


class OverhangProgram:
    """Counts what lies beside; of the context that is current, as all its calls have to be."""

    def __init__(self, card: Card) -> None:
        self._card = card
        self._beside, self._farthest = card.program(_BESIDE), card.program(_FARTHEST)

    def pixels(
        self, original: Any, occluders: Sequence[Any], views: int, image: int
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """As :meth:`~simplifier.device.device.Device.overhang_pixels`, of buffers of bit rows."""
        pixels = np.empty((len(occluders), views, 2), np.int64)
        farthest = np.empty((len(occluders), views), np.int64)
        for index, occluder in enumerate(occluders):
            pixels[index], farthest[index] = self._of(original, occluder, views, image)
        return pixels, farthest

    def _of(
        self, original: Any, occluder: Any, views: int, image: int
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        card, words = self._card, 2 * -(-image // 64)
        size = 4 * views * image * words
        with card.buffers(Filled(size), Filled(16 * views), first=2) as (_, counted):
            original.bind_to_storage_buffer(0)
            occluder.bind_to_storage_buffer(1)
            groups = (min(-(-image * words // GROUP), MOST_GROUPS), views)
            card.run(self._beside, groups, rows=image, words=words)
            card.run(self._farthest, groups, rows=image, words=words)
            found = card.read(counted, np.int32, (views, 4)).astype(np.int64)
        pixels, farthest = found[:, :2].copy(), found[:, 2].copy()
        farthest[(found[:, 0] == 0) & (found[:, 1] > 0)] = -1
        if (left := found[:, 3] != 0).any():
            shape = (views, image, words // 2)
            there, hidden = (card.read(one, np.uint64, shape)[left] for one in (original, occluder))
            farthest[left] = overhang_pixels(there, hidden, image)[1]
        return pixels, farthest

"""Silhouettes by a compute program: :func:`simplifier.kernels.coverage.coverage_masks`."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import closing
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.device.card import Card, Filled, Shape
from simplifier.device.programs import LOOP, TRIANGLES, draw, view_blocks
from simplifier.kernels.coverage import MaskArray
from simplifier.progress import TellShare

_ROW = """
layout(std430, binding = 3) buffer Masks { uint masks[]; };
uniform int words;

void draw_row(int view, int row, Corner low, Corner middle, Corner high) {
    double x0 = between(low.place.x, high.place.x, share_of(low, high, row));
    double x1 = row < middle.cell.y
        ? between(low.place.x, middle.place.x, share_of(low, middle, row))
        : between(middle.place.x, high.place.x, share_of(middle, high, row));
    int first = column_from(min(x0, x1)), last = column_from(max(x0, x1)) - 1;
    if (first > last) return;
    int line = (view * rows + row) * words;
    for (int word = first >> 5; word <= last >> 5; ++word) {
        uint span = span_of(word, first, last);
        // Bits are only ever set, so what is seen of them here is there.
        if ((masks[line + word] & span) != span) atomicOr(masks[line + word], span);
    }
}
"""


class CoverageProgram:
    """Draws into bit rows; of the context that is current, as all its calls have to be."""

    def __init__(self, card: Card) -> None:
        self._card = card
        self._program = card.program(TRIANGLES + _ROW + LOOP)

    def masks(
        self,
        shape: Shape,
        views: NDArray[np.float64],
        image: tuple[int, int],
        tell: TellShare,
    ) -> MaskArray:
        """(V, rows, words) of a shape with faces."""
        masks = np.empty((len(views), image[0], -(-image[1] // 64)), dtype=np.uint64)
        with closing(self.in_blocks([shape], views, image)) as blocks:
            for first, last, drawn in blocks:
                masks[first:last] = self._card.read(drawn, np.uint64, masks[first:last].shape)
                tell(last / len(views))
        return masks

    def in_blocks(
        self, shapes: Sequence[Shape], views: NDArray[np.float64], image: tuple[int, int]
    ) -> Generator[tuple[Any, ...]]:
        """First and last (exclusive) of some views, and a buffer a shape with its bit rows in them,
        which lies on the card until the next is asked for, or this is closed.
        """
        drawn = [index for index, (_, faces) in enumerate(shapes) if len(faces) > 0]
        on_card = self._card.geometries([shapes[index] for index in drawn])
        faces = max(len(one) for _, one in shapes)
        words = -(-image[1] // 64)
        bytes_a_view = 8 * image[0] * words
        for first, last in view_blocks(len(views), faces, len(shapes) * bytes_a_view):
            some = views[first:last]
            empty = [Filled(bytes_a_view * len(some))] * len(shapes)
            with self._card.buffers(some, *empty, first=2) as (_, *masks):
                for index, shape in zip(drawn, on_card, strict=True):
                    masks[index].bind_to_storage_buffer(3)
                    draw(self._card, self._program, shape, some, image, words=2 * words)
                yield first, last, *masks

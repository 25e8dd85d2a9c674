"""Silhouettes by a compute program: :func:`simplifier.kernels.coverage.coverage_masks`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.device.programs import LOOP, TRIANGLES, buffers, dispatch, read, view_blocks
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

    def __init__(self, context: Any) -> None:
        self._context = context
        self._program = context.compute_shader(TRIANGLES + _ROW + LOOP)

    def masks(
        self,
        points: NDArray[np.float64],
        faces: NDArray[np.int32],
        views: NDArray[np.float64],
        image: tuple[int, int],
        tell: TellShare,
    ) -> MaskArray:
        """(V, rows, words) of what :func:`~simplifier.kernels.coverage.drawable` gives."""
        rows, columns = image
        words = -(-columns // 64)
        masks = np.empty((len(views), rows, words), dtype=np.uint64)
        self._program["words"] = 2 * words
        with buffers(self._context, points, faces):
            for first, last in view_blocks(len(views), len(faces), 8 * rows * words):
                some = views[first:last]
                shape = (last - first, rows, words)
                size = masks[first:last].nbytes
                with buffers(self._context, some, size, first=2) as (_, drawn):
                    dispatch(self._context, self._program, points, faces, some, image)
                    masks[first:last] = read(self._context, drawn, np.uint64, shape)
                tell(last / len(views))
        return masks

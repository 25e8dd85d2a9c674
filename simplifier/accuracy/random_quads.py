"""Expected pixels of random quads, view by view: sampled, or exact (paper section 6.1).

A quad is two corner pixels, each drawn on its own and uniformly from the original's screen bounding
box (the smallest pixel rectangle that holds the original's pixels); it covers the pixels from the
lesser to the greater in each axis, both included.  With full(mask) = the whole quad lies in it:

    Nt  pixels of quads with full(original) and full(occluder)
    Pf  pixels of quads with full(original) and not full(occluder)
    Nf  pixels outside the original of quads with full(occluder) and not full(original)
"""

from __future__ import annotations

import numpy as np

from simplifier.geometry.mesh import FloatArray
from simplifier.kernels.coverage import MaskArray
from simplifier.kernels.random_quads import sample_quads
from simplifier.kernels.threads import run_chunks


def sampled_quad_pixels(
    original: MaskArray,
    occluder: MaskArray,
    columns: int,
    *,
    quads: int,
    seed: int,
    first_view: int = 0,
) -> FloatArray:
    """(V, 3) float64: mean Nt, Pf and Nf of ``quads`` random quads a view, pixels a quad.

    ``original``, ``occluder``  (V, rows, words) bit rows of :mod:`simplifier.kernels.coverage`.
    ``seed``                    0 .. 2^64 - 1; a quad depends on (seed, view, number of the quad)
                                alone, so neither threads nor blocks of views change the result:
                                view i of the arrays is view ``first_view`` + i.
    """
    pixels = np.zeros((len(original), 3), dtype=np.int64)
    run_chunks(
        lambda begin, end: sample_quads(
            original,
            occluder,
            columns,
            quads,
            np.uint64(seed),
            np.uint64(first_view),
            begin,
            end,
            pixels,
        ),
        len(original),
    )
    return np.asarray(pixels / quads)

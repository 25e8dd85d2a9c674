"""How much there is to hide: the coverage of a mesh, by which recall means more or less.

Of the pixels that random quads cover, the *coverage* is the share in quads that the original fills.
A ball has a third, a frame of thin bars a hundred-thousandth: there recall is about quads of a few
pixels, of which a sample meets next to none.
"""

from __future__ import annotations

import numpy as np

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import BoolArray
from simplifier.kernels.coverage import MaskArray


def mean_quad_areas(original: MaskArray) -> FloatArray:
    """(V,) float64: pixels of a random quad of each view, filled or not; 0 where nothing shows.

    ``original``  (V, rows, words) bit rows of :mod:`simplifier.kernels.coverage`.

    Two corners drawn from n places are (n - 1 / n) / 3 apart in the mean.
    """
    rows = np.asarray(original.any(axis=2))
    words = np.ascontiguousarray(np.bitwise_or.reduce(original, axis=1))
    columns = np.unpackbits(words.astype("<u8").view(np.uint8), axis=1, bitorder="little")
    return _mean_length(rows) * _mean_length(columns.astype(bool))


def _mean_length(covered: BoolArray) -> FloatArray:
    """(V,) of the places (V, n) from the first to the last that is covered."""
    count = covered.shape[1]
    first, last = covered.argmax(axis=1), count - 1 - covered[:, ::-1].argmax(axis=1)
    places = np.where(covered.any(axis=1), last - first + 1, 0).astype(np.float64)
    lengths = (places - 1.0 / np.maximum(places, 1.0)) / 3.0 + 1.0
    return np.where(places > 0.0, lengths, 0.0)

"""A share of the original's pixels in each of many views, its mean and its worst."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simplifier.geometry.mesh import FloatArray


@dataclass(frozen=True, eq=False)
class ViewShares:
    """What occluders do to pixels, view by view.

    ``by_view``    (V,) float64: the pixels in question as a share of the original's.
    ``directions`` (V, 3) float64 unit vectors, the lines of sight.
    """

    by_view: FloatArray
    directions: FloatArray

    @property
    def mean(self) -> float:
        """Of the shares of all views, each of which counts alike."""
        return float(self.by_view.mean())

    @property
    def worst_view(self) -> int:
        """The view with the largest share, the first of equals."""
        return int(np.argmax(self.by_view))

    @property
    def worst(self) -> float:
        """The share in that view."""
        return float(self.by_view[self.worst_view])

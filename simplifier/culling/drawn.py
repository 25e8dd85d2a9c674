"""Parts that each way of culling leaves -> what is drawn of the scene, and what is missing."""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Sequence
from dataclasses import astuple, dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.solid import BoolArray
from simplifier.hierarchy.parts import Parts


class Way(StrEnum):
    """What decides which parts of the scene are drawn.

    FRUSTUM    the view alone: parts whose box is not wholly beside the view frustum.
    PVS        of these, the parts of objects that the visible sets have.
    OCCLUDERS  of those in the frustum, the parts that no occluder hides.
    BOTH       what both leave.
    """

    FRUSTUM = "frustum"
    PVS = "pvs"
    OCCLUDERS = "occluders"
    BOTH = "both"


@dataclass(frozen=True)
class Drawn:
    """In one frame, or in all.

    ``objects``        of which a part is drawn.
    ``triangles``      of the parts that are drawn.
    ``wrong_objects``  visible in a pixel, and no part of them is drawn.
    ``wrong_pixels``   in which the nearest part is not drawn.
    """

    objects: int = 0
    triangles: int = 0
    wrong_objects: int = 0
    wrong_pixels: int = 0

    @classmethod
    def of(cls, parts: Parts, drawn: BoolArray, visible: NDArray[np.int64]) -> Drawn:
        """By what is drawn (p,) and the pixels (p,) that each part is the nearest in."""
        owners, count = parts.object_of, int(parts.object_of.max(initial=-1)) + 1
        shown = np.bincount(owners[drawn], minlength=count) > 0
        seen = np.bincount(owners[visible > 0], minlength=count) > 0
        return cls(
            int(shown.sum()),
            int(parts.scene.triangle_counts[drawn].sum()),
            int((seen & ~shown).sum()),
            int(visible[~drawn].sum()),
        )

    @classmethod
    def total(cls, several: Iterable[Drawn]) -> Drawn:
        """All of them added up."""
        return cls(*(sum(column) for column in zip(*map(astuple, several), strict=True)))


@dataclass(frozen=True)
class Spread:
    """Of a figure over the frames; ``frame`` is the place of the first that has the ``most``."""

    mean: float
    median: float
    most: int
    frame: int

    @classmethod
    def of(cls, values: Sequence[int]) -> Spread:
        """One value or more."""
        most = max(values)
        return cls(
            statistics.fmean(values), float(statistics.median(values)), most, values.index(most)
        )

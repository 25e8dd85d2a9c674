"""Verdicts of culling held against what is truly seen: the fate of every part or object."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import astuple, dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from simplifier.culling.depth_buffer import Verdict
from simplifier.geometry.mesh import IntArray

Pixels = NDArray[np.int64]
"""(n,) a number of pixels for each part or object."""


class Fate(IntEnum):
    """What became of a part or an object in one frame.

    ABSENT  covers no pixel's centre, even alone; whatever is said of it shows nowhere.
    SEEN    is visible in a pixel, and not culled.
    CULLED  covers pixels alone but is visible in none, and is culled: what culling is for.
    MISSED  the same, but not culled.
    WRONG   is visible in a pixel, but culled: a hole in the picture.
    LOST    is visible in a pixel, but was held to be outside of the view.
    """

    ABSENT = 0
    SEEN = 1
    CULLED = 2
    MISSED = 3
    WRONG = 4
    LOST = 5


def fates(verdicts: NDArray[np.uint8], fragments: Pixels, visible: Pixels) -> NDArray[np.uint8]:
    """(n,) :class:`Fate` by verdicts and by the pixels that each covers alone and is seen in."""
    hidden, outside = verdicts == Verdict.HIDDEN, verdicts == Verdict.OUTSIDE
    of_seen = np.where(hidden, Fate.WRONG, np.where(outside, Fate.LOST, Fate.SEEN))
    of_hidden = np.where(hidden, Fate.CULLED, Fate.MISSED)
    found = np.where(visible > 0, of_seen, np.where(fragments > 0, of_hidden, Fate.ABSENT))
    return np.asarray(found, dtype=np.uint8)


def object_verdicts(
    verdicts: NDArray[np.uint8], object_of: IntArray, count: int
) -> NDArray[np.uint8]:
    """(count,) of objects by their parts': visible if one is, else hidden if one is."""
    drawn, hidden = (
        np.bincount(object_of[verdicts == verdict], minlength=count) > 0
        for verdict in (Verdict.VISIBLE, Verdict.HIDDEN)
    )
    found = np.where(drawn, Verdict.VISIBLE, np.where(hidden, Verdict.HIDDEN, Verdict.OUTSIDE))
    return np.asarray(found, dtype=np.uint8)


def object_sums(pixels: Pixels, object_of: IntArray, count: int) -> Pixels:
    """(count,) pixels of objects by their parts'."""
    sums = np.zeros(count, dtype=np.int64)
    np.add.at(sums, object_of, pixels)
    return sums


@dataclass(frozen=True)
class Counts:
    """How many parts, or objects, met each fate.

    ``in_view``  cover the centre of a pixel alone.
    ``hidden``   of these are visible in no pixel.
    ``culled``   of the hidden ones; the others are ``missed``.
    ``wrong``    are culled although they are visible.
    ``lost``     are held to be outside of the view although they are visible: a fault, always 0.
    """

    in_view: int = 0
    hidden: int = 0
    culled: int = 0
    wrong: int = 0
    lost: int = 0

    @classmethod
    def of(cls, found: NDArray[np.uint8]) -> Counts:
        """Of fates (n,)."""
        number = np.bincount(found, minlength=len(Fate)).tolist()
        culled, missed = number[Fate.CULLED], number[Fate.MISSED]
        return cls(
            len(found) - number[Fate.ABSENT], culled + missed, culled,
            number[Fate.WRONG], number[Fate.LOST],
        )  # fmt: skip

    @classmethod
    def total(cls, several: Iterable[Counts]) -> Counts:
        """All of them added up."""
        return cls(*(sum(column) for column in zip(*map(astuple, several), strict=True)))

    @property
    def missed(self) -> int:
        return self.hidden - self.culled

    @property
    def recall(self) -> float | None:
        """Share of the hidden ones that are culled; None where nothing is hidden."""
        return self.culled / self.hidden if self.hidden else None
